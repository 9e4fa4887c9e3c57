"""What a run wrote, read by ParaView. For scripts that pvbatch runs."""

import glob
import os

import numpy as np
from paraview import simple
from vtk.util.numpy_support import vtk_to_numpy


def times_and_bodies(folder):
    """The write times that hold points, and the names of the bodies they belong to."""
    times, bodies = set(), set()
    pattern = os.path.join(glob.escape(folder), "*", "lagrangian", "*", "damage")
    for path in glob.glob(pattern):
        *_, time, _, body, _ = path.split(os.sep)
        try:
            times.add(float(time))
        except ValueError:
            continue
        bodies.add(body)
    return sorted(times), sorted(bodies)


def sources(folder, bodies):
    """ParaView's sources for the fluid, which has U, and for the points of each body."""
    # One reader for all: without the mesh it gives points at the first time only.
    reader = simple.OpenFOAMReader(FileName=os.path.join(folder, "case.foam"))
    reader.SkipZeroTime = 0
    reader.SMProxy.InvokeCommand("Refresh")  # without it time 0 is still skipped
    reader.UpdatePipelineInformation()
    regions = ["internalMesh"] + ["lagrangian/" + body for body in bodies]
    reader.MeshRegions = regions
    reader.CellArrays = ["U"]
    reader.LagrangianArrays = ["displacement", "damage"]
    blocks = []
    for region in regions:
        block = simple.ExtractBlock(Input=reader)
        block.Selectors = ["/Root/defaultRegion/" + region]
        blocks.append(block)
    return blocks[0], blocks[1:]


def arrays(source, time, *fields):
    """The positions [n, 3] and fields at the points of one of these sources at a time."""
    source.UpdatePipeline(time)
    parts = source.GetClientSideObject().GetOutputDataObject(0).NewIterator()
    part = parts.GetCurrentDataObject()
    data = part.GetPointData()
    return [vtk_to_numpy(part.GetPoints().GetData())] + [
        vtk_to_numpy(data.GetArray(field)) for field in fields
    ]


def spacing(position, displacement):
    """The distance of the first point to its nearest neighbour in the body at rest."""
    reference = position - displacement
    return np.linalg.norm(reference[1:] - reference[0], axis=1).min()
