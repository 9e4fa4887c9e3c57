"""What the picture.py of the blast cases share: a gas field on equal cells, points on top."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from casePictures import np, pyplot
from damagePoints import DAMAGE
from flowFields import nearest, points, values


def speed(folder, low, width):
    """Of the gas, on the square of equal cells that begins at (low, low), in mm."""
    U = np.array(values(folder / "U"))
    n = int(round(len(U) ** 0.5))
    edges = 1e3 * (low + width * np.arange(n + 1) / n)
    return edges, np.hypot(U[:, 0], U[:, 1]).reshape(n, n)


def square(axes, x, spacing, colours, limits, **keys):
    """Points as squares of the spacing at rest [mm]."""
    axes.set(aspect="equal", xlim=limits, ylim=limits, xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.figure.draw_without_rendering()
    wide = 72 * axes.get_window_extent().width / axes.figure.dpi
    size = (1.15 * wide * spacing / (limits[1] - limits[0])) ** 2
    order = np.argsort(colours, kind="stable")
    return axes.scatter(x[order, 0], x[order, 1], c=colours[order], marker="s", linewidths=0,
                        s=size, rasterized=True, **keys)


def panel(axes, run, body, seconds, spacing, gas, limits, top, field="damage", **keys):
    """Speed of the gas below the points, these coloured by a field; returns both artists."""
    folder = nearest(run, seconds)
    edges, u = speed(folder, *gas)
    shown = axes.pcolormesh(edges, edges, u, cmap="Blues_r", vmin=0, vmax=top, rasterized=True)
    _, now, colours = points(folder, body, field)
    keys = keys or {"cmap": DAMAGE, "vmin": 0, "vmax": 0.8}
    dots = square(axes, 1e3 * np.array(now), spacing, np.array(colours), limits, **keys)
    return shown, dots, 1e6 * float(folder.name)
