#!/usr/bin/python3
"""docs/pictures/bar_wave.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from casePictures import COLOURS, np, pyplot, save, table, validated

CASE = "bar_wave"
LENGTH, SPACING, SPEED = 240, 1e-3, np.sqrt(200e9 / 7870)

figure, axes = pyplot.subplots(1, 3, figsize=(11, 3.2), sharey=True)
for axis, pulse in zip(axes, (20, 40, 80)):
    for name, colour in zip(("bond", "correspondence", "bondAssociated"), COLOURS):
        run = validated(CASE, f"{name}{pulse}")
        for probe in ("quarter", "threeQuarters"):
            rows = table(run, probe)
            axis.plot(1e6 * rows["Time"], rows["U_x"], color=colour,
                      label=name if probe == "quarter" else None)
    time = np.linspace(0, rows["Time"][-1], 1000)
    for place in (LENGTH / 4, 3 * LENGTH / 4):
        s = (time * SPEED / SPACING - place) / pulse
        exact = np.where((s > 0) & (s < 1), (1 - np.cos(2 * np.pi * s)) / 2, 0)
        axis.plot(1e6 * time, exact, color="k", lw=0.8, ls="--",
                  label="exact" if place < LENGTH / 2 else None)
    axis.set(xlabel="time [µs]", title=f"pulse of {pulse} spacings")
axes[0].set_ylabel("velocity [m/s]")
axes[0].legend(frameon=False, fontsize=8, loc="lower left")
save(figure, CASE)
