#!/usr/bin/python3
"""docs/pictures/chamber_detonation.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from blastPictures import panel
from casePictures import COLOURS, np, pyplot, save, table, validated

CASE = "chamber_detonation"
PANELS = (("yield40", 100), ("yield40", 500), ("points40", 500))

figure, axes = pyplot.subplots(2, 3, figsize=(11, 6.4), height_ratios=(1.25, 1))
for axis, (name, time) in zip(axes[0], PANELS):
    gas, dots, t = panel(axis, validated(CASE, name), "block", 1e-6 * time, 10 / 3,
                         (0, 0.4), (0, 400), 2000, "plasticStrain", cmap="inferno_r", vmin=0,
                         vmax=0.5)
    kind = "" if name == "yield40" else ", no bond association"
    axis.set_title(f"charge x50000{kind}, {t:.0f} µs")
figure.colorbar(gas, ax=axes[0], label="gas [m/s]", extend="max", shrink=0.9)
figure.colorbar(dots, ax=axes[0], label="plastic strain", extend="max", shrink=0.9)

RUNS = (("apart40", COLOURS[0], "-", "partitioned, 40"), ("apart60", COLOURS[1], "-",
        "partitioned, 60"), ("strong40", COLOURS[2], "--", "immersed, 40"))
for name, colour, style, label in RUNS:
    run = validated(CASE, name)
    body = table(run, "force_block")
    axes[1, 0].plot(1e3 * body["Time"], 1e3 * (body["centre_x"] - 0.2), style, color=colour,
                    label=label)
    path = run / "postProcessing" / "pressure" / "0" / "p"
    rows = np.loadtxt(path)[::5]
    for column in (1, 2):
        axes[1, column].plot(1e3 * rows[:, 0], 1e-6 * rows[:, column], style, color=colour)
axes[1, 0].set(xlabel="time [ms]", ylabel="centre of mass [mm]", title="charge x1000")
axes[1, 0].legend(frameon=False)
axes[1, 1].set(xlabel="time [ms]", ylabel="p [MPa]", yscale="log", title="P1, in the charge")
axes[1, 2].set(xlabel="time [ms]", ylabel="p [MPa]", title="P2, right wall")
save(figure, CASE)
