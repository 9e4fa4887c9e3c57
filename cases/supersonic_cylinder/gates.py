"""The runs of the supersonic cylinder, and what is read from them."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from series import tenth

IMMERSED = ["coupling=immersed", "shrink=1"]

RUNS = {
    **{f"d{n}": [f"N={n}"] for n in (16, 32, 64)},
    **{f"immersed{n}": [f"N={n}", *IMMERSED] for n in (16, 32)},
}

MACH, GAMMA = 2, 1.4


def drag(run):
    return tenth(run.table("force_cylinder")["Cd"], 0)


def unsettled(run):
    """Change of the drag between the last two tenths of the run [%]."""
    values = run.table("force_cylinder")["Cd"]
    return 100 * abs(tenth(values, 0) / tenth(values, 1) - 1)


def line(run):
    """(x, Cp) along the row of cells next to the axis, up to the cylinder."""
    path = next(run.folder.glob("postProcessing/front/*/axis_p.xy"))
    rows = (map(float, text.split()) for text in path.read_text().splitlines())
    return [(x, (GAMMA * p - 1) / (0.5 * GAMMA * MACH**2)) for x, p in rows if x < 1.5]


def stagnation(run):
    """Pressure coefficient in the last cell before the cylinder."""
    return line(run)[-1][1]


def stand_off(run):
    """Distance of the bow shock, where half of its jump is reached, in diameters."""
    rows = line(run)
    half = 0.5 * max(cp for x, cp in rows if x < 1.2)
    for (s, a), (x, b) in zip(rows, rows[1:]):
        if a < half <= b:
            return 1.5 - (s + (half - a) / (b - a) * (x - s))
    return 0
