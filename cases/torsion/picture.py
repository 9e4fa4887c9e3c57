#!/usr/bin/python3
"""docs/pictures/torsion.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from matplotlib.collections import PolyCollection
from casePictures import COLOURS, GREY, np, points, pyplot, save, table, validated

CASE = "torsion"
REFINEMENTS = (4, 6, 8, 12, 16)


def faces(rest):
    """The outer points as six grids of indices: four sides and two ends."""
    keys = np.round(rest / 1e-6).astype(np.int64)
    places = [np.unique(keys[:, i], return_inverse=True)[1] for i in range(3)]
    lattice = np.empty([p.max() + 1 for p in places], dtype=int)
    lattice[tuple(places)] = np.arange(len(rest))
    return (lattice[:, 0], lattice[:, -1], lattice[:, :, 0], lattice[:, :, -1], lattice[0],
            lattice[-1])


def centre(name):
    return table(validated(CASE, name), "centre")["displacement_x"][-1]


def seen(places, turn=-60, lift=22):
    """Right, up and towards the eye: a parallel projection along angles in degrees."""
    a, b = np.radians((turn, lift))
    right = (-np.sin(a), np.cos(a), 0)
    eye = (np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b))
    return places @ np.transpose((right, np.cross(eye, right), eye))


figure = pyplot.figure(figsize=(11, 3.8))
halves = figure.subfigures(1, 2, width_ratios=(1.25, 1))
left, right = (half.subplots() for half in halves)

rest, moved, sigma = points(validated(CASE, "incompressible12"), "1", "beam", "sigmaEq")
root = rest[:, 0] < -3
quads = np.concatenate([np.stack((f[:-1, :-1], f[1:, :-1], f[1:, 1:], f[:-1, 1:]),
                                 axis=-1).reshape(-1, 4) for f in faces(rest)])
corners = seen(rest + moved)[quads]
order = np.argsort(corners[:, :, 2].mean(axis=1))
norm = pyplot.Normalize(*(1e-3 * np.percentile(sigma[~root], (1, 99))))
colours = pyplot.cm.viridis(norm(1e-3 * sigma[quads].mean(axis=1)))
colours[root[quads].any(axis=1)] = (0.7, 0.7, 0.7, 1)
left.add_collection(PolyCollection(corners[order, :, :2], facecolors=colours[order],
                                   edgecolors="k", linewidths=0.2))
halves[0].colorbar(pyplot.cm.ScalarMappable(norm, "viridis"), ax=left, shrink=0.7,
                   orientation="horizontal", aspect=30,
                   label="von Mises stress [10$^3$ dyn/cm$^2$]")
left.autoscale_view()
left.set(aspect="equal", title="turned by 5/4 of a turn; nuStab 0.49, N = 12; grey: held")
left.set_axis_off()

curves = (("incompressible", REFINEMENTS, "o-", COLOURS[1], "nuStab 0.49"),
          ("compressible", REFINEMENTS, "o-", COLOURS[0], "nuStab 0.4"),
          ("strongControl", (8, 12), "s:", COLOURS[0], "nuStab 0.4, zeroEnergy 4"),
          ("weakControl", (8, 12), "v:", COLOURS[0], "nuStab 0.4, zeroEnergy 1"),
          ("longHorizon", (12,), "D", COLOURS[2], "nuStab 0.4, horizon 3.015"))
for name, levels, style, colour, label in curves:
    right.plot(levels, [centre(f"{name}{n}") for n in levels], style, color=colour,
               label=label, ms=4.5)
for value, text, colour, side in ((0.279, "incompressible", "k", "bottom"),
                                  (0.277, "nuStab 0.49", COLOURS[1], "top"),
                                  (0.265, "nuStab 0.4", COLOURS[0], "top")):
    right.axhline(value, color=colour, lw=0.8, ls="--")
    right.text(4, value, text, color=colour, fontsize=8, va=side)
right.axhspan(0.97 * 0.279, 1.03 * 0.279, color=COLOURS[1], alpha=0.1, lw=0)
right.set_xscale("log")
right.minorticks_off()
right.set_xticks(REFINEMENTS, [str(n) for n in REFINEMENTS])
right.set(xlabel="N, points across the beam", ylabel="u$_x$ of the turned end's centre [cm]",
          title="dashed: finite elements; band: gate")
right.legend(frameon=False)
save(figure, CASE)
