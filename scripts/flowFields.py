"""Ascii fields of runs in a flow: cells of the fluid, and the points of bodies. Plain Python."""
import pathlib
import re

from writtenFields import at, write_times


def values(path):
    """The internal list of a field or the list of a cloud: floats, or tuples of them."""
    text = pathlib.Path(path).read_text()
    head = re.search(r"^\s*(?:internalField\s+nonuniform\s+List<\w+>\s*)?(\d+)\s*\n\(\n",
                     text, re.M)
    same = re.search(r"^\s*(\d+)\{([^}]*)\}", text, re.M)
    if not head and same:
        return [float(same[2])] * int(same[1])
    if not head:
        raise ValueError(f"{path} is no list of numbers in ascii")
    lines = text[head.end():].split("\n", int(head[1]))[:int(head[1])]
    if lines and lines[0].startswith("("):
        return [tuple(map(float, re.sub(r"[()]", " ", line).split())) for line in lines]
    return [float(line) for line in lines]


def nearest(run, seconds):
    """The folder of the write time nearest to that one."""
    return at(write_times(run), seconds)


def points(folder, body, *fields):
    """Places at rest of a body's points at a write time, places now, and fields; by cell of
    the region mesh."""
    cloud = pathlib.Path(folder) / "lagrangian" / body
    now = [place[:3] for place in values(cloud / "positions")]
    moved = values(cloud / "displacement")
    cell = [int(c) for c in values(cloud / "cell")]
    order = sorted(range(len(cell)), key=cell.__getitem__)
    rest = [tuple(a - b for a, b in zip(x, u)) for x, u in zip(now, moved)]
    columns = [rest, now] + [values(cloud / field) for field in fields]
    return [[column[k] for k in order] for column in columns]
