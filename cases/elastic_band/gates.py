"""The runs of the elastic band's validation, and what is read from them."""
import math
import re

REFERENCE_DISPLACEMENT = 0.1767  # right face at mid-height, finite elements

SIZES = (8, 12, 16, 20)

RUNS = {
    **{f"dynamic{n}": ["variant=dynamic", f"N={n}"] for n in SIZES},
    # Four times the step that the explicit scheme bears
    **{
        f"implicit{n}": ["variant=dynamic", f"N={n}", "implicitElastic=0.5", "outerCorrectors=2",
                         f"deltaT={4 * 0.0256 / n:.6g}", "outputInterval=1"]
        for n in SIZES
    },
    **{f"static{n}": ["variant=static", f"N={n}"] for n in SIZES},
    **{
        f"static12_{p}": ["variant=static", "N=12", f"pressureDifference={p}"]
        for p in (10, 40, 60)
    },
    **{f"rupture{n}": ["variant=rupture", f"N={n}"] for n in (12, 16, 20)},
    **{f"notch{n}": ["variant=notch", f"N={n}"] for n in (12, 16, 20)},
    "noDiagonals": ["variant=static", "N=12", "horizon=1.015"],
}


def extremum(times, values, sign):
    """Time and value of the largest sign*value, by the parabola through three rows."""
    i = max(range(1, len(values) - 1), key=lambda k: sign * values[k])
    a, b, c = values[i - 1 : i + 2]
    bend = a - 2 * b + c
    shift = 0.5 * (a - c) / bend if bend else 0
    return times[i] + shift * (times[i + 1] - times[i]), b - 0.25 * (a - c) * shift


def first_peak(run):
    face = run.table("rightFace")
    rows = [k for k, t in enumerate(face["Time"]) if t < 0.4]
    times = [face["Time"][k] for k in rows]
    return extremum(times, [face["displacement_x"][k] for k in rows], 1)


def peak_time(run):
    return first_peak(run)[0]


def peak_ratio(coarse, fine):
    return first_peak(coarse)[1] / first_peak(fine)[1]


def next_oscillation(run):
    """When the band turns round after the first peak."""
    face = run.table("rightFace")
    rows = [k for k, t in enumerate(face["Time"]) if t > 0.4]
    times = [face["Time"][k] for k in rows]
    return extremum(times, [face["displacement_x"][k] for k in rows], -1)[0]


def volume_change(run):
    """Size of the mean volume change at 0.3 s, in percent."""
    band = run.table("band")
    k = min(range(len(band["Time"])), key=lambda i: abs(band["Time"][i] - 0.3))
    return 100 * abs(band["mean(J-1)"][k])


def static_displacement(run):
    return run.table("rightFace")["displacement_x"][-1]


def order(*runs):
    """Slope of the error over 1/N of the static runs, least squares in logarithms."""
    x = [-math.log(n) for n in SIZES]
    y = [math.log(abs(static_displacement(run) - REFERENCE_DISPLACEMENT)) for run in runs]
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y)) / sum(
        (a - mean_x) ** 2 for a in x)


def envelope(coarse, fine):
    """Largest displacement of one over that of the other, over both periods."""
    return max(coarse.table("rightFace")["displacement_x"]) / max(
        fine.table("rightFace")["displacement_x"])


def completed(run):
    return 0 if run.failed else 1


def separation(run):
    """Time when a piece that nothing holds has most of the volume, and its share."""
    pattern = r"at t = (\S+) s band has \S+ pieces? that nothing holds, the largest with (\S+) %"
    for time, share in re.findall(pattern, run.log):
        if float(share) > 50:
            return float(time), float(share)
    return float("inf"), 0.0


def separation_time(run):
    return separation(run)[0]


def separation_ratio(a, b):
    return separation(a)[0] / separation(b)[0]


def separated_share(run):
    """Share of the free span in the piece that came free, in percent: what is missing
    stayed at the junctions."""
    return separation(run)[1]


def torn_in_two(run):
    """The two largest pieces when the notched band first is in two that hold more than
    a quarter each: (time, share, share, height, height)."""
    part = r"(\S+) % of its volume, centred at \(\S+ (\S+) \S+\), held"
    pattern = rf"at t = (\S+) s band is in \S+ pieces: {part}; {part}"
    for time, share1, y1, share2, y2 in re.findall(pattern, run.log):
        if float(share2) > 25:
            return tuple(float(v) for v in (time, share1, share2, y1, y2))
    return float("inf"), 0.0, 0.0, 0.0, 0.0


def notch_time(run):
    return torn_in_two(run)[0]


def notch_ratio(a, b):
    return notch_time(a) / notch_time(b)


def notch_asymmetry(run):
    """Difference of the two pieces, in points of the band."""
    N = int(re.search(r"^N (\d+);", (run.folder / "system/overrides").read_text(), re.M)[1])
    _, share1, share2, _, _ = torn_in_two(run)
    return abs(share1 - share2) / 100 * 8 * N * N


def fails(run):
    """1 when the run ended in an error or went beyond one and a half times the answer."""
    face = run.table("rightFace")
    return int(run.failed or max(map(abs, face["displacement_x"])) > 1.5 * REFERENCE_DISPLACEMENT)


def coupling_share(run):
    """Solid and transfer in percent of the run's wall time."""
    cost = run.table("cost")
    parts = {k: cost[k][-1] for k in ("solid", "transfer", "output", "flow")}
    return 100 * (parts["solid"] + parts["transfer"]) / sum(parts.values())
