"""Opens runs with ParaView's OpenFOAM reader, for tests/paraview/run:

    pvbatch look.py <top> <folder> <name>[:decomposed] ... picture:<name> ...

Prints "<argument><tab><what is missing, or nothing>" for each.
"""
import glob
import os
import re
import sys

import numpy as np
from paraview import simple
from vtk.util.numpy_support import vtk_to_numpy

top, folder, *wanted = sys.argv[1:]
sys.path.insert(0, os.path.join(top, "scripts", "paraview"))
import periFoam


def leaves(block, path=""):
    """{path of its names: data set} of a multi-block data set."""
    if not block.IsA("vtkMultiBlockDataSet"):
        return {path: block}
    found = {}
    for k in range(block.GetNumberOfBlocks()):
        name = block.GetMetaData(k).Get(block.NAME())
        if block.GetBlock(k):
            found.update(leaves(block.GetBlock(k), path + "/" + name))
    return found


def array(data, name):
    values = data.GetArray(name)
    return None if values is None else vtk_to_numpy(values)


def cells_of(run, body):
    with open(os.path.join(run, "constant", body, "polyMesh", "owner"), "rb") as owner:
        return int(re.search(rb"nCells: *(\d+)", owner.read(2000))[1])


def bodies_of(run):
    constant = os.path.join(run, "constant")
    return sorted(name for name in os.listdir(constant)
                  if os.path.isdir(os.path.join(constant, name, "polyMesh")))


def why_not(run, decomposed):
    """What is missing at the last time; None if nothing is."""
    reader = simple.OpenFOAMReader(FileName=os.path.join(run, "case.foam"))
    reader.CaseType = "Decomposed Case" if decomposed else "Reconstructed Case"
    reader.SMProxy.InvokeCommand("Refresh")
    reader.UpdatePipelineInformation()
    if not len(reader.TimestepValues) or reader.TimestepValues[-1] == 0:
        return "no time but 0"
    reader.MeshRegions = reader.GetProperty("MeshRegions").Available
    reader.CellArrays = reader.GetProperty("CellArrays").Available
    reader.LagrangianArrays = reader.GetProperty("LagrangianArrays").Available
    reader.UpdatePipeline(reader.TimestepValues[-1])
    found = leaves(reader.GetClientSideObject().GetOutputDataObject(0))

    flow = os.path.isdir(os.path.join(run, "constant", "polyMesh"))
    if flow:
        mesh = found.get("/defaultRegion/internalMesh")
        for field in "U", "p", "damage", "solidFraction":
            values = None if mesh is None else array(mesh.GetCellData(), field)
            if values is None or len(values) != mesh.GetNumberOfCells():
                return "no " + field
            if not np.isfinite(values).all():
                return field + " is not finite"
    for body in bodies_of(run):
        region = "defaultRegion" if flow else body
        cloud = found.get("/%s/lagrangian/%s" % (region, body))
        if cloud is None or not cloud.GetNumberOfPoints():
            return "no points of " + body
        n = cloud.GetNumberOfPoints()
        if n != cells_of(run, body):
            return "%d points of %s, and %d cells" % (n, body, cells_of(run, body))
        damage = array(cloud.GetPointData(), "damage")
        if damage is None or len(damage) != n:
            return "the points of %s have no damage" % body
        if not (damage.min() >= 0 and damage.max() <= 1 + 1e-6):
            return "damage from %g to %g" % (damage.min(), damage.max())
        if sorted(array(cloud.GetPointData(), "cell")) != list(range(n)):
            return "the cells of the points of %s are not each there once" % body
    return None


def ends_off(lines, cloud):
    """What is wrong with lines of broken bonds."""
    lines.UpdatePipeline(lines.TimestepValues[-1])
    poly = lines.GetClientSideObject().GetOutputDataObject(0)
    part = list(leaves(cloud.GetClientSideObject().GetOutputDataObject(0)).values())[0]
    place = vtk_to_numpy(part.GetPoints().GetData())
    order = np.argsort(array(part.GetPointData(), "cell"))
    cell = array(poly.GetPointData(), "cell")
    away = vtk_to_numpy(poly.GetPoints().GetData()) - place[order][cell]
    if abs(away).max() > 1e-5 * np.ptp(place, axis=0).max():
        return "a line ends %g beside its point" % abs(away).max()
    damage = array(poly.GetPointData(), "damage")
    if not (damage > 0).all():
        return "the end of a broken bond has no damage"
    if abs(damage - array(part.GetPointData(), "damage")[order][cell]).max() > 1e-6:
        return "the end of a line has the damage of another point"
    if not (array(poly.GetCellData(), "stretch") > 0).all():
        return "no stretch"
    return None


def picture(name):
    """What is wrong with the macro's view of a run; None if nothing is."""
    simple.ResetSession()
    meshes, clouds, bonds = periFoam.show(os.path.join(folder, name, "case.foam"))
    path = os.path.join(folder, name + ".png")
    simple.SaveScreenshot(path, ImageResolution=[400, 300])
    from matplotlib import image
    colours = len(np.unique((image.imread(path)[:, :, :3] * 15).astype(int).reshape(-1, 3), axis=0))
    if colours < 10:
        return "a picture of %d colours" % colours
    if not clouds:
        return "no points"
    wanted = glob.glob(os.path.join(folder, name, "postProcessing", "bonds", "*.pvd"))
    if len(bonds) != len(wanted):
        return "%d lists of broken bonds, and %d shown" % (len(wanted), len(bonds))
    return next((why for b, c in zip(bonds, clouds) for why in [ends_off(b, c)] if why), None)


for name in wanted:
    try:
        if name.startswith("picture:"):
            why = picture(name.partition(":")[2])
        else:
            run, _, ranks = name.partition(":")
            run = os.path.join(folder, run)
            if ranks and not os.path.isdir(os.path.join(run, "processor0")):
                continue
            why = why_not(run, bool(ranks))
    except Exception as error:  # one run that cannot be read must not hide the others
        why = "%s: %s" % (type(error).__name__, error)
    print("%s\t%s" % (name, why or ""), flush=True)
