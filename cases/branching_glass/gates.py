"""The runs of the branching crack in glass, and what is read from them."""
import functools
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from writtenFields import cell_field, places, write_times

RUNS = {
    "glass": [],
    "afterForce": ["breakAfterForce=yes"],
    "fine": ["N=240"],
}

NOTCH = 50.0  # mm
CRACKED = 0.35  # damage on a face of a crack; a plain cut leaves 0.39
APART = 1.0  # mm: damaged points that are nearer are one crack (the horizon)


@functools.lru_cache(maxsize=None)
def columns(run, folder):
    """{x in mm: heights of the cracked points} beyond the notch, in order."""
    damage = cell_field(folder / "plate" / "damage")
    found = {}
    for (x, y, _), phi in zip(points(run), damage):
        if phi > CRACKED and 1e3 * x > NOTCH:
            found.setdefault(round(1e3 * x, 4), []).append(1e3 * y)
    return {x: sorted(found[x]) for x in sorted(found)}


@functools.lru_cache(maxsize=None)
def points(run):
    return places(run.folder, "plate")


def side_by_side(heights):
    """Cracks that a column crosses."""
    return 1 + sum(b - a > APART for a, b in zip(heights, heights[1:]))


def at_end(run):
    return columns(run, list(write_times(run.folder).values())[-1])


def most(run):
    return max(side_by_side(heights) for heights in at_end(run).values())


def changes(run):
    """How often the number of cracks side by side grows from the notch to the right."""
    counts = [side_by_side(heights) for heights in at_end(run).values()]
    return sum(b > a for a, b in zip(counts, counts[1:]))


def branching_place(run):
    """x where one crack becomes two, mm."""
    return next(x for x, heights in at_end(run).items() if side_by_side(heights) > 1)


def branching_time(run):
    """First write time with two cracks side by side, us."""
    for time, folder in write_times(run.folder).items():
        if any(side_by_side(h) > 1 for h in columns(run, folder).values()):
            return 1e6 * time
    return float("inf")


def asymmetry(run):
    """Farthest points of the upper and of the lower branch: difference of their heights."""
    heights = list(at_end(run).values())[-1]
    return abs(max(heights) + min(heights))
