"""The runs of the brittle ring, and what is read from them."""
import functools
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from flowFields import nearest, points, values
from fragments import BROKEN, broken_share, fragments

APART = ["coupling=partitioned"]
RUNS = {
    "printed": ["N=12", "frames=1", *APART],
    "thousand": ["N=12", "charge=1000", "duration=75", "frames=3", *APART],
    **{f"apart{n}": [f"N={n}", "charge=250", *APART] for n in (12, 15, 20, 30)},
    "immersed12": ["N=12", "charge=250"],
    "released12": ["N=12", "charge=250", "release=60"],
}
COMPARED = 100e-6  # s, when the paper compares its meshes
SECTORS = 120


def given(run, key, standard):
    for line in (run.folder / "system/overrides").read_text().splitlines():
        name, value = line.split(";")[0].split()[:2]
        if name == key:
            return float(value)
    return standard


@functools.lru_cache(maxsize=None)
def state(folder):
    rest, now, damage = points(folder, "ring", "damage")
    return rest, now, damage


def compared(run):
    return state(nearest(run.folder, COMPARED))


def pieces(run):
    """Fragments of at least 0.5 % of the ring at 100 us."""
    rest, _, damage = compared(run)
    return len(fragments(rest, damage, 0.03 / given(run, "N", 12)))


def largest(run):
    """Of them, share of the ring [%]."""
    rest, _, damage = compared(run)
    return 100 * fragments(rest, damage, 0.03 / given(run, "N", 12))[0]


def cracked(run):
    """Share of the points with damage above one half at 100 us [%]."""
    return broken_share(compared(run)[2])


def sector(x, y):
    return int(SECTORS * (math.atan2(y, x) / (2 * math.pi) % 1)) % SECTORS


def profile(run):
    """Share of broken points in sectors over the angle, at 100 us."""
    count, total = [0] * SECTORS, [0] * SECTORS
    rest, _, damage = compared(run)
    for (x, y, _), d in zip(rest, damage):
        k = sector(x, y)
        total[k] += 1
        count[k] += d >= BROKEN
    return [c / t for c, t in zip(count, total)]


def inner_cracks(run):
    """Bands of broken points around the inner third of the wall."""
    rest, _, damage = compared(run)
    broken, total = [0] * SECTORS, [0] * SECTORS
    for (x, y, _), d in zip(rest, damage):
        if math.hypot(x, y) < 0.08:
            k = sector(x, y)
            total[k] += 1
            broken[k] += d >= BROKEN
    full = [b > 0.5 * t for b, t in zip(broken, total)]
    return sum(full[k] and not full[k - 1] for k in range(SECTORS))


def likeness(one, other):
    """Correlation of the damage profiles over the angle of two runs."""
    a, b = profile(one), profile(other)
    ma, mb = sum(a) / SECTORS, sum(b) / SECTORS
    ab = sum((x - ma) * (y - mb) for x, y in zip(a, b))
    aa, bb = sum((x - ma)**2 for x in a), sum((y - mb)**2 for y in b)
    return ab / math.sqrt(aa * bb) if aa * bb > 0 else 0.0


def broken(run):
    return run.table("ring")["brokenBonds"][-1]


def first_crack(run):
    """When the first bond breaks [us]."""
    t = run.table("ring")
    return 1e6 * next((s for s, b in zip(t["Time"], t["brokenBonds"]) if b > 0), math.nan)


def gas_outside(run):
    """Largest speed of the gas beyond 1.15 outer radii at the end [m/s]."""
    folder = nearest(run.folder, 1)
    U = values(folder / "U")
    n = round(len(U) ** 0.5)
    fastest = 0.0
    for k, u in enumerate(U):
        x, y = ((k % n + 0.5) / n - 0.5) * 0.3, ((k // n + 0.5) / n - 0.5) * 0.3
        if math.hypot(x, y) > 0.115:
            fastest = max(fastest, math.hypot(u[0], u[1]))
    return fastest


def hoop_stress(run):
    """Largest von Mises stress inside, on the x axis [GPa]."""
    t = run.table("inside")
    return 1e-9 * max(math.sqrt(((a - b)**2 + (b - c)**2 + (c - a)**2) / 2 + 3 * d * d)
                      for a, b, c, d in zip(*(t[f"sigma_{s}"] for s in ("xx", "yy", "zz", "xy"))))
