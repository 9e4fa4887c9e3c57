#!/usr/bin/python3
"""docs/pictures/torsion.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from casePictures import COLOURS, GREY, np, points, pyplot, save, table, validated

CASE = "torsion"
REFINEMENTS = (4, 6, 8, 12, 16)


def faces(rest):
    """The outer points as six grids of indices: four sides and two ends."""
    keys = np.round(rest / 1e-6).astype(np.int64)
    places = [np.unique(keys[:, i], return_inverse=True)[1] for i in range(3)]
    grid = np.empty([p.max() + 1 for p in places], dtype=int)
    grid[tuple(places)] = np.arange(len(rest))
    return (grid[:, 0], grid[:, -1], grid[:, :, 0], grid[:, :, -1], grid[0], grid[-1])


def centre(name):
    return table(validated(CASE, name), "centre")["displacement_x"][-1]


figure = pyplot.figure(figsize=(11, 4.2))
left = figure.add_subplot(1, 2, 1, projection="3d")
right = figure.add_subplot(1, 2, 2)

rest, moved, sigma, held = points(validated(CASE, "compressible12"), "1", "beam",
                                  "sigmaEq", "held")
places = rest + moved
norm = pyplot.Normalize(0, 1e-3 * np.percentile(sigma[held == 0], 99))
for face in faces(rest):
    corners = (face[:-1, :-1], face[1:, :-1], face[1:, 1:], face[:-1, 1:])
    mean = 1e-3 * sum(sigma[c] for c in corners) / 4
    colours = pyplot.cm.viridis(norm(mean))
    colours[sum(held[c] for c in corners) == 4] = (0.6, 0.6, 0.6, 1)
    left.plot_surface(*(places[face, i] for i in range(3)), facecolors=colours, rstride=1,
                      cstride=1, edgecolor="k", lw=0.15, shade=False)
figure.colorbar(pyplot.cm.ScalarMappable(norm, "viridis"), ax=left, shrink=0.7, pad=0.02,
                label="von Mises stress [10$^3$ dyn/cm$^2$]")
left.set(xlabel="x [cm]", ylabel="y", zlabel="z", yticks=(-0.5, 0.5), zticks=(-0.5, 0.5),
         title="nuStab 0.4, N = 12; grey: held")
left.set_box_aspect((6.6, 1.6, 1.6), zoom=1.5)
left.view_init(20, -65)

curves = (("incompressible", REFINEMENTS, "o-", COLOURS[1], "nuStab 0.49"),
          ("compressible", REFINEMENTS, "o-", COLOURS[0], "nuStab 0.4"),
          ("strongControl", (8, 12), "s:", COLOURS[0], "nuStab 0.4, control 4"),
          ("weakControl", (8, 12), "v:", COLOURS[0], "nuStab 0.4, control 1"))
for name, levels, style, colour, label in curves:
    right.plot(levels, [centre(f"{name}{n}") for n in levels], style, color=colour,
               label=label, ms=4.5)
for value, text, colour in ((0.279, "incompressible", "k"), (0.277, "nuStab 0.49", COLOURS[1]),
                            (0.265, "nuStab 0.4", COLOURS[0])):
    right.axhline(value, color=colour, lw=0.8, ls="--")
right.axhspan(0.97 * 0.279, 1.03 * 0.279, color=COLOURS[1], alpha=0.1, lw=0)
right.set_xscale("log")
right.minorticks_off()
right.set_xticks(REFINEMENTS, [str(n) for n in REFINEMENTS])
right.set(xlabel="N, points across the beam", ylabel="u$_x$ of the turned end's centre [cm]",
          title="dashed: finite elements; band: gate")
right.legend(frameon=False)
save(figure, CASE)
