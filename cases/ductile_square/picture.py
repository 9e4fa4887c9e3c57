#!/usr/bin/python3
"""docs/pictures/ductile_square.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from blastPictures import panel
from casePictures import pyplot, save, validated
from damagePoints import LABEL

CASE = "ductile_square"
PANELS = (("apart12", 100, "partitioned"), ("released12", 100, "released at 75 µs"),
          ("immersed12", 100, "immersed"),
          ("apart12", 225, "partitioned"), ("released12", 225, "released"),
          ("immersed12", 225, "immersed"))

figure, axes = pyplot.subplots(2, 3, figsize=(10, 6.6))
for axis, (name, time, title) in zip(axes.flat, PANELS):
    gas, dots, t = panel(axis, validated(CASE, name), "square", 1e-6 * time, 2.5,
                         (-0.2, 0.4), (-170, 170), 2000)
    axis.set_title(f"{title}, {t:.0f} µs")
figure.colorbar(gas, ax=axes, label="speed of the gas [m/s]", extend="max", shrink=0.6)
figure.colorbar(dots, ax=axes, label=LABEL, extend="max", shrink=0.6)
save(figure, CASE)
