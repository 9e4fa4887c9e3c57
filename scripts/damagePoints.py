"""A body's points in the deformed shape, coloured by damage: what scripts/draw and the
picture.py of the fracture cases share. Lengths are in mm, times in us."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize

from writtenFields import at, cell_field, places, write_times

TOP = 0.8  # damage of the darkest colour
# Sound material is pale, so that cracks stand out
DAMAGE = LinearSegmentedColormap.from_list(
    "damage", ["#d9dee4", "#b9c3cf", "#f0a03c", "#c8281e", "#500000"]
)
SCALE = ScalarMappable(Normalize(0, TOP), DAMAGE)  # for a colour bar
LABEL = "damage (share of broken bonds)"


def state(run, body, microseconds):
    """Reference places, displacements (mm), damage and time (us), in the middle layer."""
    times = write_times(run)
    folder = at(times, microseconds * 1e-6 if microseconds else max(times))
    X = 1e3 * np.array(places(run, body))
    u = 1e3 * np.array(cell_field(folder / body / "displacement")).reshape(-1, 3)
    damage = np.array(cell_field(folder / body / "damage"))
    z = np.unique(X[:, 2].round(6))
    layer = abs(X[:, 2] - z[len(z) // 2]) < 1e-3
    return X[layer], u[layer], damage[layer], 1e6 * float(folder.name)


def draw_points(axes, X, x, damage):
    """Squares as wide as the points at rest are apart. The limits of axes, and where it is in
    the figure, have to be final."""
    step = np.diff(np.unique(X[:, 0].round(6))).min()
    left, right = axes.get_xlim()
    points = 72 * axes.get_window_extent().width / axes.figure.dpi
    order = np.argsort(damage, kind="stable")  # the cracked ones on top
    axes.scatter(
        x[order, 0], x[order, 1], c=damage[order], marker="s", linewidths=0,
        s=(1.2 * points * step / (right - left)) ** 2, cmap=DAMAGE, vmin=0, vmax=TOP,
        rasterized=True,
    )
