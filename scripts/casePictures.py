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


def cells(run, time, *fields):
    """Centres of the fluid's cells, bricks, and ascii fields of a write time there."""
    mesh = run / "constant" / "polyMesh"
    corners = numbers(mesh / "points")
    faces = re.findall(r"^4\(([\d ]+)\)", (mesh / "faces").read_text(), re.M)
    middles = corners[np.array([face.split() for face in faces], dtype=int)].mean(axis=1)
    owner = numbers(mesh / "owner").astype(int)
    neighbour = numbers(mesh / "neighbour").astype(int)
    places, count = np.zeros((owner.max() + 1, 3)), np.zeros(owner.max() + 1)
    for side in (owner, neighbour):
        np.add.at(places, side, middles[:len(side)])
        np.add.at(count, side, 1)
    return [places / count[:, None]] + [numbers(run / time / field) for field in fields]


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


def save(figure, case):
    path = ROOT / "docs" / "pictures" / f"{case}.png"
    figure.savefig(path)
    print(path)
