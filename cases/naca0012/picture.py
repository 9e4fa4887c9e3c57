#!/usr/bin/python3
"""docs/pictures/naca0012.png, from the runs that scripts/validate has made."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "scripts"))
from casePictures import COLOURS, GREY, Run, cells, np, pyplot, save, validated
from caseRuns import load_gates

gates = load_gates(HERE)

CASE = "naca0012"


figure, (left, right) = pyplot.subplots(1, 2, figsize=(11, 3.6), width_ratios=(1.5, 1))

finest = f"c{gates.LEVELS[-1]}"
places, U, T = cells(validated(CASE, finest), "25", "U", "T")
near = (abs(places[:, 0] - 0.7) < 1.5) & (abs(places[:, 1]) < 0.8)
mach = np.linalg.norm(U, axis=1) / np.sqrt(T)
drawn = left.tricontourf(*places[near, :2].T, mach[near], np.linspace(0, 0.6, 25),
                         cmap="viridis", extend="max")
x = np.linspace(0, 1, 400)
half = 0.6 * (0.2969 * x**0.5 - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
left.fill_between(x, -half, half, color="#dddddd", lw=0, zorder=3)
figure.colorbar(drawn, ax=left, label="Mach number", shrink=0.8)
left.set(aspect="equal", xlim=(-0.5, 2), ylim=(-0.5, 0.5), xlabel="x/c", ylabel="y/c",
         title=f"N = {finest[1:]}")

for n, colour in zip(gates.LEVELS, COLOURS):
    run = Run(CASE, f"c{n}")
    x, cp = np.array(gates.line(run, "nose")).T
    right.plot(x, cp, ".-", color=colour, lw=1, label=f"N = {n}: drag {gates.drag(run):.4f}")
right.axhline(1.064, color="k", ls="--", lw=0.8)
right.text(-0.145, 1.08, "1.064, isentropic", fontsize=8)
right.axvline(0, color=GREY, lw=0.8)
right.set(xlabel="x/c", ylabel="pressure coefficient", xlim=(-0.15, 0.02), ylim=(0, 1.2),
          xticks=(-0.15, -0.1, -0.05, 0),
          title="on the axis, ahead of the nose and in it")
right.legend(frameon=False, fontsize=8, loc="center left")
save(figure, CASE)
