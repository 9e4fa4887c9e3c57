"""The runs of the cracked cylinder, and what is read from them."""
import functools
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from flowFields import nearest, points

RUNS = {
    **{f"E{modulus}": ["N=32", f"E={modulus}e6"] for modulus in (30, 40, 50, 60)},
    "coarse": ["N=16", "duration=6", "frames=6"],
}

BROKEN = 0.4
HALF = 0.1  # of the pre-crack [m]
NEAR = 0.4  # of the middle: the cracks that are looked at [m]
BRANCHES = 0.34  # and for forks, away from the rim along which cracks run [m]


@functools.lru_cache(maxsize=None)
def cracked(folder):
    """The broken points of the middle at rest, from there."""
    rest, _, damage = points(folder, "cylinder", "damage")
    return [(x - 2, y - 6) for (x, y, _), d in zip(rest, damage)
            if d >= BROKEN and math.hypot(x - 2, y - 6) < NEAR]


def tip(run, way):
    """How far the crack goes on beyond the pre-crack's tip, downstream (1) or up (-1) [m]."""
    found = [way * x for x, y in cracked(nearest(run.folder, 1))]
    return max(found, default=0) - HALF


def downstream(run):
    return tip(run, 1)


def upstream(run):
    return tip(run, -1)


def fork(run, way):
    """Degrees between the branches, 0 without any: x of broken points beyond the pre-crack's
    tip and more than 0.06 m off the axis, by a straight line over their |y|. Beyond 180 they
    turn back."""
    off = [(way * x, abs(y)) for x, y in cracked(nearest(run.folder, 1))
           if way * x > HALF and abs(y) > 0.06 and math.hypot(x, y) < BRANCHES]
    if len(off) < 6:
        return 0.0
    mx, my = (sum(p[i] for p in off) / len(off) for i in (0, 1))
    slope = (sum((x - mx) * (y - my) for x, y in off)
             / sum((y - my)**2 for _, y in off))
    return 2 * math.degrees(math.atan2(1, slope))


def fork_right(run):
    return fork(run, 1)


def fork_left(run):
    return fork(run, -1)


def begins(run):
    """When the first bond breaks [ms]."""
    t = run.table("cylinder")
    first = t["brokenBonds"][0]
    return 1e3 * next((s for s, b in zip(t["Time"], t["brokenBonds"]) if b > first), math.nan)


def drag(run):
    """Mean over the last quarter, over that of 1/2 rho U^2 D."""
    t = run.table("force_cylinder")
    n = 3 * len(t["Time"]) // 4
    rho, speed = 1e5 / (287 * 300), 1.7 * math.sqrt(1.4 * 287 * 300)
    return sum(t["force_x"][n:]) / len(t["force_x"][n:]) / (0.5 * rho * speed**2 * 0.1)
