"""The runs of the ductile square, and what is read from them."""
import functools
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from flowFields import nearest, points
from fragments import BROKEN, broken_share, fragments

APART = ["coupling=partitioned"]
RUNS = {
    "printed": ["N=12", "frames=1", *APART],
    "thousand": ["N=12", "charge=1000", "duration=150", "frames=6", *APART],
    **{f"apart{n}": [f"N={n}", "charge=250", *APART] for n in (12, 15, 21, 30)},
    "immersed12": ["N=12", "charge=250"],
    "released12": ["N=12", "charge=250", "release=75"],
}


def points_across(run):
    for line in (run.folder / "system/overrides").read_text().splitlines():
        if line.startswith("N "):
            return int(line[2:].split(";")[0])
    return 12


@functools.lru_cache(maxsize=None)
def state(folder):
    return points(folder, "square", "damage", "plasticStrain")


def last(run):
    return state(nearest(run.folder, 1))


def pieces(run):
    """Fragments of at least 0.5 % of the square at the end."""
    rest, _, damage, _ = last(run)
    return len(fragments(rest, damage, 0.03 / points_across(run)))


def cracked(run):
    """Share of the points with damage above one half at the end [%]."""
    return broken_share(last(run)[2])


def crack_width(run):
    """Area of the cracks at 100 us over four times the diagonal of a corner [mm]."""
    rest, _, damage, _ = state(nearest(run.folder, 100e-6))
    area = sum(d >= BROKEN for d in damage) * (30 / points_across(run))**2
    return area / (4 * 30 * math.sqrt(2))


def corner_points(run):
    """The broken points of the upper right corner at 100 us, from their middle."""
    rest, _, damage, _ = state(nearest(run.folder, 100e-6))
    near = [(x, y) for (x, y, _), d in zip(rest, damage)
            if d >= BROKEN and x > 0.03 and y > 0.03]
    mx, my = (sum(p[i] for p in near) / max(len(near), 1) for i in (0, 1))
    return [(x - mx, y - my) for x, y in near]


def crack_angle(run):
    """Of the cracks from the inner corners at 100 us, to the sides [deg]: principal axis of
    the broken points of the upper right corner, 45 along the diagonal."""
    near = corner_points(run)
    if len(near) < 3:
        return math.nan
    xx = sum(p[0]**2 for p in near)
    yy = sum(p[1]**2 for p in near)
    xy = sum(p[0] * p[1] for p in near)
    return math.degrees(0.5 * math.atan2(2 * xy, xx - yy)) % 180


def branch_angle(run):
    """Of the branches to the side of the wall that they run along [deg]: mean direction from
    the inner corner of broken points more than 10 mm away, folded at the diagonal."""
    rest, _, damage, _ = state(nearest(run.folder, 100e-6))
    found = []
    for (x, y, _), d in zip(rest, damage):
        a, b = sorted((abs(x) - 0.05, abs(y) - 0.05))
        if d >= BROKEN and math.hypot(a, b) > 0.01:
            found.append(math.degrees(math.atan2(a, b)))
    return sum(found) / len(found) if found else math.nan


def slenderness(run):
    """Of these points: spread along the axis over across."""
    near = corner_points(run)
    if len(near) < 3:
        return math.nan
    along = sum((p[0] + p[1])**2 for p in near)
    across = sum((p[0] - p[1])**2 for p in near)
    return math.sqrt(along / across) if across else math.inf


def corner_first(run):
    """Distance from the inner corner of the point that breaks first, by the first write time
    with broken points [mm]."""
    for seconds in (25e-6 * k for k in range(1, 10)):
        rest, _, damage, _ = state(nearest(run.folder, seconds))
        top = max(range(len(damage)), key=damage.__getitem__)
        if damage[top] >= BROKEN:
            hurt = [p for p, d in zip(rest, damage) if d >= BROKEN]
            return 1e3 * min(math.hypot(abs(x) - 0.05, abs(y) - 0.05) for x, y, _ in hurt)
    return math.nan


def width_ratio(one, other):
    return crack_width(one) / crack_width(other)


def cracked_ratio(one, other):
    return cracked(one) / cracked(other)


def bent(run):
    """Largest plastic strain of points that are not broken, at the end."""
    return max(e for d, e in zip(*last(run)[2:]) if d < 0.1)


def broken(run):
    return run.table("square")["brokenBonds"][-1]
