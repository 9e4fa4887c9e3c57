"""ParaView macro: the flow by its speed, points by their damage, broken bonds if there are lines.

In ParaView: Macros > Import new macro, or copy this file to ParaView's folder Macros
(~/.config/ParaView/Macros); open case.foam, Apply, and press the macro's button. Without a window:

    pvbatch periFoam.py <run>/case.foam <picture.png> [time]

In three dimensions the flow is shown on a plane through the bodies. `scripts/bonds <run>` makes
the lines of the broken bonds. It needs nothing but ParaView, 5.11 or so.
"""
import glob
import os
import sys

from paraview import simple

SPREAD = 0.3  # of the window around the bodies, of their size
# Values and colours: sound material is grey, broken material dark red
DAMAGE = [0, 0.64, 0.67, 0.71, 0.3, 0.94, 0.66, 0.27, 0.6, 0.8, 0.17, 0.12, 1, 0.31, 0, 0]


def reader_of(path=None):
    """The reader of that case, or the active one."""
    reader = simple.OpenFOAMReader(FileName=path) if path else simple.GetActiveSource()
    if reader is None or reader.GetXMLName() != "OpenFOAMReader":
        raise RuntimeError("periFoam: open a case.foam, select it and press the macro again")
    return reader


def is_whole(folder):
    """Did the run write times itself, or were they reconstructed, with the points?"""
    patterns = ("*/lagrangian/*/positions", "*/*/lagrangian/*/positions")
    paths = [p for pattern in patterns for p in glob.glob(os.path.join(glob.escape(folder), pattern))]
    return any(not os.path.relpath(p, folder).startswith("processor") for p in paths)


def set_up(reader):
    """All that is shown is read, at every time but 0. Returns the regions of flow and points."""
    whole = is_whole(os.path.dirname(reader.FileName))
    reader.CaseType = "Reconstructed Case" if whole else "Decomposed Case"
    reader.SkipZeroTime = 1  # fields of time 0 may have directives that ParaView does not know
    reader.SMProxy.InvokeCommand("Refresh")
    reader.UpdatePipelineInformation()
    there = reader.GetProperty("MeshRegions").Available
    points = [region for region in there if "lagrangian/" in region]
    flow = [region for region in there if region == "internalMesh"]
    reader.MeshRegions = flow + points
    reader.CellArrays = ["U"]
    reader.LagrangianArrays = reader.GetProperty("LagrangianArrays").Available
    return flow, points


def block(reader, region, time):
    """One region of the reader: of the flow its name is short, of others it begins with /."""
    part = simple.ExtractBlock(Input=reader)
    part.Selectors = ["/Root" + region if region[0] == "/" else "/Root/defaultRegion/" + region]
    part.UpdatePipeline(time)
    simple.RenameSource(region.strip("/").split("/")[-1], part)
    return part


def bounds(source):
    b = source.GetDataInformation().GetBounds()
    return [(b[2 * k], b[2 * k + 1]) for k in range(3)]


def extent(box):
    return [high - low for low, high in box]


def joined(boxes):
    return [(min(b[k][0] for b in boxes), max(b[k][1] for b in boxes)) for k in range(3)]


def add_bar(display, title, corner):
    bar = simple.GetScalarBar(display.LookupTable, display_view)
    bar.Title, bar.ComponentTitle = title, ""
    bar.TitleColor = bar.LabelColor = [0, 0, 0]
    bar.TitleFontSize, bar.LabelFontSize, bar.ScalarBarThickness = 14, 12, 12
    bar.RangeLabelFormat = bar.LabelFormat = "%.3g"
    bar.Orientation, bar.ScalarBarLength = "Horizontal", 0.3
    bar.WindowLocation = corner
    display.SetScalarBarVisibility(display_view, True)


def show_flow(mesh, bodies, across, time):
    """A plane mesh as it is; one in space on a plane through the bodies."""
    shown = mesh
    if across is None:
        middle = [(low + high) / 2 for low, high in bodies]
        thin = min(range(3), key=lambda k: extent(bodies)[k])
        shown = simple.Slice(Input=mesh, SliceType="Plane")
        shown.SliceType.Origin = middle
        shown.SliceType.Normal = [float(k == thin) for k in range(3)]
        simple.Hide3DWidgets(proxy=shown.SliceType)
        simple.RenameSource("flow", shown)
    shown.UpdatePipeline(time)
    display = simple.Show(shown, display_view)
    display.Representation = "Surface"
    display.Ambient, display.Diffuse, display.Specular = 1, 0, 0
    simple.ColorBy(display, ("POINTS", "U", "Magnitude"))
    top = shown.PointData["U"].GetRange(-1)[1] or 1
    display.LookupTable.ApplyPreset("Blues", True)
    display.LookupTable.InvertTransferFunction()
    display.LookupTable.RescaleTransferFunction(0, top)
    add_bar(display, "speed", "Lower Left Corner")


def show_points(points, in_front):
    """Discs or balls as large as the points are apart."""
    n = points.GetDataInformation().GetNumberOfPoints()
    sizes = sorted(extent(bounds(points)))[-2 if in_front else -3:]
    apart = 1.0
    for size in sizes:
        apart *= size
    apart = (apart / max(n, 1)) ** (1 / len(sizes))
    display = simple.Show(points, display_view)
    display.Representation = "Point Gaussian"
    display.ShaderPreset = "Plain circle" if in_front else "Sphere"
    display.GaussianRadius = 0.58 * apart
    if in_front:
        display.Position = in_front
    simple.ColorBy(display, ("POINTS", "damage"))
    display.LookupTable.ColorSpace = "RGB"
    display.LookupTable.RGBPoints = DAMAGE
    add_bar(display, "damage", "Lower Right Corner")


def show_bonds(path, in_front):
    lines = simple.PVDReader(FileName=path)
    simple.RenameSource("bonds of " + os.path.basename(path)[:-4], lines)
    display = simple.Show(lines, display_view)
    display.ColorArrayName = ["POINTS", ""]
    display.AmbientColor = display.DiffuseColor = [0.05, 0.05, 0.05]
    display.LineWidth, display.Opacity = 1, 0.4
    if in_front:
        display.Position = [2 * p for p in in_front]
    return lines


def look(box, across):
    """At the bodies, along the axis that is not solved for, or from a corner."""
    view, centre, size = display_view, [(a + b) / 2 for a, b in box], max(extent(box))
    view.CameraFocalPoint = centre
    view.CameraParallelProjection = 1
    if across is None:
        way, up = (-0.4, -0.8, 0.45), (0, 0, 1)
    else:
        way, up = [float(k == across) for k in range(3)], (0, 0, 1) if across == 1 else (0, 1, 0)
        way = [-w for w in way] if across == 1 else way
    view.CameraPosition = [c + 10 * size * w for c, w in zip(centre, way)]
    view.CameraViewUp = up
    view.CameraParallelScale = (0.5 + SPREAD) * size


def show(path=None, time=None):
    """Shows the case, at a time or the last; returns what there is: flow, points, bonds."""
    global display_view
    reader = reader_of(path)
    display_view = view = simple.GetActiveViewOrCreate("RenderView")
    simple.HideAll(view)
    flow, points = set_up(reader)
    simple.GetAnimationScene().PlayMode = "Snap To TimeSteps"
    times = list(reader.TimestepValues)
    if not times or not points:
        raise RuntimeError("periFoam: %s holds no time with points of a body" % reader.FileName)
    time = times[-1] if time is None else time
    simple.GetAnimationScene().AnimationTime = time
    meshes = [block(reader, region, time) for region in flow]
    clouds = [block(reader, region, time) for region in points]
    bodies = joined([bounds(cloud) for cloud in clouds])
    all_ = joined([bounds(source) for source in meshes + clouds])
    # Two dimensions: the points are in one plane, and are shown in front of the flow
    size = max(extent(bodies))
    thin = [k for k in range(3) if extent(bodies)[k] < 1e-6 * size]
    across = thin[-1] if thin else None
    in_front = None
    if thin:
        way = -1 if across == 1 else 1
        in_front = [way * (1e-3 * size + extent(all_)[k]) if k == across else 0 for k in range(3)]
    for mesh in meshes:
        show_flow(mesh, bodies, across, time)
    for cloud in clouds:
        show_points(cloud, in_front)
    files = sorted(glob.glob(os.path.join(
        glob.escape(os.path.dirname(reader.FileName)), "postProcessing", "bonds", "*.pvd")))
    bonds = [show_bonds(path, in_front) for path in files]

    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    view.OrientationAxesVisibility = 0
    look(bodies, across)
    simple.Render(view)
    return meshes, clouds, bonds


def main():
    words = [word for word in getattr(sys, "argv", [])[1:] if not word.startswith("-")]
    path = next((word for word in words if word.endswith(".foam")), None)
    picture = next((word for word in words if word.endswith(".png")), None)
    time = next((float(word) for word in words if word not in (path, picture)), None)
    if path and not os.path.isfile(path):
        sys.exit("periFoam: there is no %s" % path)
    show(os.path.abspath(path) if path else None, time)
    if picture:
        simple.SaveScreenshot(picture, display_view, ImageResolution=[1200, 900])


if __name__ == "__main__":
    main()
