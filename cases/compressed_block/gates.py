"""The runs of the compressed block's validation, and what is read from them."""

SPACINGS = (20, 40, 80)
IN_FLOW = (8, 16, 32)  # Kim's M = 16, 32, 64

RUNS = {
    **{f"points{n}": [f"N={n}"] for n in SPACINGS},
    **{f"cells{n}": [f"N={n}", "beyond=0"] for n in SPACINGS},
    "soft40": ["N=40", "nuStab=0"],
    "stiff20": ["N=20", "nuStab=0.4999"],
    "stiff40": ["N=40", "nuStab=0.4999"],
    "weakControl40": ["N=40", "zeroEnergy=0.1"],
    "shortHorizon40": ["N=40", "horizon=2.015"],
    **{f"flow{n}": ["variant=flow", f"N={n}"] for n in IN_FLOW},
    "flowSlow16": ["variant=flow", "N=16", "ramp=20", "endTime=80", "damping=2"],
    **{f"flowStiff{n}": ["variant=flow", f"N={n}", "nuStab=0.49995"] for n in IN_FLOW},
}


def top(run):
    return run.table("topMiddle")["displacement_y"][-1]


def bottom(run):
    """Size of u_x in the middle of the bottom, which the case does not hold."""
    return abs(run.table("bottomMiddle")["displacement_x"][-1])


def extrapolated(middle, fine):
    """Top of halved spacings, without an error proportional to the spacing."""
    return 2 * top(fine) - top(middle)


def order(coarse, middle, fine):
    """Ratio of the differences between successive refinements: 2 is first order."""
    return (top(middle) - top(coarse)) / (top(fine) - top(middle))


def volume_change(run):
    return run.table("block")["mean(J-1)"][-1]


def extrapolated_volume_change(middle, fine):
    return 2 * volume_change(fine) - volume_change(middle)


def volume_percent(run):
    """Size of the mean volume change [%]."""
    return 100 * abs(volume_change(run))


def top_ratio(slow, quick):
    """Of two ways to the same static answer."""
    return top(slow) / top(quick)


def flow_error_ratio(fine, coarse):
    """Error of the fine run over that of the coarse one, incompressible."""
    return (top(fine) + 3.921) / (top(coarse) + 3.921)


def drift(run):
    """How far the bottom, held along y, is from its place [cm]."""
    return abs(run.table("bottom")["displacement_y"][-1])
