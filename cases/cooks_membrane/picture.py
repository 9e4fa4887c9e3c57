#!/usr/bin/python3
"""docs/pictures/cooks_membrane.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from casePictures import COLOURS, GREY, points, pyplot, save, table, validated

CASE = "cooks_membrane"
REFERENCES = {"displacement_y": 0.7669, "displacement_x": -0.6721}  # reference.csv
REFINEMENTS = (12, 24, 48, 96)

figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 4), width_ratios=(1.1, 1))

rest, moved, sigma, held = points(validated(CASE, "N24"), "1", "membrane", "sigmaEq", "held")
left.add_patch(pyplot.Polygon([(0, 0), (4.8, 4.4), (4.8, 6), (0, 4.4)], fill=False,
                              color=GREY, ls="--", zorder=3))
places, free = rest + moved, held == 0
left.plot(*places[~free, :2].T, "s", ms=2, color=GREY)
dots = left.scatter(*places[free, :2].T, c=sigma[free], s=7, lw=0, cmap="viridis")
figure.colorbar(dots, ax=left, label="von Mises stress [dyn/cm$^2$]", shrink=0.8)
left.annotate("", (5.1, 6.3), (5.1, 5.3), arrowprops={"arrowstyle": "->", "color": "#b03030"})
left.text(5.2, 5.7, "6.25\ndyn/cm$^2$", color="#b03030")
left.set(aspect="equal", xlabel="x [cm]", ylabel="y [cm]", xlim=(-1, 6.6),
         title="N = 24; dashed: at rest; grey points: held")

for component, name, colour in (("displacement_y", "u$_y$", COLOURS[0]),
                                ("displacement_x", "u$_x$", COLOURS[1])):
    errors = [100 * (table(validated(CASE, f"N{n}"), "corner")[component][-1]
                     / REFERENCES[component] - 1) for n in REFINEMENTS]
    right.plot(REFINEMENTS, errors, "o-", color=colour, label=f"{name} of the corner")
right.axhline(0, color="k", lw=0.8)
right.axhspan(-2, 2, color=GREY, alpha=0.15, lw=0)
right.set_xscale("log")
right.minorticks_off()
right.set_xticks(REFINEMENTS, [str(n) for n in REFINEMENTS])
right.set(xlabel="N, points over the height", ylabel="beyond finite elements [%]",
          ylim=(-3, 3))
right.legend(frameon=False)
save(figure, CASE)
