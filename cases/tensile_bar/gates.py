"""The runs of the tensile bar's validation, and what is read from them.

Stress and plastic strain are those of the middle; the strain is ln(length/length at rest) of
a gauge of four spacings there. In uniaxial stress the rate form gives
sigma = E strain up to yield and then sigma = Y + E H/(E + H) (strain - Y/E).
"""
import math
import re

RUNS = {
    "order1": [],
    "order2": ["order=2", "horizon=3.015"],
    "softer": ["hardening=1e9"],
    "planeStrain": ["plane=planeStrain"],
    "space": ["dimension=3", "length=24", "width=4"],
}
SPACING, E, NU, YIELD = 1e-3, 200e9, 0.29, 0.4e9


def given(run, key, standard):
    text = (run.folder / "system/overrides").read_text()
    found = re.search(rf"^{key} (\S+);", text, re.M)
    return float(found[1]) if found else standard


def hardening(run):
    return given(run, "hardening", 10e9)


def history(run):
    """Rows (time over its end, strain, stress, von Mises, plastic strain)."""
    middle, left, right = (run.table(n) for n in ("middle", "gaugeLeft", "gaugeRight"))
    rows = []
    for k, time in enumerate(middle["Time"]):
        apart = right["displacement_x"][k] - left["displacement_x"][k]
        xx, yy, zz, xy = (middle[f"sigma_{c}"][k] for c in ("xx", "yy", "zz", "xy"))
        mises = math.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2
                          + 3 * xy * xy)
        rows.append((time / middle["Time"][-1], math.log(1 + apart / (4 * SPACING)), xx,
                     mises, middle["plasticStrain"][k]))
    return rows


def slope(points):
    """Of the straight line that fits best."""
    n = len(points)
    x0, y0 = (sum(p[i] for p in points) / n for i in (0, 1))
    return (sum((x - x0) * (y - y0) for x, y in points)
            / sum((x - x0) ** 2 for x, _ in points))


def closed_form(run, strain):
    H = hardening(run)
    if strain < YIELD / E:
        return E * strain
    return YIELD + E * H / (E + H) * (strain - YIELD / E)


def elastic_slope(run):
    """Over E, below 90 % of yield."""
    return slope([(e, s) for t, e, s, m, p in history(run)
                  if t < 0.5 and p == 0 and 0.1 * YIELD < m < 0.9 * YIELD]) / E


def off_the_yield_surface(run):
    """Largest distance of the von Mises stress from Y + H plastic strain while that grows,
    in percent."""
    return max(100 * abs(m / (YIELD + hardening(run) * p) - 1)
               for t, e, s, m, p in history(run) if t <= 0.5 and p > 2e-4)


def off_the_line(run):
    """Largest distance from the closed form while plastic strain grows, in percent."""
    return max(100 * abs(s / closed_form(run, e) - 1)
               for t, e, s, m, p in history(run) if t <= 0.5 and p > 2e-4)


def at(rows, share):
    return min(rows, key=lambda row: abs(row[0] - share))


def pulled(run):
    """Stress when pulled, over the closed form."""
    row = at(history(run), 0.5)
    return row[2] / closed_form(run, row[1])


def drift(run):
    """Change of the stress while held, in percent."""
    rows = history(run)
    return 100 * (at(rows, 0.625)[2] / at(rows, 0.5)[2] - 1)


def unloading_slope(run):
    """Over E, without the first and last tenth."""
    rows = history(run)
    first, last = at(rows, 0.625)[1], at(rows, 0.875)[1]
    return slope([(e, s) for t, e, s, m, p in rows if 0.625 < t < 0.875
                  and 0.1 < (first - e) / (first - last) < 0.9]) / E


def plastic_drift(run):
    """Growth of the plastic strain while unloading, in percent."""
    rows = history(run)
    return 100 * (rows[-1][4] / at(rows, 0.625)[4] - 1)


def force(run):
    """Of the ends when held, over the stress there times the bar's present section."""
    rows = history(run)
    row = at(rows, 0.625)
    narrower = math.exp(-NU * row[2] / E - row[4] / 2)
    width = given(run, "width", 6)
    depth = width if given(run, "dimension", 2) == 3 else 1
    pull = run.table("pullRight")
    k = min(range(len(pull["Time"])),
            key=lambda i: abs(pull["Time"][i] / pull["Time"][-1] - 0.625))
    return pull["force_x"][k] / (row[2] * width * depth * (SPACING * narrower) ** 2)
