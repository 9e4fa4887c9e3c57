#!/usr/bin/python3
"""docs/pictures/shock_panel.png, from the runs that scripts/validate has made: the tip, and a strip
of numerical schlieren pictures |grad rho|."""
import csv
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "scripts"))
from casePictures import COLOURS, GREY, centres, np, numbers, pyplot, save, table, validated

CASE = "shock_panel"
GAS = 287.7  # J/kg/K, as in system/parameters
STRIP = ("0.0001", "0.0002", "0.0003", "0.0005")
WINDOW = (-0.06, 0.06)  # along the tube, m


def schlieren(run, time, where):
    """x, y and exp(-k |grad rho|/max) on the rectilinear mesh."""
    x, y = (np.unique(np.round(where[:, k], 9)) for k in (0, 1))
    order = np.lexsort((np.round(where[:, 0], 9), np.round(where[:, 1], 9)))
    rho = (numbers(run / time / "p") / numbers(run / time / "T") / GAS)[order]
    rho = rho.reshape(y.size, x.size)
    steep = np.hypot(*np.gradient(rho, y, x))
    inside = (x > WINDOW[0]) & (x < WINDOW[1])
    scale = np.quantile(steep[:, inside], 0.995)
    return x, y, np.exp(-6 * steep / scale)


run = validated(CASE, "panel8")
figure = pyplot.figure(figsize=(11, 6.4))
upper, lower = figure.subfigures(2, 1, height_ratios=(1.25, 1))

axes = upper.subplots()
for name, colour, label in (("panel4", COLOURS[1], "N = 4"), ("panel8", COLOURS[0], "N = 8")):
    tip = table(validated(CASE, name), "tip")
    axes.plot(1e3 * tip["Time"], 1e3 * tip["displacement_x"], color=colour, label=label)
with open(HERE / "reference.csv", newline="") as file:
    rows = [r for r in csv.DictReader(file) if r["quantity"].startswith("N=8: tip at")]
times = [float(r["quantity"].split()[3]) for r in rows]
axes.plot(times, [float(r["reference"]) for r in rows], "ko", ms=4, label="m2c, fine")
axes.errorbar([1.33], [6.2], yerr=[0.4], fmt="s", color=GREY, ms=4, capsize=3,
              label="experiment, peak")
axes.set(xlabel="time [ms]", ylabel="tip [mm]", xlim=(0, 2), ylim=(-0.1, 7))
axes.legend(frameon=False)

where = centres(run / "constant" / "polyMesh")
for axes, time in zip(lower.subplots(1, len(STRIP)), STRIP):
    x, y, light = schlieren(run, time, where)
    axes.pcolormesh(1e3 * x, 1e3 * y, light, cmap="gray", vmin=0, vmax=1, shading="nearest",
                    rasterized=True)
    cloud = run / time / "lagrangian" / "panel"
    places = 1e3 * numbers(cloud / "positions")[:, :2]
    axes.plot(*places.T, ".", ms=0.8, color=COLOURS[1])
    axes.set(aspect="equal", xlim=[1e3 * w for w in WINDOW], ylim=(0, 65), xticks=(-50, 0, 50),
             title=f"{1e6 * float(time):.0f} us", xlabel="x [mm]")
    axes.set_yticks((0, 50) if time == STRIP[0] else ())
save(figure, CASE)
