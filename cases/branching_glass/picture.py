#!/usr/bin/python3
"""docs/pictures/branching_glass.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from casePictures import pyplot, save, validated
from damagePoints import LABEL, SCALE, draw_points, state

CASE = "branching_glass"
PANELS = (("glass", 22, "300 x 120 points"), ("glass", 30, "300 x 120 points"),
          ("glass", 43, "300 x 120 points"), ("fine", 43, "600 x 240 points"))

figure, axes = pyplot.subplots(2, 2, figsize=(10, 4.6))
panels = []
for axis, (name, time, title) in zip(axes.flat, PANELS):
    found = state(validated(CASE, name), "plate", time)
    panels.append((axis, *found))
    axis.set(aspect="equal", xlim=(-1, 101), ylim=(-21, 21), xticks=[], yticks=[],
             title=f"{title}, {found[-1]:.0f} µs")
    axis.spines[:].set_visible(False)
axes[1, 0].plot([0, 20], [-20.9, -20.9], color="k", lw=2)
axes[1, 0].text(21, -20.9, "20 mm", va="center")
figure.colorbar(SCALE, ax=axes, label=LABEL, extend="max", shrink=0.7, pad=0.01)
figure.draw_without_rendering()
for axis, X, u, damage, _ in panels:
    draw_points(axis, X, X + u, damage)
save(figure, CASE)
