"""The runs of Kalthoff and Winkler's plate, and what is read from them."""
import functools
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from writtenFields import cell_field, places, write_times

RUNS = {
    "space16": ["dimension=3"],
    "strain100": ["dimension=2", "N=100"],
    "strain200": ["dimension=2", "N=200"],
    "stress200": ["dimension=2", "N=200", "plane=planeStress"],
}

NOTCH = 50.0, 25.0  # tip of the upper one, mm; the lower one is its mirror image
CRACKED = 0.4  # damage beyond which a point is cracked
FIRST, LAST = 2.0, 25.0  # distances from the tip that the fit spans, mm


@functools.lru_cache(maxsize=None)
def cracked(run):
    """The cracked points at the end, (along, outward) from the tip in mm, upper and lower."""
    folder = list(write_times(run.folder).values())[-1]
    damage = cell_field(folder / "plate" / "damage")
    sides = [], []
    for (x, y, _), phi in zip(places(run.folder, "plate"), damage):
        if phi > CRACKED:
            sides[y < 0].append((1e3 * x - NOTCH[0], abs(1e3 * y) - NOTCH[1]))
    return sides


def angles(run, last=LAST):
    """Degrees between the notches and the lines that fit the cracked points of each best."""
    fitted = []
    for side in cracked(run):
        near = [p for p in side if FIRST < math.hypot(*p) < last and p[1] > 0]
        if len(near) < 3:
            return [float("nan")]
        mx = sum(p[0] for p in near) / len(near)
        my = sum(p[1] for p in near) / len(near)
        xx = sum((p[0] - mx) ** 2 for p in near)
        yy = sum((p[1] - my) ** 2 for p in near)
        xy = sum((p[0] - mx) * (p[1] - my) for p in near)
        fitted.append(math.degrees(0.5 * math.atan2(2 * xy, xx - yy)) % 180)
    return fitted


def angle(run):
    """Mean of both sides."""
    both = angles(run)
    return sum(both) / len(both)


def asymmetry(run):
    both = angles(run)
    return max(both) - min(both)


def growth(run):
    """How far from the notches' tips cracked points are, at most, mm."""
    return max(math.hypot(*p) for side in cracked(run) for p in side if p[1] > 0)
