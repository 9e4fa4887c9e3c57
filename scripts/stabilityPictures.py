"""The picture and the tables of scripts/stability, from the rows of its csv alone."""
import re

import numpy as np
from matplotlib import pyplot
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from casePictures import COLOURS, GREY, ROOT, save

PAGE = ROOT / "docs" / "limits.md"
WANTED = 1.0, 1.5  # measured over predicted


def number(row, name):
    return float(row[name]) if row[name] else None


def short(row):
    return row["keys"] or row["group"]


def draw_steps(rows):
    """Measured and predicted step of each row, and their ratio."""
    rows = [r for r in rows if r["kind"] == "step"]
    figure, (left, right) = pyplot.subplots(
        1, 2, sharey=True, width_ratios=(3, 2), figsize=(9, 0.9 + 0.21 * len(rows)))
    for place, row in enumerate(rows):
        predicted, measured = number(row, "predicted"), number(row, "measured")
        if predicted is None or measured is None:
            left.text(0.01, place, row["report"][:78], fontsize=6, color=COLOURS[1],
                      va="center", transform=left.get_yaxis_transform())
            continue
        least = row["report"].startswith("stable at all")
        left.plot([predicted, measured], [place, place], lw=0.8, color=GREY, zorder=1)
        left.plot(predicted, place, "o", ms=5, mfc="white", color=COLOURS[0])
        left.plot(measured, place, ">" if least else "o", ms=5, color=COLOURS[1])
        right.plot(measured / predicted, place, ">" if least else "o", ms=5, color=COLOURS[1])
    left.plot([], [], "o", ms=5, mfc="white", color=COLOURS[0], label="predicted")
    left.plot([], [], "o", ms=5, color=COLOURS[1], label="measured")
    left.plot([], [], ">", ms=5, color=COLOURS[1], label="at least")
    left.set_yticks(range(len(rows)), [short(r) for r in rows], fontsize=7)
    left.set_ylim(len(rows) - 0.5, -0.5)
    left.set(xscale="log", xlabel="largest stable deltaT [s]")
    right.axvspan(*WANTED, color="#dfeee4", lw=0, zorder=0)
    right.axvline(1, color=GREY, lw=0.8, zorder=0)
    right.set(xscale="log", xlabel="measured over predicted")
    right.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    right.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    right.xaxis.set_minor_formatter(NullFormatter())
    for ax in (left, right):
        ax.grid(axis="y", color="#eeeeee", zorder=0)
        ax.set_axisbelow(True)
    left.legend(ncols=3, fontsize=7, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1))
    save(figure, "stability")


def keys(row):
    return dict(word.split("=", 1) for word in row["keys"].split())


def lines_of(rows):
    """{(group, quantity, key that varies): {what else varies: [(x, y)]}} of looks."""
    found = {}
    for row in rows:
        if row["kind"] == "look" and row["measured"]:
            found.setdefault((row["group"], row["quantity"], row["unit"]), []).append(row)
    for (group, quantity, unit), mine in found.items():
        varying = [k for k in keys(mine[0])
                   if k != "deltaT" and len({keys(r).get(k) for r in mine}) > 1]
        if len(mine) < 3 or not varying:
            continue
        lines = {}
        for row in mine:
            rest = " ".join(f"{k} {keys(row)[k]}" for k in varying[1:])
            lines.setdefault(rest, []).append(
                (float(keys(row)[varying[0]]), number(row, "measured")))
        yield group, quantity, unit, varying[0], lines


def draw_looks(rows):
    panels = list(lines_of(rows))
    if not panels:
        return
    figure, axes = pyplot.subplots(1, len(panels), figsize=(3.1 * len(panels), 2.7), squeeze=False)
    for ax, (group, quantity, unit, key, lines) in zip(axes.flat, panels):
        for colour, (rest, pairs) in zip(COLOURS, lines.items()):
            ax.plot(*np.array(sorted(pairs)).T, "o-", ms=4, lw=0.9, color=colour, label=rest)
        ax.set(title=group, xlabel=key, ylabel=f"{quantity} [{unit}]")
        ax.set_ylim(bottom=min(0, ax.get_ylim()[0]))
        if len(lines) > 1:
            ax.legend(fontsize=7, frameon=False)
    save(figure, "limits")


# ---- docs/limits.md --------------------------------------------------------------------

def table(header, lines):
    rule = "|" + "---|" * len(header)
    lines = [[cell.replace("|", "\\|") for cell in line] for line in lines]
    return "\n".join(["| " + " | ".join(header) + " |", rule] +
                     ["| " + " | ".join(line) + " |" for line in lines])


def figure_of(row):
    if not row["measured"]:
        return "-"
    return f"{row['measured']} {row['unit'].replace('-', '')}".strip()


def tables(rows):
    steps = [(r["group"], f"`{r['keys']}`", r["predicted"] or "-", r["measured"] or "-",
              r["ratio"] or "-", r["report"]) for r in rows if r["kind"] == "step"]
    edges = [(r["group"], f"`{r['keys']}`", f"{r['quantity']} {r['measured'] or '-'}",
              r["report"]) for r in rows if r["kind"] == "edge"]
    looks = [(r["group"], f"`{r['keys']}`", r["quantity"], figure_of(r), r["report"])
             for r in rows if r["kind"] == "look"]
    return {
        "steps": table(("row", "keys", "predicted [s]", "measured [s]", "ratio", "beyond it"),
                       steps),
        "edges": table(("row", "keys", "sound up to", "beyond it"), edges),
        "looks": table(("row", "keys", "what is read", "figure", "report"), looks),
    }


def write_page(rows):
    """Puts the tables between their marks."""
    if not PAGE.is_file():
        return
    text = PAGE.read_text()
    for name, new in tables(rows).items():
        text = re.sub(rf"(<!-- {name} -->\n).*?(<!-- end -->)",
                      lambda m, new=new: f"{m[1]}{new}\n{m[2]}", text, flags=re.S)
    PAGE.write_text(text)
    print(PAGE)


def draw_all(rows):
    draw_steps(rows)
    draw_looks(rows)
    write_page(rows)
