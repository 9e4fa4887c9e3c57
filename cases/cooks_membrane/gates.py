"""The runs of Cook's membrane's validation, and what is read from them."""

import re

REFINEMENTS = (12, 24, 48, 96)
FITTED, STAIRS = (12, 24, 48), (11, 22, 44, 88)  # in a flow
UP, ALONG = 0.670, -0.561  # incompressible, as reference.csv [cm]

RUNS = {
    **{f"N{n}": [f"N={n}"] for n in REFINEMENTS},
    "weakControl48": ["N=48", "zeroEnergy=0.1"],
    "strongControl48": ["N=48", "zeroEnergy=4"],
    "shortHorizon48": ["N=48", "horizon=2.015"],
    "stiff24": ["N=24", "nuStab=0.4999"],
    "soft48": ["N=48", "nuStab=0"],
    **{f"flow{n}": ["variant=flow", f"N={n}"] for n in FITTED},
    **{f"stairs{n}": ["variant=flow", f"N={n}", "shape=stairs"] for n in STAIRS},
    "flowSlow12": ["variant=flow", "N=12", "ramp=10", "endTime=80",
                   "damping=4.16667"],
    "flowStiff12": ["variant=flow", "N=12", "nuStab=0.49995"],
}


def up(run):
    return run.table("corner")["displacement_y"][-1]


def along(run):
    return run.table("corner")["displacement_x"][-1]


def volume_change(run):
    return run.table("membrane")["mean(J-1)"][-1]


def volume_percent(run):
    """Size of the mean volume change [%]."""
    return 100 * abs(volume_change(run))


def up_ratio(slow, quick):
    """Of two ways to the same static answer."""
    return up(slow) / up(quick)


def error(run):
    """Distance of the corner from where the incompressible one is [cm]."""
    return ((up(run) - UP) ** 2 + (along(run) - ALONG) ** 2) ** 0.5


def error_ratio(a, b):
    """Error of one run over that of another."""
    return error(a) / error(b)


def points(run):
    """That move."""
    return int(re.search(r"(\d+) of them move", run.log)[1])


def points_ratio(a, b):
    return points(a) / points(b)
