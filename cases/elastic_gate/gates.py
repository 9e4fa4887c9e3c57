"""The runs of the elastic gate's validation, and what is read from them."""

SOFT = ["E=7.8e6", "nu=0.47"]
RUNS = {
    "start4": ["N=4", "endTime=0.08", "frames=2", *SOFT],
    "soft4": ["N=4", *SOFT],
    "soft8": ["N=8", *SOFT],
    "soft12": ["N=12", "endTime=0.14", "frames=7", *SOFT],
    "short4": ["N=4", "endTime=0.14", "frames=7", "maxCo=0.1", *SOFT],
    "stiff4": ["N=4", "endTime=0.14", "frames=7"],
    "stiff8": ["N=8", "endTime=0.14", "frames=7"],
    "late4": ["N=4", "endTime=0.14", "frames=7", "implicitDrag=1"],
    "heavy4": ["N=4", "endTime=0.14", "frames=7", "fill=1"],
    "water4": ["N=4", "endTime=0.14", "frames=7", "fill=1", "rhoInf=1000"],
    "lateWater4": ["N=4", "endTime=0.14", "frames=7", "fill=1", "rhoInf=1000", "implicitDrag=1"],
}


def highest(run, column):
    """Largest displacement of the gate's end [mm], and when [s]."""
    tip = run.table("tip")
    values = tip[column]
    i = max(range(len(values)), key=lambda k: values[k])
    if i == len(values) - 1:
        raise ValueError("the run ends before the highest value")
    return 1e3 * values[i], tip["Time"][i]


def at(run, column, time):
    """The same at a time."""
    tip = run.table("tip")
    times, values = tip["Time"], tip[column]
    i = next((i for i, t in enumerate(times) if t >= time * (1 - 1e-9)), None)
    if i is None:
        raise ValueError(f"the run ends at {times[-1]:g} s")
    if i == 0:
        return 1e3 * values[0]
    share = (time - times[i - 1]) / (times[i] - times[i - 1])
    return 1e3 * (values[i - 1] + share * (values[i] - values[i - 1]))


def peak_x(run):
    return highest(run, "displacement_x")[0]


def peak_y(run):
    return highest(run, "displacement_y")[0]


def peak_time(run):
    return highest(run, "displacement_x")[1]


def x40(run):
    return at(run, "displacement_x", 0.04)


def x80(run):
    return at(run, "displacement_x", 0.08)


def x119(run):
    return at(run, "displacement_x", 0.119)


def x161(run):
    return at(run, "displacement_x", 0.161)


def x200(run):
    return at(run, "displacement_x", 0.2)


def x240(run):
    return at(run, "displacement_x", 0.24)


def x281(run):
    return at(run, "displacement_x", 0.281)


def x321(run):
    return at(run, "displacement_x", 0.321)


def x360(run):
    return at(run, "displacement_x", 0.36)


def y40(run):
    return at(run, "displacement_y", 0.04)


def y79(run):
    return at(run, "displacement_y", 0.079)


def y119(run):
    return at(run, "displacement_y", 0.119)


def y160(run):
    return at(run, "displacement_y", 0.16)


def y200(run):
    return at(run, "displacement_y", 0.2)


def y241(run):
    return at(run, "displacement_y", 0.241)


def y281(run):
    return at(run, "displacement_y", 0.281)


def y321(run):
    return at(run, "displacement_y", 0.321)
