"""Draws a run for scripts/render: pvbatch render.py <run> <out> times=... length=... film=...

ParaView draws what is inside the panels, without any text; matplotlib lays them out.
"""

import os
import shutil
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.ticker import MaxNLocator
from paraview import simple
from PIL import Image
from vtk.util.numpy_support import vtk_to_numpy

from writtenRun import arrays, sources, spacing, times_and_bodies

FRAME_HEIGHT, FRAME_FONT = 720, 26  # of the panel of a frame, pixels
STRIP_WIDTH, STRIP_FONT = 1800, 32  # of the whole strip, pixels
STRIP_PANELS = 6
ARROW_STEP = 48  # between arrows, pixels
MARGIN = 0.3  # around the bodies, of their length
INK = "#202020"


# --- colours ----------------------------------------------------------------------------


def lab(rgb):
    """CIELAB of sRGB colours [n, 3]."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = linear @ np.array(
        [[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]]
    )
    f = np.cbrt(xyz / [0.9505, 1, 1.089])
    x, y, z = f.T
    return np.column_stack([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def part_of(name, end, uniform):
    """One of matplotlib's maps up to `end`; uniform: smooth, its steps equal to the eye."""
    even = np.linspace(0, 1, 256)
    rgb = matplotlib.colormaps[name](end * even)[:, :3]
    if uniform:
        fits = [np.polyfit(even, channel, 3) for channel in rgb.T]
        rgb = np.clip(np.column_stack([np.polyval(fit, even) for fit in fits]), 0, 1)
        way = np.cumsum(np.linalg.norm(np.diff(lab(rgb), axis=0), axis=1))
        way = np.concatenate([[0], way]) / way[-1]
        rgb = np.column_stack([np.interp(even, way, channel) for channel in rgb.T])
    return ListedColormap(rgb)


# Light to dark under dark to light: the points stand out of slow and of fast fluid.
SPEED = part_of("Blues", 0.9, uniform=True)
DAMAGE = part_of("hot", 0.83, uniform=False)


def transfer_function(field, colours, low, high):
    """ParaView's colours for a field."""
    function = simple.GetColorTransferFunction(field)
    values = np.linspace(low, high, colours.N)
    function.RGBPoints = np.column_stack([values, colours.colors]).ravel().tolist()
    function.ColorSpace = "RGB"
    return function


# --- what there is to draw --------------------------------------------------------------


def round_up(value):
    """The next of 1, 1.5, 2, 3, 4, 5, 6, 8, 10 times a power of ten."""
    steps = np.array([1, 1.5, 2, 3, 4, 5, 6, 8, 10, 15]) * 10 ** np.floor(np.log10(value))
    return next(step for step in steps if step > value)


class Run:
    """The sources of a run, and what holds for all of its times."""

    def __init__(self, folder):
        self.times, names = times_and_bodies(folder)
        self.fluid, self.bodies = sources(folder, names)

        fast, self.damage, low, high = [], [], [], []
        for time in self.times:
            mesh, U = arrays(self.fluid, time, "U")
            fast.append(np.percentile(np.linalg.norm(U, axis=1), 99))
            self.damage.append(0)
            for body in self.bodies:
                x, damage = arrays(body, time, "damage")
                self.damage[-1] += damage.sum()
                low.append(x.min(axis=0))
                high.append(x.max(axis=0))
        self.spacings = [
            spacing(*arrays(body, self.times[0], "displacement")) for body in self.bodies
        ]
        # A jet through a tear, fast and short, does not set the range alone.
        self.top_speed = round_up(max(0.85 * max(fast), 1e-30))
        self.front = mesh[:, 2].max()
        self.window = self.window_around(np.min(low, axis=0), np.max(high, axis=0), mesh)

    def window_around(self, low, high, mesh):
        """(left, right, bottom, top) of what is drawn: the bodies and some fluid."""
        margin = MARGIN * (high - low)[:2].max()
        low = np.maximum(low[:2] - margin, mesh[:, :2].min(axis=0))
        high = np.minimum(high[:2] + margin, mesh[:, :2].max(axis=0))
        return low[0], high[0], low[1], high[1]

    def telling_times(self, n):
        """n times or fewer: before, during and after the tearing, or in even steps."""
        times, damage = np.array(self.times), np.array(self.damage) - self.damage[0]
        last = times[-1]
        if damage[-1] <= 0:
            return self.written(np.linspace(0, last, n + 1)[1:])
        begin, end = (times[damage >= part * damage[-1]][0] for part in (0.02, 0.98))
        if end < last:
            tearing = [*np.linspace(begin, end, n - 3), (end + last) / 2, last]
        else:
            tearing = np.linspace(begin, last, n - 1)
        return self.written([begin / 2, *tearing])

    def written(self, wanted):
        """The write times nearest to the wanted ones, each once."""
        return sorted({min(self.times, key=lambda t: abs(t - w)) for w in wanted})


# --- the view ---------------------------------------------------------------------------


class View:
    """Pictures of the window at a time, as arrays."""

    def __init__(self, run):
        self.run = run
        view = self.view = simple.CreateRenderView()
        view.UseColorPaletteForBackground = 0
        view.Background = [1, 1, 1]
        view.OrientationAxesVisibility = 0
        view.UseFXAA = 0
        left, right, bottom, top = run.window
        centre = [(left + right) / 2, (bottom + top) / 2]
        view.CameraParallelProjection = 1
        view.CameraFocalPoint = centre + [run.front]
        view.CameraPosition = centre + [run.front + 10 * (top - bottom)]
        view.CameraParallelScale = (top - bottom) / 2

        fluid = simple.Show(run.fluid, view)
        fluid.Representation = "Surface"
        simple.ColorBy(fluid, ("POINTS", "U", "Magnitude"))
        fluid.LookupTable = transfer_function("U", SPEED, 0, run.top_speed)
        fluid.InterpolateScalarsBeforeMapping = 1
        fluid.Ambient, fluid.Diffuse, fluid.Specular = 1, 0, 0
        for body, spacing_ in zip(run.bodies, run.spacings):
            points = simple.Show(body, view)
            points.Representation = "Point Gaussian"
            points.ShaderPreset = "Plain circle"
            points.GaussianRadius = 0.58 * spacing_
            points.Position = [0, 0, run.front]
            simple.ColorBy(points, ("POINTS", "damage"))
            points.LookupTable = transfer_function("damage", DAMAGE, 0, 1)

    def picture(self, time, width, height):
        """[height, width, 3], drawn twice as large to smooth the edges."""
        self.view.ViewSize = [2 * width, 2 * height]
        self.view.ViewTime = time
        self.view.Update()
        image = self.view.SMProxy.CaptureWindow(1)
        columns, rows, _ = image.GetDimensions()
        values = vtk_to_numpy(image.GetPointData().GetScalars())
        values = values.reshape(rows, columns, -1)[::-1, :, :3]
        assert (rows, columns) == (2 * height, 2 * width)
        values = values.astype(np.uint16)
        values = values[0::2] + values[1::2]
        return ((values[:, 0::2] + values[:, 1::2] + 2) // 4).astype(np.uint8)


class Arrows:
    """The direction of the flow on a coarse grid, beside the bodies."""

    def __init__(self, run, height):
        """height: of the panel, pixels."""
        self.run = run
        left, right, bottom, top = run.window
        self.step = (top - bottom) / round(height / ARROW_STEP)
        self.x, self.y = (
            a.ravel()
            for a in np.meshgrid(
                np.arange(left + self.step / 2, right, self.step),
                np.arange(bottom + self.step / 2, top, self.step),
            )
        )
        mesh, _ = arrays(run.fluid, run.times[0], "U")
        self.nearest = [
            np.hypot(mesh[:, 0] - x, mesh[:, 1] - y).argmin()
            for x, y in zip(self.x, self.y)
        ]

    def at(self, time):
        """x, y and the arrows' x, y; their length grows as the root of the speed."""
        _, U = arrays(self.run.fluid, time, "U")
        arrow = U[self.nearest, :2]
        speed = np.maximum(np.linalg.norm(arrow, axis=1), 1e-30)
        length = 0.95 * self.step * np.sqrt(np.minimum(speed / self.run.top_speed, 1))
        arrow = arrow * (length / speed)[:, None]
        clear = np.ones(len(speed), bool)
        for body, spacing_ in zip(self.run.bodies, self.run.spacings):
            (points,) = arrays(body, time)
            for end in (-0.5, 0, 0.5):
                dx = self.x[:, None] + end * arrow[:, :1] - points[:, 0]
                dy = self.y[:, None] + end * arrow[:, 1:] - points[:, 1]
                clear &= np.hypot(dx, dy).min(axis=1) > 1.2 * spacing_
        arrow[~clear] = 0
        return self.x, self.y, arrow[:, 0], arrow[:, 1]


# --- the sheets -------------------------------------------------------------------------


class Sheet:
    """Panels in rows, two colour bars below: one figure, whose panels can be redrawn."""

    def __init__(self, run, view, columns, rows, width, height, font, length):
        """width, height: of a panel; font: its height; all in pixels."""
        self.run, self.view, self.arrows = run, view, Arrows(run, height)
        self.panel_size = width, height
        self.font, self.points = font, 0.72 * font
        pyplot.rcParams["font.size"] = self.points
        gap, label, bars = round(0.6 * font), round(1.9 * font), round(4.4 * font)
        all_size = columns * (width + gap) + gap, rows * (height + label) + bars
        self.all_size = np.array([n + n % 2 for n in all_size])  # even, as films want it
        self.figure = pyplot.figure(figsize=(self.all_size + 0.1) / 100, dpi=100)

        self.panels = [
            self.panel(gap + c * (width + gap), label + r * (height + label))
            for r in range(rows)
            for c in range(columns)
        ]
        speed = "speed of the fluid" + (" (%s/s)" % length if length else "")
        below = rows * (height + label) + 2 * font
        self.colour_bar(0.27, below, SPEED, run.top_speed, speed, "max")
        self.colour_bar(0.73, below, DAMAGE, 1, "damage (broken bonds)", "neither")

    def axes(self, left, top, width, height):
        """Axes at a place in pixels from the upper left corner."""
        corner = np.array([left, self.all_size[1] - top - height])
        size = np.array([width, height])
        return self.figure.add_axes([*corner / self.all_size, *size / self.all_size])

    def colour_bar(self, centre, top, colours, high, text, extend):
        """centre: as a part of the figure's width."""
        all_wide = self.all_size[0]
        width = min(0.4 * all_wide, 26 * self.font)
        bar = self.figure.colorbar(
            ScalarMappable(Normalize(0, high), colours),
            cax=self.axes(centre * all_wide - width / 2, top, width, 0.7 * self.font),
            orientation="horizontal",
            extend=extend,
            ticks=MaxNLocator(6, steps=[1, 2, 5, 10]),
        )
        bar.outline.set_edgecolor(INK)
        bar.ax.xaxis.set_major_formatter("{x:.3g}")
        bar.ax.tick_params(labelsize=0.9 * self.points, colors=INK, length=0.2 * self.font)
        bar.ax.set_title(text, fontsize=self.points, color=INK, pad=0.25 * self.font)

    def panel(self, left, top):
        width, height = self.panel_size
        axes = self.axes(left, top, width, height)
        axes.set_xticks([])
        axes.set_yticks([])
        for side in axes.spines.values():
            side.set_edgecolor("#808080")
        blank = np.zeros((height, width, 3), np.uint8)
        image = axes.imshow(blank, extent=self.run.window, interpolation="nearest")
        quiver = axes.quiver(
            self.arrows.x, self.arrows.y, 0 * self.arrows.x, 0 * self.arrows.y,
            pivot="mid", angles="xy", scale_units="xy", scale=1, units="dots",
            width=2, headwidth=4, headlength=4.5, headaxislength=4, minlength=0.6,
            color="#10305a", alpha=0.5,
        )
        axes.set_xlim(self.run.window[:2])
        axes.set_ylim(self.run.window[2:])
        return axes, image, quiver

    def draw(self, times, path):
        for (axes, image, quiver), time in zip(self.panels, times):
            image.set_data(self.view.picture(time, *self.panel_size))
            quiver.set_UVC(*self.arrows.at(time)[2:])
            axes.set_title(
                "t = %s s" % self.label(time),
                loc="left", fontsize=1.05 * self.points, color=INK, pad=0.35 * self.points,
            )
        self.figure.savefig(path, facecolor="white", pil_kwargs={"compress_level": 4})

    def label(self, time):
        last = self.run.times[-1] or 1
        digits = max(0, 2 - int(np.floor(np.log10(last))))
        return "%.*f" % (digits, time)


def film(frames, out, rate):
    """Writes a film of pictures; returns its path."""
    if shutil.which("ffmpeg"):
        path = os.path.join(out, "film.mp4")
        pattern = os.path.join(out, "frame_%03d.png")
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-framerate", str(rate), "-i", pattern,
                        "-pix_fmt", "yuv420p", path], check=True, stdin=subprocess.DEVNULL)
        return path
    path = os.path.join(out, "film.gif")
    # One palette for all, or colours would flicker
    palette = Image.open(frames[-1]).convert("RGB").quantize(256, Image.MAXCOVERAGE)
    pictures = [Image.open(frame).convert("RGB").quantize(palette=palette, dither=0)
                for frame in frames]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=round(1000 / rate),
                     loop=0)
    return path


def main(folder, out, strip_times, length, rate):
    simple._DisableFirstRenderCameraReset()
    run = Run(folder)
    view = View(run)
    left, right, bottom, top = run.window
    aspect = (right - left) / (top - bottom)

    width = round(FRAME_HEIGHT * aspect)
    sheet = Sheet(run, view, 1, 1, width, FRAME_HEIGHT, FRAME_FONT, length)
    frames = [os.path.join(out, "frame_%03d.png" % i) for i in range(len(run.times))]
    for i, time in enumerate(run.times):
        sheet.draw([time], frames[i])
        if (i + 1) % 10 == 0:
            print("render: %d of %d frames" % (i + 1, len(run.times)), flush=True)

    if strip_times:
        chosen = run.written([float(time) for time in strip_times.split(",")])
    else:
        chosen = run.telling_times(STRIP_PANELS)
    columns = 2 if len(chosen) == 4 or aspect > 1.6 else 3
    columns = min(len(chosen), columns)
    rows = -(-len(chosen) // columns)
    width = round(STRIP_WIDTH / columns - 0.8 * STRIP_FONT)
    height = round(width / aspect)
    sheet = Sheet(run, view, columns, rows, width, height, STRIP_FONT, length)
    for axes, _, _ in sheet.panels[len(chosen) :]:
        axes.set_visible(False)
    sheet.draw(chosen, os.path.join(out, "strip.png"))
    print("render: %d frames and strip.png in %s" % (len(run.times), os.path.abspath(out)))
    if rate:
        print("render: %s" % os.path.abspath(film(frames, out, int(rate))))


folder, out, *keys = sys.argv[1:]
main(folder, out, *(key.partition("=")[2] for key in keys))
