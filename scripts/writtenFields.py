"""Cell fields of a body that periSolidFoam wrote in binary, read without OpenFOAM."""
import array
import pathlib
import re
import struct


def write_times(run):
    """The write times of a run as {seconds: folder}, in order."""
    times = {}
    for folder in pathlib.Path(run).iterdir():
        try:
            times[float(folder.name)] = folder
        except ValueError:
            continue
    return dict(sorted(times.items()))


def at(times, wanted):
    """The folder of the write time nearest to the wanted one."""
    return times[min(times, key=lambda t: abs(t - wanted))]


def cell_field(path):
    """The values of all cells, one after another, as an array of doubles."""
    data = pathlib.Path(path).read_bytes()
    uniform = re.search(rb"internalField\s+uniform\s+\(?([^;)]*)\)?;", data)
    if uniform:
        raise ValueError(f"{path} is uniform: {uniform[1].decode()}")
    head = re.search(rb"internalField\s+nonuniform\s+List<(\w+)>\s+(\d+)\s*\(", data)
    if not head:
        raise ValueError(f"{path} is no field of cells in binary")
    components = {b"scalar": 1, b"vector": 3, b"symmTensor": 6}[head[1]]
    values = array.array("d")
    values.frombytes(data[head.end() : head.end() + 8 * components * int(head[2])])
    return values


def places(run, body):
    """The points at rest, [(x, y, z)] in the order of the cells."""
    data = (pathlib.Path(run) / "0" / body / "lagrangian" / body / "positions").read_bytes()
    head = re.search(rb"// \*[* ]*//\s+(\d+)\s*\(\n", data)
    record = struct.Struct("<c3di2s")  # (x y z cell) and a line's end
    points = [None] * int(head[1])
    end = head.end() + record.size * len(points)
    for _, x, y, z, cell, _ in record.iter_unpack(data[head.end() : end]):
        points[cell] = (x, y, z)
    return points
