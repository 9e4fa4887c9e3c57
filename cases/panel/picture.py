#!/usr/bin/python3
"""docs/pictures/panel.png, from the runs that scripts/validate has made."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "scripts"))
from casePictures import COLOURS, GREY, Run, np, points, pyplot, save, validated
from caseRuns import load_gates

gates = load_gates(HERE)

CASE = "panel"
ROOTS = (1.875104, 4.694091, 7.854757)  # of cos z cosh z = -1


def sudden_tip(time):
    """Of a slender cantilever, over its static answer, after a sudden uniform load."""
    s, total, value = np.linspace(0, 1, 2001), 0, 0
    for z in ROOTS:
        share = (np.cosh(z) + np.cos(z)) / (np.sinh(z) + np.sin(z))
        mode = np.cosh(z * s) - np.cos(z * s) - share * (np.sinh(z * s) - np.sin(z * s))
        tip = mode[-1] * mode.mean() / (mode**2).mean() / z**4
        rate = 2 * np.pi * gates.BEAM_FREQUENCY * (z / ROOTS[0])**2
        value = value + tip * (1 - np.cos(rate * time))
        total += tip
    return value / total


def over(value, reference):
    return 100 * (value / reference - 1)


figure, (left, middle, right) = pyplot.subplots(1, 3, figsize=(11, 4),
                                                width_ratios=(0.8, 1.3, 1.2))

rest, moved, sigma, held = points(validated(CASE, "static8"), "1", "panel", "sigmaEq", "held")
places, free = 1e3 * (rest + moved), held == 0
left.add_patch(pyplot.Polygon([(0, 0), (1, 0), (1, 50), (0, 50)], fill=False, color=GREY,
                              ls="--", zorder=3))
left.plot(*places[~free, :2].T, "s", ms=2, color=GREY)
dots = left.scatter(*places[free, :2].T, c=1e-6 * sigma[free], s=3, lw=0, cmap="viridis")
figure.colorbar(dots, ax=left, label="von Mises stress [MPa]", shrink=0.8)
for y in range(5, 50, 10):
    left.annotate("", (-0.2, y), (-2.2, y), arrowprops={"arrowstyle": "->", "color": "#b03030"})
left.text(-3, 52, "100 kPa", color="#b03030")
left.set(aspect=1/3, xlabel="x [mm]", ylabel="y [mm]", xlim=(-3.5, 6), ylim=(-2, 55),
         xticks=(0, 2, 4),
         title="N = 8, x stretched 3 times")

curves = (("static", gates.STATIC, gates.tip_displacement, gates.BEAM_TIP, "o-", COLOURS[0],
           "tip, zeroEnergy 2, horizon 2.015"),
          ("weakControl", (8, 16), gates.tip_displacement, gates.BEAM_TIP, "s:", COLOURS[0],
           "tip, zeroEnergy 1"),
          ("longHorizon", (8, 16), gates.tip_displacement, gates.BEAM_TIP, "^:", COLOURS[0],
           "tip, horizon 3.015"),
          ("bond", (8, 16), gates.tip_displacement, gates.BEAM_TIP, "D:", COLOURS[2],
           "tip, bond"),
          ("bondLongHorizon", (8, 16), gates.tip_displacement, gates.BEAM_TIP, "v:", COLOURS[2],
           "tip, bond, horizon 3.015"),
          ("vibration", gates.VIBRATION, gates.frequency, gates.BEAM_FREQUENCY, "o-",
           COLOURS[1], "first frequency"))
for name, levels, measure, reference, style, colour, label in curves:
    errors = [over(measure(Run(CASE, f"{name}{n}")), reference) for n in levels]
    middle.plot(levels, errors, style, color=colour, label=label, ms=4.5)
middle.axhline(0, color="k", lw=0.8)
middle.axhspan(-2, 2, color=COLOURS[0], alpha=0.1, lw=0)
middle.axhspan(-1, 1, color=COLOURS[1], alpha=0.15, lw=0)
middle.set_xscale("log")
middle.minorticks_off()
middle.set_xticks(gates.STATIC, [str(n) for n in gates.STATIC])
middle.set(xlabel="N, points through the thickness", ylabel="beyond the slender beam [%]",
           title="static tip and first frequency; bands: gates", ylim=(-9, 9))
middle.legend(frameon=False, fontsize=8, loc="upper right")

for n, colour in zip(gates.VIBRATION, COLOURS):
    rows = Run(CASE, f"vibration{n}").table("tip")
    right.plot(1e3 * rows["Time"], 1e6 * rows["displacement_x"], color=colour, label=f"N = {n}")
time = np.linspace(0, rows["Time"][-1], 600)
right.plot(1e3 * time, 10 * gates.BEAM_TIP * sudden_tip(time), "k--", lw=1,
           label="slender beam, three modes")
right.set(xlabel="time [ms]", ylabel="tip [µm]", title="1 kPa, at once", ylim=(-4, 122))
right.legend(frameon=False, fontsize=8, ncols=2, loc="upper center")
save(figure, CASE)
