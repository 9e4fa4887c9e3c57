#!/usr/bin/python3
"""docs/pictures/kalthoff_winkler.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from casePictures import np, pyplot, save, validated
from damagePoints import LABEL, SCALE, draw_points, state

CASE = "kalthoff_winkler"
PANELS = (("space16", 50, "in space"), ("space16", 90, "in space"),
          ("strain200", 90, "plane strain"), ("stress200", 90, "plane stress"))
TIP, REACH = (50, 25), 75  # mm

figure, axes = pyplot.subplots(1, 4, figsize=(10.5, 4.9))
panels = []
for axis, (name, time, title) in zip(axes, PANELS):
    found = state(validated(CASE, name), "plate", time)
    panels.append((axis, *found))
    axis.set(aspect="equal", xlim=(-2, 105), ylim=(-104, 104), xticks=[], yticks=[],
             title=f"{title}, {found[-1]:.0f} µs")
    axis.spines[:].set_visible(False)
    for angle in np.radians((65, 70)):
        for way in (1, -1):
            axis.plot([TIP[0], TIP[0] + REACH * np.cos(angle)],
                      [way * TIP[1], way * (TIP[1] + REACH * np.sin(angle))],
                      color="k", lw=0.7, ls="--", zorder=3)
axes[0].plot([0, 20], [-103.5, -103.5], color="k", lw=2)
axes[0].text(22, -103.5, "20 mm", va="center")
axes[0].annotate("", (-1, 0), (-14, 0), annotation_clip=False,
                 arrowprops={"arrowstyle": "->", "color": "#b03030"})
axes[0].text(74, 90, "70°", ha="right", fontsize=8)
axes[0].text(82, 85, "65°", fontsize=8)
figure.colorbar(SCALE, ax=axes, label=LABEL, extend="max", shrink=0.7, pad=0.01)
figure.draw_without_rendering()
for axis, X, u, damage, _ in panels:
    draw_points(axis, X, X + u, damage)
save(figure, CASE)
