#!/usr/bin/python3
"""docs/pictures/precracked_plate.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from casePictures import COLOURS, np, pyplot, save, validated
from damagePoints import LABEL, SCALE, draw_points, state
from writtenFields import write_times

CASE = "precracked_plate"
# reference.csv: places [mm], u_y [um]; times [us], growth [mm] of the book and derived
ALONG = [0.05, 1.05, 2.05, 3.05, 4.05, 5.05], [134.8, 130.5, 121.8, 105.8, 79.6, 7.3]
ACROSS = [5.05, 10.05, 15.05, 20.05], [143.5, 175.2, 226.4, 277.9]
BOOK = [7.7, 10, 15, 16.7], [0, 4.5, 12.8, 16]
TIP, GONE = 5, 0.5  # mm, damage


def profile(axis, places, u, line, reference, title):
    axis.plot(places[line], 1e3 * u[line], color=COLOURS[0], label="points")
    axis.errorbar(*reference, yerr=0.02 * np.array(reference[1]), fmt="o", ms=3, color="k",
                  capsize=3, lw=0.8, label="reference, ± 2 %")
    axis.set(ylabel="u$_y$ [µm]", title=title)


figure, axes = pyplot.subplots(2, 3, figsize=(11, 6), height_ratios=(1, 0.9))
above, beside, growing = axes[0]

X, u, _, time = state(validated(CASE, "noFailure"), "plate", 16.71)
row, column = (abs(X[:, k] - 0.05) < 1e-3 for k in (1, 0))  # the first beyond the axes
profile(above, X[:, 0], u[:, 1], row & (X[:, 0] > 0) & (X[:, 0] < 8), ALONG,
        "without failure, 16.7 µs: beside the crack")
above.set(xlabel="x [mm], at y = 0.05 mm", ylim=(0, None))
above.legend(frameon=False)
profile(beside, X[:, 1], u[:, 1], column & (X[:, 1] > 0) & (X[:, 1] < 25), ACROSS,
        "without failure, 16.7 µs: across it")
beside.set(xlabel="y [mm], at x = 0", ylim=(0, None))

run = validated(CASE, "growth")
times, ends = [], []
for seconds in write_times(run):
    if seconds > 5e-6:
        X, _, damage, time = state(run, "plate", 1e6 * seconds)
        cracked = X[(damage > GONE), 0]
        times.append(time)
        ends.append(max(cracked.max(initial=TIP) - TIP, 0))
growing.plot(times, ends, color=COLOURS[0], label="points")
growing.errorbar(*BOOK, yerr=[0, 0, 0, 1], fmt="o", ms=4, color="k", capsize=3, lw=0.8,
                 label="Madenci and Oterkus; ± 1 mm")
growing.set(xlabel="time [µs]", ylabel="growth of the right tip [mm]", title="20 m/s",
            ylim=(-0.5, 22))
growing.legend(frameon=False, loc="upper left")

plates = [(axis, state(validated(CASE, name), "plate", time), speed)
          for axis, name, time, speed in zip(
              axes[1], ("growth", "branching", "branching"), (16.71, 10, 16.71),
              (20, 50, 50))]
for axis, (X, u, damage, time), speed in plates:
    axis.set(aspect="equal", xlim=(-0.5, 26), ylim=(-9, 9), xticks=[], yticks=[],
             title=f"right half at {speed} m/s, {time:.1f} µs")
    axis.spines[:].set_visible(False)
axes[1, 0].plot([0, 5], [-8, -8], color="k", lw=2, zorder=3)
axes[1, 0].text(5.4, -8, "5 mm", va="center")
figure.colorbar(SCALE, ax=axes[1], label=LABEL, extend="max", shrink=0.8, pad=0.01)
figure.draw_without_rendering()
for axis, (X, u, damage, _), _ in plates:
    near = (X[:, 0] > 0) & (abs(X[:, 1]) < 8.5)
    draw_points(axis, X[near], (X + u)[near], damage[near])
save(figure, CASE)
