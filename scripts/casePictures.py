"""What the picture.py of cases share: reading the ascii fields of periSolidFoam, the looks."""

import pathlib
import re
import sys

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot

ROOT = pathlib.Path(__file__).resolve().parent.parent

pyplot.rcParams.update({
    "font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
    "figure.constrained_layout.use": True, "savefig.dpi": 150, "axes.titlesize": 9,
})

COLOURS = ["#1f5a8c", "#d1622b", "#3a8f5c", "#8a5ca8"]
GREY = "#888888"


def numbers(path):
    """The list of an ascii file of fields or positions: [n] or [n, columns]."""
    text = path.read_text()
    start = re.search(r"^\s*(\d+)\s*\n\(", text, re.M)
    rows = text[start.end():].split("\n)", 1)[0].replace("(", " ").replace(")", " ")
    values = np.array(rows.split(), dtype=float)
    n = int(start[1])
    return values if values.size == n else values.reshape(n, -1)


def points(run, time, body, *fields):
    """Positions at rest, displacements and fields of the points at a write time."""
    folder = run / time / body / "lagrangian" / body
    displacement = numbers(folder / "displacement")
    rest = numbers(folder / "positions")[:, :3] - displacement
    return [rest, displacement] + [numbers(folder / field) for field in fields]


def faces_of(mesh):
    """Corners of the faces of a mesh in ascii."""
    text = (mesh / "faces").read_text()
    return [np.array(face.split(), dtype=int)
            for face in re.findall(r"^\d+\(([\d ]+)\)", text, re.M)]


def centres(mesh):
    """Middles of cells, from those of their faces: exact for bricks."""
    corners = numbers(mesh / "points")
    middles = np.array([corners[face].mean(axis=0) for face in faces_of(mesh)])
    sides = [numbers(mesh / side).astype(int) for side in ("owner", "neighbour")]
    places, count = np.zeros((sides[0].max() + 1, 3)), np.zeros(sides[0].max() + 1)
    for side in sides:
        np.add.at(places, side, middles[:len(side)])
        np.add.at(count, side, 1)
    return places / count[:, None]


def cells(run, time, *fields):
    """Centres of the fluid's cells, bricks, and ascii fields of a write time there."""
    return [centres(run / "constant" / "polyMesh")] + [
        numbers(run / time / field) for field in fields]


def table(run, name):
    """A table of postProcessing as {column: array}."""
    path = run / "postProcessing" / "solid" / "0" / f"{name}.dat"
    lines = path.read_text().splitlines()
    names = [line for line in lines if line.startswith("#")][-1][1:].split()
    rows = np.array([line.split() for line in lines if not line.startswith("#")], dtype=float)
    return {name: rows[:, i] for i, name in enumerate(names)}


def validated(case, name):
    """The folder of a run that scripts/validate has made."""
    run = ROOT / "cases" / case / "validate" / name
    if not (run / "done").is_file():
        sys.exit(f"picture: the run {name} is missing; scripts/validate {case} makes it")
    return run


class Run:
    """What gates.py reads of a run that scripts/validate has made."""

    def __init__(self, case, name):
        self.folder = validated(case, name)

    def table(self, name):
        return table(self.folder, name)


def save(figure, case):
    path = ROOT / "docs" / "pictures" / f"{case}.png"
    figure.savefig(path)
    print(path)
