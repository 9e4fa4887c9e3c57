"""The runs of the pre-cracked plate's validation, and what is read from them."""
import functools
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from writtenFields import at, cell_field, write_times

RUNS = {
    "noFailure": ["variant=noFailure"],
    "growth": ["variant=growth"],
    "branching": ["variant=branching"],
    "quick": ["variant=growth", "N=100"],
}

EDGE = 50.0  # of the plate, mm
ROWS = 3  # of points beyond its lower and its upper edge
TIP = 5.0  # mm
GONE = 0.5  # damage beyond which a point is cracked
BRANCHED = 0.35  # damage on a face of a crack; a plain cut leaves 11/28 = 0.39


@functools.lru_cache(maxsize=None)
def field(run, name, microseconds):
    folder = at(write_times(run.folder), microseconds * 1e-6)
    return cell_field(folder / "plate" / name)


class Lattice:
    """Places of the points in mm; the cells go along x first."""

    def __init__(self, points):
        self.across = round((ROWS**2 + points) ** 0.5) - ROWS
        self.step = EDGE / self.across

    def x(self, cell):
        return (cell % self.across + 0.5) * self.step - EDGE / 2

    def y(self, cell):
        return (cell // self.across - ROWS + 0.5) * self.step - EDGE / 2

    def column(self, x):
        return (x + EDGE / 2) / self.step - 0.5

    def row(self, y):
        return (y + EDGE / 2) / self.step - 0.5 + ROWS

    def nearest(self, x, y):
        """The cells around a place, one, two or four of them."""
        c, r = self.column(x), self.row(y)
        columns = {int(c + 1e-6), int(c + 1 - 1e-6)}
        rows = {int(r + 1e-6), int(r + 1 - 1e-6)}
        return [i * self.across + k for i in rows for k in columns]


def pulled(run, x, y):
    """u_y in um at (x, y) mm at the end, the mean of the nearest points."""
    u = field(run, "displacement", 16.71)
    cells = Lattice(len(u) // 3).nearest(x, y)
    return 1e6 * sum(u[3 * cell + 1] for cell in cells) / len(cells)


def along_crack(x):
    return lambda run: pulled(run, x, 0.05)


def across_crack(y):
    return lambda run: pulled(run, 0, y)


# u_y_x<100 x> on y = 0.05 mm, u_y_y<100 y> on x = 0
for hundredths in range(5, 506, 100):
    globals()[f"u_y_x{hundredths}"] = along_crack(hundredths / 100)
for hundredths in range(505, 2006, 500):
    globals()[f"u_y_y{hundredths}"] = across_crack(hundredths / 100)


def growth(run, microseconds):
    """How far beyond its tip on the right the crack has come, mm."""
    damage = field(run, "damage", microseconds)
    lattice = Lattice(len(damage))
    cracked = [lattice.x(i) for i, phi in enumerate(damage) if phi > GONE]
    return max(cracked, default=TIP) - TIP


def growth_10(run):
    return growth(run, 10)


def growth_15(run):
    return growth(run, 15)


def growth_end(run):
    return growth(run, 16.71)


def start(run):
    """When a point beyond the tip is cracked for the first time, us."""
    for time in write_times(run.folder):
        if growth(run, 1e6 * time) > 0:
            return 1e6 * time
    return float("inf")


def branches(run):
    """In how many places a column crosses the crack on the right, at most: 1, a line; 2 and
    more, branches. Damaged points less than 1 mm apart are one place."""
    damage = field(run, "damage", 16.71)
    lattice = Lattice(len(damage))
    columns = {}
    for cell, phi in enumerate(damage):
        if phi > BRANCHED and lattice.x(cell) > TIP:
            columns.setdefault(cell % lattice.across, []).append(lattice.y(cell))
    most = 0
    for heights in columns.values():  # in order already: the rows go up
        gaps = sum(b - a > 1 for a, b in zip(heights, heights[1:]))
        most = max(most, 1 + gaps)
    return most


def asymmetry(run):
    """Largest difference of the crack's damage between the left and the right half."""
    damage = field(run, "damage", 16.71)
    across = Lattice(len(damage)).across
    return max(
        abs(phi - damage[cell - cell % across + across - 1 - cell % across])
        for cell, phi in enumerate(damage)
    )
