#!/usr/bin/python3
"""docs/pictures/supersonic_cylinder.png, from the runs that scripts/validate has made."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "scripts"))
from casePictures import COLOURS, GREY, Run, cells, np, pyplot, save, validated
from caseRuns import load_gates

gates = load_gates(HERE)

CASE = "supersonic_cylinder"


figure, (left, right) = pyplot.subplots(1, 2, figsize=(11, 4), width_ratios=(1.5, 1))

places, U, T = cells(validated(CASE, "d64"), "25", "U", "T")
near = (places[:, 0] < 9) & (places[:, 1] < 10)
mach = np.linalg.norm(U, axis=1) / np.sqrt(T)
levels = np.linspace(0, 2.1, 22)
x, y = places[near, 0] - 2, places[near, 1] - 6
drawn = left.tricontourf(np.hstack((x, x)), np.hstack((y, -y)), np.hstack((mach[near],) * 2),
                         levels, cmap="viridis", extend="max")
left.add_patch(pyplot.Circle((0, 0), 0.5, color="#dddddd"))
figure.colorbar(drawn, ax=left, label="Mach number", shrink=0.9)
left.set(aspect="equal", xlim=(-2, 6), ylim=(-3, 3), xlabel="x/D", ylabel="y/D",
         title="D/64, upper half computed, lower mirrored")

for name, colour in (("d16", COLOURS[2]), ("d32", COLOURS[0]), ("d64", COLOURS[1])):
    run = Run(CASE, name)
    x, cp = np.array(gates.line(run)).T
    right.plot(x - 2, cp, "-", color=colour, lw=1,
               label=f"D/{name[1:]}: drag {gates.drag(run):.3f}")
right.axhline(1.657, color="k", ls="--", lw=0.8)
right.text(-1.42, 1.68, "1.657, Rayleigh", fontsize=8)
right.axvline(-0.5, color=GREY, lw=0.8)
right.set(xlabel="x/D", ylabel="pressure coefficient", xlim=(-1.5, -0.45), ylim=(-0.1, 1.8),
          title="ahead of the cylinder, on the axis")
right.legend(frameon=False, fontsize=8, loc="lower right")
save(figure, CASE)
