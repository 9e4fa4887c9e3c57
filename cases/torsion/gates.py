"""The runs of the torsion's validation, and what is read from them."""

import math

REFINEMENTS = (4, 6, 8, 12, 16)
IN_FLOW = (4, 6, 8, 12)
CONTROLS = {"weakControl": 1, "strongControl": 4}

RUNS = {
    **{f"compressible{n}": [f"N={n}"] for n in REFINEMENTS},
    **{f"incompressible{n}": [f"N={n}", "nuStab=0.49"] for n in REFINEMENTS},
    **{f"{name}{n}": [f"N={n}", f"zeroEnergy={value}"]
       for name, value in CONTROLS.items() for n in (8, 12)},
    "longHorizon12": ["N=12", "horizon=3.015"],
    **{f"flow{n}": ["variant=flow", f"N={n}"] for n in IN_FLOW},
    "flowSlow6": ["variant=flow", "N=6", "ramp=0.5", "endTime=2", "damping=200"],
}

COMPRESSIBLE, NEARLY, INCOMPRESSIBLE = 0.265, 0.277, 0.279  # as reference.csv [cm]


def last(run, table, column="displacement_x"):
    return run.table(table)[column][-1]


def centre(run):
    """Axial displacement of the turned end's centre [cm]."""
    return last(run, "centre")


def average(run):
    """Its mean over the turned end, by Gauss's rule of 3 x 3 points and symmetry [cm]."""
    return (64 * centre(run) + 160 * last(run, "side") + 100 * last(run, "corner")) / 324


def error_ratio(fine, coarse, reference=COMPRESSIBLE):
    """Error of the fine run over that of the coarse one."""
    return (centre(fine) - reference) / (centre(coarse) - reference)


def error_ratio_nearly(fine, coarse):
    return error_ratio(fine, coarse, NEARLY)


def error_ratio_incompressible(fine, coarse):
    return error_ratio(fine, coarse, INCOMPRESSIBLE)


def volume_change(run):
    """Mean over the points [%]."""
    return 100 * last(run, "beam", "mean(J-1)")


def centre_ratio(slow, quick):
    """Of two ways to the same static answer."""
    return centre(slow) / centre(quick)


def volume_percent(run):
    """Size of the mean volume change [%]."""
    return abs(volume_change(run))


def turn_error(run):
    """How far the probe `corner` of the end, (3, a, a) with a = sqrt(0.15), is from
    where 5/4 of a turn takes it across the beam [cm]."""
    a = 0.15**0.5
    return math.hypot(last(run, "corner", "displacement_y") + 2 * a,
                      last(run, "corner", "displacement_z"))
