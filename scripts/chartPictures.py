"""The pictures of scripts/chart, from the rows of its csv alone."""
import math

import numpy as np
from matplotlib import pyplot
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

import chartRows
from casePictures import COLOURS, GREY, save

# Keys whose value says enough by itself
PLAIN = {"kernel", "transfer", "ddtScheme"}
SHORT = {"horizon": "horizon", "pressureTolerance": "p tol.", "outerCorrectors": "outer",
         "holdStrength": "hold", "nuStab": r"$\nu$", "deltaT": r"$\Delta t$"}
SMALLEST = 1e-3  # an error drawn at the lower edge: less is chance
PARTS = ("flow", "solid", "transfer", "output")
# What the bars of shares may differ in
SHARED = {"variant", "N", "ranks", "horizon", "outerCorrectors", "correctors",
          "pressureTolerance"}


def label(row):
    """A configuration in few words, without what the panel's title says."""
    words = []
    for key, value in chartRows.keys(row).items():
        if key == "deltaT":
            words.append(rf"$\Delta t$ {float(value):.2g} s")
        elif key == "hold":
            words.append(value)
        elif key != "variant":
            words.append(value if key in PLAIN else f"{SHORT.get(key, key)} {value}")
    return ", ".join(words) or "as it is"


def groups(rows, *names):
    """{(row[name], ...): rows} in the order of first appearance."""
    found = {}
    for row in rows:
        found.setdefault(tuple(row[name] for name in names), []).append(row)
    return found


def panels(n, width=4.6, height=3.6):
    across = min(n, 3)
    down = math.ceil(n / across)
    figure, axes = pyplot.subplots(down, across, squeeze=False,
                                   figsize=(width * across, height * down))
    for spare in axes.flat[n:]:
        spare.set_visible(False)
    return figure, list(axes.flat[:n])


def plain_logs(axis, ticks=(1, 2, 5)):
    axis.set_major_locator(LogLocator(subs=ticks))
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axis.set_minor_formatter(NullFormatter())


def shown(row):
    return max(row["absolute_error"], SMALLEST)


def set_limits(ax, rows):
    """Around all errors; errors that the reference cannot tell apart on grey."""
    errors = [shown(r) for r in rows]
    low, high = min(errors) / 2, max(errors) * 2
    known = rows[0]["known_to"]
    if known and known > low:
        low = min(low, known / 3)
        ax.axhspan(low, known, facecolor="#e8e8e8", zorder=0, lw=0,
                   label="the reference is not known better")
    ax.set_ylim(low, high)


def place_labels(axes, spots, taken):
    """Texts beside points, where they cover neither points nor each other."""
    figure = axes.figure
    renderer = figure.canvas.get_renderer()
    frame = axes.get_window_extent(renderer)
    points = axes.transData.transform(taken)
    boxes = []
    ways = [(r * x, r * y) for r in (6, 12, 20, 30, 42, 56, 72)
            for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1.2), (0, -1.2))]
    for x, y, words in spots:
        best = None
        for dx, dy in ways:
            text = axes.annotate(
                words, (x, y), (dx, dy), textcoords="offset points", fontsize=7,
                ha="left" if dx > 0 else "right" if dx < 0 else "center",
                va="bottom" if dy > 0 else "top", annotation_clip=False,
                arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.5, "shrinkA": 0,
                            "shrinkB": 2})
            box = text.get_window_extent(renderer)
            hits = sum(box.overlaps(other) for other in boxes) * 5
            hits += sum(box.x0 - 2 < px < box.x1 + 2 and box.y0 - 2 < py < box.y1 + 2
                        for px, py in points)
            hits += 20 * (box.x0 < frame.x0 or box.x1 > frame.x1 or box.y0 < frame.y0
                          or box.y1 > frame.y1)
            if best is None or hits < best[0]:
                if best:
                    best[1].remove()
                best = hits, text, box
            else:
                text.remove()
            if hits == 0:
                break
        boxes.append(best[2])


def along(corners):
    """Places on the steps between corners, where no label should be."""
    places = []
    for (x0, y0), (x1, y1) in zip(corners, corners[1:]):
        places += [(x0 * (x1 / x0) ** t, y0) for t in np.linspace(0, 1, 9)]
        places += [(x1, y0 * (y1 / y0) ** t) for t in np.linspace(0, 1, 9)]
    return places


def draw_errors(rows):
    """Error against cost, with the front of what nothing beats in both."""
    by_quantity = groups(filter(chartRows.is_good, rows), "case", "quantity")
    figure, axes = panels(len(by_quantity), 5.2, 4.2)
    later = []
    for ax, ((case, quantity), found) in zip(axes, by_quantity.items()):
        plain = [r for r in found if set(chartRows.keys(r)) <= {"variant", "N"}]
        ax.scatter([r["core_seconds"] for r in found], [shown(r) for r in found], s=14,
                   color=GREY, alpha=0.7, linewidths=0, label="one key changed")
        ax.plot([r["core_seconds"] for r in plain], [shown(r) for r in plain], "o-", ms=4,
                lw=0.8, color=COLOURS[0], label="N alone")
        best = chartRows.front(found)
        corners = [(r["core_seconds"], shown(r)) for r in best]
        ax.step(*zip(*corners), where="post", color=COLOURS[1], lw=1.2,
                label="nothing is better in both")
        ax.plot(*zip(*corners), "s", ms=5, mfc="none", color=COLOURS[1])
        ax.set(xscale="log", yscale="log", xlabel="processor time [s]",
               ylabel=f"error [{found[0]['error_unit']}]", title=f"{case}: {quantity}")
        ax.margins(0.12)
        set_limits(ax, found)
        plain_logs(ax.xaxis)
        low, high = ax.get_ylim()
        plain_logs(ax.yaxis, (1,) if high > 50 * low else (1, 2, 5))
        later.append((ax, [(*c, label(r)) for c, r in zip(corners, best)],
                      [(r["core_seconds"], shown(r)) for r in found] + along(corners)))
    axes[0].legend(fontsize=7, facecolor="white", edgecolor="none", loc="lower left")
    figure.canvas.draw()
    for ax, spots, taken in later:
        place_labels(ax, spots, taken)
    save(figure, "chart_errors")


def draw_orders(rows):
    """Error against N, with the slope of the line that fits best where errors fall at all."""
    lines = {key: pairs for key, pairs in chartRows.refinements(rows).items() if len(pairs) > 2}
    if not lines:
        return
    titles = list(dict.fromkeys(key[:2] for key in lines))
    figure, axes = panels(len(titles))
    for ax, title in zip(axes, titles):
        mine = [(key[2], pairs) for key, pairs in lines.items() if key[:2] == title]
        for colour, (same, pairs) in zip(COLOURS * 3, mine):
            N = [n for n, _ in pairs]
            errors = [shown(r) for _, r in pairs]
            words = " ".join(w for w in same.split() if not w.startswith("variant"))
            falling = all(b < a for a, b in zip(errors, errors[1:]))
            note = "does not fall throughout"
            if falling:
                slope, at_one = np.polyfit(np.log(N), np.log(errors), 1)
                ax.plot(N, np.exp(at_one) * np.array(N) ** slope, lw=0.9, color=colour)
                note = f"slope {slope:+.2f}"
            ax.plot(N, errors, "o" if falling else "o:", ms=4, lw=0.7, color=colour,
                    label=f"{words or 'as it is'}: {note}")
        row = mine[0][1][0][1]
        everyone = sorted({n for _, pairs in mine for n, _ in pairs})
        ax.set(xscale="log", yscale="log", xlabel="N", title=": ".join(title),
               ylabel=f"error [{row['error_unit']}]")
        ax.set_xticks(everyone, [str(n) for n in everyone])
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.margins(0.1)
        set_limits(ax, [r for _, pairs in mine for _, r in pairs])
        plain_logs(ax.yaxis)
        ax.legend(fontsize=7, frameon=False)
    save(figure, "chart_orders")


def draw_shares(rows):
    """Where wall time goes."""
    runs = {(r["case"], r["arguments"]): r for r in rows if r["status"] == "ok"
            and r["flow"] is not None and set(chartRows.keys(r)) <= SHARED}
    figure, ax = pyplot.subplots(figsize=(7, 0.8 + 0.24 * len(runs)))
    names = []
    for place, row in enumerate(runs.values()):
        variant = chartRows.keys(row).get("variant", row["case"])
        names.append(f"{variant}: {label(row)}  ({row['core_seconds']:.3g} s)")
        left = 0
        for part, colour in zip(PARTS, (COLOURS[0], COLOURS[1], COLOURS[2], "#c8c8c8")):
            ax.barh(place, row[part], left=left, color=colour, height=0.75,
                    label=part if place == 0 else None)
            left += row[part]
    ax.set_yticks(range(len(names)), names, fontsize=7)
    ax.invert_yaxis()
    ax.set(xlim=(0, 100), xlabel="share of the wall time [%]")
    ax.legend(ncols=4, fontsize=7, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1))
    save(figure, "chart_shares")


def draw_all(rows):
    if not any(map(chartRows.is_good, rows)):
        print("chart: no run has an error to draw")
        return
    draw_errors(rows)
    draw_orders(rows)
    draw_shares(rows)
