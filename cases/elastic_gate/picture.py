#!/usr/bin/python3
"""docs/pictures/elastic_gate.png, from the runs that scripts/validate has made: water and gate,
and the path of the gate's end beside the experiment."""
import csv
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "scripts"))
from casePictures import COLOURS, GREY, cells, np, numbers, pyplot, save, table, validated

CASE = "elastic_gate"
STRIP = ("0.04", "0.08", "0.12", "0.16", "0.24")
FINE = "soft8"
PATHS = (
    ("soft12", COLOURS[1], "-", "7.8 MPa, N = 12"),
    ("soft8", COLOURS[0], "-", "7.8 MPa, N = 8"),
    ("soft4", COLOURS[0], ":", "7.8 MPa, N = 4"),
    ("stiff8", COLOURS[2], "-", "12 MPa, N = 8"),
)


def published(axis):
    """The experiment's points along x or y: times [s], displacements [mm]."""
    with open(HERE / "reference.csv", newline="") as file:
        rows = [r for r in csv.DictReader(file)
                if r["runs"] == FINE and r["measure"][0] == axis and r["measure"][1:].isdigit()]
    return ([float(r["measure"][1:]) / 1e3 for r in rows], [float(r["reference"]) for r in rows])


figure = pyplot.figure(figsize=(11, 5.6))
upper, lower = figure.subfigures(2, 1, height_ratios=(1, 1.35))

run = validated(CASE, FINE)
for axes, time in zip(upper.subplots(1, len(STRIP)), STRIP):
    where, water = cells(run, time, "alpha.water")
    x, y = (np.unique(np.round(where[:, k], 9)) for k in (0, 1))
    order = np.lexsort((np.round(where[:, 0], 9), np.round(where[:, 1], 9)))
    axes.pcolormesh(1e3 * x, 1e3 * y, water[order].reshape(y.size, x.size), cmap="Blues",
                    vmin=0, vmax=1.5, shading="nearest", rasterized=True)
    axes.plot(*(1e3 * numbers(run / time / "lagrangian" / "gate" / "positions")[:, :2]).T, ".",
              ms=0.8, color=COLOURS[1])
    axes.set(aspect="equal", xlim=(-100, 130), ylim=(0, 155), title=f"{float(time):.2f} s",
             xlabel="x [mm]", xticks=(-100, 0, 100))
    axes.set_yticks((0, 100) if time == STRIP[0] else ())

for axes, axis in zip(lower.subplots(1, 2), "xy"):
    for name, colour, line, label in PATHS:
        tip = table(validated(CASE, name), "tip")
        axes.plot(tip["Time"], 1e3 * tip[f"displacement_{axis}"], line, color=colour, label=label,
                  lw=1.2)
    axes.plot(*published(axis), "ko", ms=4, label="experiment")
    axes.set(xlabel="time [s]", ylabel=f"displacement of the end along {axis} [mm]",
             xlim=(0, 0.37), ylim=(0, None))
    axes.grid(color=GREY, alpha=0.2)
    if axis == "x":
        axes.legend(frameon=False, loc="lower right")
save(figure, CASE)
