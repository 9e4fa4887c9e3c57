#!/usr/bin/python3
"""docs/pictures/brittle_ring.png, from the runs that scripts/validate has made."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from blastPictures import panel
from casePictures import pyplot, save, validated
from damagePoints import LABEL

CASE = "brittle_ring"
PANELS = (("apart20", 75, "N = 20"), ("apart20", 100, "N = 20"), ("apart12", 150, "N = 12"),
          ("apart12", 100, "N = 12"), ("apart30", 100, "N = 30"),
          ("immersed12", 100, "N = 12, immersed"))
POINTS = {"apart12": 12, "apart20": 20, "apart30": 30, "immersed12": 12}

figure, axes = pyplot.subplots(2, 3, figsize=(10, 6.6))
for axis, (name, time, title) in zip(axes.flat, PANELS):
    gas, dots, t = panel(axis, validated(CASE, name), "ring", 1e-6 * time, 30 / POINTS[name],
                         (-0.15, 0.3), (-150, 150), 1500)
    axis.set_title(f"{title}, {t:.0f} µs")
figure.colorbar(gas, ax=axes, label="speed of the gas [m/s]", extend="max", shrink=0.6)
figure.colorbar(dots, ax=axes, label=LABEL, extend="max", shrink=0.6)
save(figure, CASE)
