#!/usr/bin/python3
"""docs/pictures/tensile_bar.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from casePictures import COLOURS, np, points, pyplot, save, table, validated

CASE = "tensile_bar"
E, YIELD, SPACING = 200e9, 0.4e9, 1e-3


def curve(name):
    run = validated(CASE, name)
    left, right = (table(run, n)["displacement_x"] for n in ("gaugeLeft", "gaugeRight"))
    return np.log(1 + (right - left) / (4 * SPACING)), table(run, "middle")["sigma_xx"]


figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.5, 3.8), width_ratios=(1.25, 1))
for name, H, label, colour in (
        ("order1", 10e9, "plane stress, order 1", COLOURS[0]),
        ("space", 10e9, "in space", COLOURS[2]),
        ("softer", 1e9, "plane stress, hardening 1 GPa", COLOURS[1])):
    strain, stress = curve(name)
    pulled = strain.argmax()
    line = np.array([0, YIELD / E, strain[pulled], strain[-1]])
    exact = np.minimum(E * line, YIELD + E * H / (E + H) * (line - YIELD / E))
    exact[3] = exact[2] - E * (strain[pulled] - strain[-1])
    left.plot(100 * line, exact / 1e9, color="k", lw=0.8, zorder=3)
    left.plot(100 * strain, stress / 1e9, color=colour, lw=4, alpha=0.5, label=label)
    elastic = np.minimum(E * strain, YIELD + E * H / (E + H) * (strain - YIELD / E))
    rows = slice(0, pulled)
    right.plot(100 * strain[rows], 100 * (stress[rows] - elastic[rows]) / YIELD, color=colour)
left.plot([], [], color="k", lw=0.8, label="closed form")
left.set(xlabel="logarithmic strain [%]", ylabel="Cauchy stress [GPa]", ylim=(0, None),
         xlim=(0, None), title="middle of the bar: pulled, held, unloaded")
left.legend(frameon=False, loc="lower center")
right.axhspan(-0.1, 0.1, color="#888888", alpha=0.15, lw=0)
right.set(xlabel="logarithmic strain [%]", ylabel="from the closed form [% of Y]",
          title="while pulled; grey: 0.1 %")
save(figure, CASE)
