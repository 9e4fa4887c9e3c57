"""The runs of the shocked panel's validation, and what is read from them."""

RUNS = {
    "start4": ["N=4", "endTime=5e-4", "frames=1"],
    "panel4": ["N=4", "endTime=2e-3", "frames=20"],
    "panel8": ["N=8"],
}


def at(run, time):
    """Deflection of the tip [mm] at a time [s]."""
    tip = run.table("tip")
    times, values = tip["Time"], tip["displacement_x"]
    i = next((i for i, t in enumerate(times) if t >= time - 1e-9), len(times) - 1)
    if times[i] < 0.99 * time:
        raise ValueError(f"the run ends at {times[i]:g} s")
    if i == 0 or times[i] <= time + 1e-9:
        return 1e3 * values[i]
    share = (time - times[i - 1]) / (times[i] - times[i - 1])
    return 1e3 * (values[i - 1] + share * (values[i] - values[i - 1]))


def tip100(run):
    return at(run, 1e-4)


def tip300(run):
    return at(run, 3e-4)


def tip500(run):
    return at(run, 5e-4)


def tip700(run):
    return at(run, 7e-4)


def tip1000(run):
    return at(run, 1e-3)


def tip1290(run):
    return at(run, 1.29e-3)


def highest(run):
    """Peak of the tip [mm] and when [ms], by a parabola through three rows."""
    tip = run.table("tip")
    times, values = tip["Time"], tip["displacement_x"]
    i = max(range(1, len(values) - 1), key=lambda k: values[k])
    a, b, c = values[i - 1:i + 2]
    shift = 0.5 * (a - c) / (a - 2 * b + c)
    return 1e3 * (b - 0.25 * (a - c) * shift), 1e3 * (times[i] + shift * (times[i + 1] - times[i]))


def peak(run):
    return highest(run)[0]


def peak_time(run):
    return highest(run)[1]


def share_of_solid(run):
    """Of solid and transfer in the wall time [%]."""
    cost = run.table("cost")
    parts = {k: cost[k][-1] for k in ("solid", "transfer", "output", "flow")}
    return 100 * (parts["solid"] + parts["transfer"]) / sum(parts.values())
