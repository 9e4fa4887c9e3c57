"""The runs of the bar wave's validation, and what is read from them."""
import math
import re

FORMULATIONS = ("bond", "correspondence", "bondAssociated")
SPEED = math.sqrt(200e9 / 7870)  # sqrt(E/rho)

RUNS = {
    **{f"{f}{n}": [f"variant={f}", f"pulse={n}"] for f in FORMULATIONS for n in (20, 40, 80)},
    **{f"{f}40short": [f"variant={f}", "pulse=40", "horizon=2.015"] for f in FORMULATIONS},
}


def arrival(table):
    """When the front is at half of the peak, when the peak is there, and the peak."""
    times, values = table["Time"], table["U_x"]
    k = max(range(1, len(values) - 1), key=lambda i: values[i])
    a, b, c = values[k - 1 : k + 2]
    shift = 0.5 * (a - c) / (a - 2 * b + c)
    peak = b - 0.25 * (a - c) * shift
    j = max(i for i in range(k) if values[i] < peak / 2)
    part = (peak / 2 - values[j]) / (values[j + 1] - values[j])
    return (times[j] + part * (times[j + 1] - times[j]),
            times[k] + shift * (times[k + 1] - times[k]), peak)


def over_exact(run, which):
    first, last = (arrival(run.table(n))[which] for n in ("quarter", "threeQuarters"))
    text = (run.folder / "constant/bar/polyMesh/points").read_text()
    xs = [float(x) for x in re.findall(r"^\((\S+) ", text, re.M)]
    return (max(xs) - min(xs)) / 2 / (last - first) / SPEED


def front(run):
    """Speed of the place where the front has half of the peak's velocity, over exact."""
    return over_exact(run, 0)


def crest(run):
    """Speed of the peak over exact."""
    return over_exact(run, 1)


def height(run):
    """Peak at three quarters of the bar over that given."""
    return arrival(run.table("threeQuarters"))[2]
