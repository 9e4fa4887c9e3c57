#!/usr/bin/python3
"""docs/pictures/compressed_block.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from casePictures import COLOURS, GREY, np, points, pyplot, save, table, validated

CASE = "compressed_block"
REFERENCE = -4.4058  # reference.csv

figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.5, 3.6), width_ratios=(1.7, 1))

rest, moved, J = points(validated(CASE, "points40"), "1", "block", "J")
left.add_patch(pyplot.Rectangle((10, 15), 20, 10, fill=False, color=GREY, ls="--", zorder=3))
places = rest + moved
dots = left.scatter(places[:, 0], places[:, 1], c=J, s=7, marker="s", lw=0, cmap="viridis")
figure.colorbar(dots, ax=left, label="J", shrink=0.8)
for x in np.linspace(15.5, 24.5, 7):
    left.annotate("", (x, 25.3), (x, 26.7), arrowprops={"arrowstyle": "->", "color": "#b03030"})
left.text(20, 26.9, "200 dyn/cm$^2$, dead", ha="center", color="#b03030")
left.set(aspect="equal", xlabel="x [cm]", ylabel="y [cm]", ylim=(14, 28.3),
         title="N = 40; dashed: at rest")

spacing = np.array([10 / n for n in (20, 40, 80)])
for kind, label, colour in (("points", "rows of points on top and bottom", COLOURS[0]),
                            ("cells", "half a spacing inside", COLOURS[1])):
    u = [table(validated(CASE, f"{kind}{n}"), "topMiddle")["displacement_y"][-1]
         for n in (20, 40, 80)]
    right.plot(spacing, u, "o-", color=colour, label=label)
    right.plot([spacing[-1], 0], [u[-1], 2 * u[-1] - u[-2]], ":", color=colour)
right.axhline(REFERENCE, color="k", lw=0.8)
right.text(0.5, REFERENCE - 0.005, "finite elements", ha="right", va="top")
right.axhspan(1.02 * REFERENCE, 0.98 * REFERENCE, color=GREY, alpha=0.15, lw=0)
right.set(xlabel="spacing of points [cm]", ylabel="u$_y$ at (20, 25) [cm]", xlim=(0, 0.55), ylim=(-4.52, -4.05),
          title="grey: within 2 %; dotted: extrapolated")
right.legend(frameon=False, loc="upper left")
save(figure, CASE)
