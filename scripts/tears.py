"""Where a run's bodies have torn at a time: pvbatch tears.py <run> <time>

Prints the write time, the first one from <time> on, then a line for each place: x, y and
z of its middle in the body at rest, and the highest damage there.
"""

import sys

import numpy as np

from writtenRun import arrays, sources, spacing, times_and_bodies

SMALL_SHARE = 0.05  # of all damage; places with less are left out


def groups(position, reach):
    """The number of the group of each position; in one are those within reach."""
    near = np.linalg.norm(position[:, None] - position[None], axis=2) < reach
    group = np.arange(len(position))
    while True:
        lowest = np.where(near, group, len(group)).min(axis=1)
        if (lowest == group).all():
            return group
        group = lowest


def places(position, displacement, damage):
    """Rows of x, y, z and the highest damage."""
    broken = damage > 0
    if not broken.any():
        return
    reference, damage = (position - displacement)[broken], damage[broken]
    group = groups(reference, 2.5 * spacing(position, displacement))
    for number in np.unique(group):
        mine = group == number
        if damage[mine].sum() > SMALL_SHARE * damage.sum():
            middle = np.average(reference[mine], axis=0, weights=damage[mine])
            yield [*middle, damage[mine].max()]


def main(folder, wanted):
    times, names = times_and_bodies(folder)
    time = next((t for t in times if t >= float(wanted)), times[-1])
    print("%.4g" % time)
    for body in sources(folder, names)[1]:
        for place in places(*arrays(body, time, "displacement", "damage")):
            print("%.4g %.4g %.4g %.2f" % tuple(place))


main(*sys.argv[1:])
