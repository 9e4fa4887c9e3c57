#!/usr/bin/python3
"""docs/pictures/shock_slab.png, from the runs that scripts/validate has made."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "scripts"))
from casePictures import COLOURS, GREY, Run, cells, np, pyplot, save, validated
from caseRuns import load_gates

gates = load_gates(HERE)

CASE = "shock_slab"


def pressures(name, *times):
    for time, colour in zip(times, COLOURS):
        centres, p = cells(validated(CASE, name), time, "p")
        order = np.argsort(centres[:, 0])
        left.plot(1e3 * centres[order, 0], 1e-3 * p[order], color=colour,
                  label=f"{1e3 * float(time):g} ms")


figure, (left, middle, right) = pyplot.subplots(1, 3, figsize=(11, 3.6))

left.axvspan(0, 10, color="#cccccc", lw=0)
pressures("wall", "0.0002", "0.0003", "0.0005")
left.axhline(1e-3 * gates.P2, color="k", ls="--", lw=0.8)
left.text(-195, 1e-3 * gates.P2 + 3, "233.97 kPa", fontsize=8)
left.set(xlabel="x [mm]", ylabel="pressure [kPa]", xlim=(-200, 60), ylim=(90, 250),
         title="wall: the slab is held")
left.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0, 0.12))

for name, colour, label in (("free5", COLOURS[2], "partitioned, N = 5"),
                            ("free", COLOURS[0], "partitioned, N = 10"),
                            ("free20", COLOURS[1], "partitioned, N = 20"),
                            ("freeImmersed", COLOURS[3], "immersed, N = 10")):
    t, v, error = np.array(gates.velocity_errors(Run(CASE, name))).T
    middle.plot(1e3 * t, v, color=colour, lw=1)
    right.plot(1e3 * t, 100 * error / v[-1], color=colour, label=label, lw=1)
exact = np.array(gates.velocities(gates.simple_waves, 1e-3))
middle.plot(1e3 * exact[:, 0], exact[:, 1], "k--", lw=1, label="exact")
middle.axhline(gates.U1, color=GREY, lw=0.8)
middle.text(0.35, gates.U1 + 1.5, "the air behind the shock", fontsize=8, color=GREY)
middle.set(xlabel="time since the shock came [ms]", ylabel="velocity [m/s]",
           title="free: 1 kg/m²", xlim=(-0.1, 1), ylim=(0, 120))
middle.legend(frameon=False, fontsize=8, loc="lower right")
right.axhspan(-1, 1, color=GREY, alpha=0.15, lw=0)
right.axhline(0, color="k", lw=0.8)
right.set(xlabel="time since the shock came [ms]", ylabel="error [% of the last velocity]",
          title="free: error; band: gate", xlim=(-0.1, 1), ylim=(-1.6, 1.4))
right.legend(frameon=False, fontsize=8, loc="upper right")
save(figure, CASE)
