"""The runs of the Turek-Hron benchmark's validation, and what is read from them."""

RUNS = {
    **{f"csm{n}": ["variant=csm3", f"N={n}"] for n in (4, 8, 12, 16)},
    "fsi2": ["variant=fsi2", "N=8", "outputInterval=10"],
}


def rises(times, values):
    """When the values pass their middle, (highest + lowest)/2, upwards."""
    middle = (max(values) + min(values)) / 2
    found = []
    for t, s, a, b in zip(times, times[1:], values, values[1:]):
        if a < middle <= b:
            found.append(t + (middle - a) / (b - a) * (s - t))
    return found


def oscillation(run, column):
    """Mean and amplitude in the last period, (highest +- lowest)/2 as the benchmark has them,
    and the frequency there."""
    tip = run.table("tip")
    times, values = tip["Time"], tip[column]
    late = times[-1] * (0 if "variant=csm3" in run.key else 0.8)
    begin = next(i for i, t in enumerate(times) if t >= late)
    times, values = times[begin:], values[begin:]
    start, end = rises(times, values)[-2:]
    period = [u for t, u in zip(times, values) if start <= t <= end]
    return ((max(period) + min(period)) / 2, (max(period) - min(period)) / 2,
            1 / (end - start))


def mean_x(run):
    return 1e3 * oscillation(run, "displacement_x")[0]


def mean_y(run):
    return 1e3 * oscillation(run, "displacement_y")[0]


def amplitude_x(run):
    return 1e3 * oscillation(run, "displacement_x")[1]


def amplitude_y(run):
    return 1e3 * oscillation(run, "displacement_y")[1]


def frequency_x(run):
    return oscillation(run, "displacement_x")[2]


def frequency_y(run):
    return oscillation(run, "displacement_y")[2]


def error_ratio(fine, coarse):
    """Error of the fine run's mean deflection over that of the coarse one."""
    return (mean_y(fine) + 63.541) / (mean_y(coarse) + 63.541)
