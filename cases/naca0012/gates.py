"""The runs of the airfoil, and what is read from them."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from series import tenth

LEVELS = (64, 128, 256)

RUNS = {
    **{f"c{n}": [f"N={n}"] for n in LEVELS},
    # The pressure there settles long before the drag
    **{f"nose{n}": [f"N={n}", "endTime=3"] for n in (512, 640)},
    "immersed128": ["N=128", "coupling=immersed"],
}

MACH, GAMMA = 0.5, 1.4


def drag(run):
    return tenth(run.table("force_airfoil")["Cd"], 0)


def lift(run):
    """Largest lift coefficient in the last tenth."""
    values = run.table("force_airfoil")["Cl"]
    return max(abs(v) for v in values[9 * len(values) // 10:])


def unsettled(run):
    """Change of the drag between the last two tenths of the run [%]."""
    values = run.table("force_airfoil")["Cd"]
    return 100 * abs(tenth(values, 0) / tenth(values, 1) - 1)


def line(run, name):
    """(x, Cp) along a line of cells."""
    path = next(run.folder.glob(f"postProcessing/lines/*/{name}_p.xy"))
    rows = (map(float, text.split()) for text in path.read_text().splitlines())
    return [(x, (GAMMA * p - 1) / (0.5 * GAMMA * MACH**2)) for x, p in rows]


def stagnation(run):
    """Pressure coefficient at the nose, by a straight line through the last two cells before it:
    pressures in covered cells are not the gas's."""
    (s, a), (x, b) = [cell for cell in line(run, "nose") if cell[0] < 0][-2:]
    return b + (b - a) / (x - s) * (0 - x)


def stagnation_limit(fine, coarse):
    """Of cells without width: the error is of first order, and the cells' ratio 2."""
    return 2 * stagnation(fine) - stagnation(coarse)


def asymmetry(run):
    """Largest difference of Cp between the two sides, on lines 1/16 from the chord."""
    return max(abs(a - b) for (_, a), (_, b) in zip(line(run, "above"), line(run, "below")))
