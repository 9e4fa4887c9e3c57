#!/usr/bin/python3
"""docs/pictures/cracked_cylinder.png, from the runs that scripts/validate has made."""
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from blastPictures import square
from casePictures import np, pyplot, save, validated
from damagePoints import DAMAGE, LABEL
from flowFields import nearest, points, values

CASE = "cracked_cylinder"
RUN, LIMITS = "E30", (0.9, 3.7)


def centres(run):
    """Of the fluid cells, from the widths in overrides as blockMesh grades them."""
    given = dict(re.findall(r"(\w+) ([^;]+);", (run / "system" / "overrides").read_text()))

    def axis(name, ends):
        nodes = [ends[0]]
        for k in (1, 2, 3):
            n, grade = int(given[f"cells{name}{k}"]), float(given[f"grade{name}{k}"])
            width = np.full(n, 1.0) if n == 1 else grade ** (np.arange(n) / (n - 1))
            nodes += list(ends[k - 1] + (ends[k] - ends[k - 1]) * np.cumsum(width) / width.sum())
        return np.array(nodes)
    return axis("X", (0, 1.3, 2.9, 10)), axis("Y", (0, 5.3, 6.7, 12))


def on_grid(field, x, y):
    """Of cells in nine blocks, as rows of y."""
    nx = [np.sum((x[1:] <= b + 1e-9) & (x[1:] > a + 1e-9)) for a, b in
          ((0, 1.3), (1.3, 2.9), (2.9, 10))]
    ny = [np.sum((y[1:] <= b + 1e-9) & (y[1:] > a + 1e-9)) for a, b in
          ((0, 5.3), (5.3, 6.7), (6.7, 12))]
    rows, start = [], 0
    for j in range(3):
        parts = []
        for i in range(3):
            n = nx[i] * ny[j]
            parts.append(field[start:start + n].reshape(ny[j], nx[i]))
            start += n
        rows.append(np.hstack(parts))
    return np.vstack(rows)


run = validated(CASE, RUN)
folder = nearest(run, 1)
x, y = centres(run)
U = np.array(values(folder / "U"))
mach = np.hypot(U[:, 0], U[:, 1]) / np.sqrt(1.4 * 287 * np.array(values(folder / "T")))
figure, axes = pyplot.subplots(1, 5, figsize=(12.5, 3.4), width_ratios=(1.5, 1, 1, 1, 1))
shown = axes[0].pcolormesh(x, y, on_grid(mach, x, y), cmap="viridis", vmin=0, vmax=2,
                           rasterized=True)
axes[0].set(aspect="equal", xlim=LIMITS, ylim=(4.6, 7.4), xticks=[], yticks=[],
            title=f"Mach number, 30 MPa, {1e3*float(folder.name):.0f} ms")
figure.colorbar(shown, ax=axes[0], shrink=0.7)
for axis, name in zip(axes[1:], ("E30", "E40", "E50", "E60")):
    folder = nearest(validated(CASE, name), 1)
    _, now, damage = points(folder, "cylinder", "damage")
    now = np.array(now) - np.median(now, axis=0)
    dots = square(axis, now, 0.02, np.array(damage), (-0.65, 0.65), cmap=DAMAGE, vmin=0,
                  vmax=0.8)
    axis.set_title(f"{name[1:]} MPa, {1e3*float(folder.name):.0f} ms")
figure.colorbar(dots, ax=axes[1:], label=LABEL, extend="max", shrink=0.7)
save(figure, CASE)
