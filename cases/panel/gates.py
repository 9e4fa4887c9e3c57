"""The runs of the panel's validation, and what is read from them."""
import cmath
import math

STATIC = (4, 6, 8, 12, 16)
VIBRATION = (4, 6, 8)
OTHERS = {
    "weakControl": ["zeroEnergy=1"],
    "longHorizon": ["horizon=3.015"],
    "bond": ["formulation=bond"],
    "bondLongHorizon": ["formulation=bond", "horizon=3.015"],
}

RUNS = {
    **{f"static{n}": ["variant=static", f"N={n}"] for n in STATIC},
    **{f"{name}{n}": ["variant=static", f"N={n}", *arguments]
       for name, arguments in OTHERS.items() for n in (8, 16)},
    **{f"vibration{n}": ["variant=vibration", f"N={n}"] for n in VIBRATION},
    "step6": ["variant=step", "N=6"],
}

BEAM_FREQUENCY = 342.1  # Hz
BEAM_TIP = 4.261  # mm
SECOND_MODE = 6.2669  # its frequency over the first one's, of a slender cantilever


def solve(matrix, right):
    """Gauss's elimination."""
    n = len(right)
    rows = [[*row, value] for row, value in zip(matrix, right)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(i + 1, n):
            factor = rows[k][i] / rows[i][i]
            rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][k] * x[k] for k in range(i + 1, n))) / rows[i][i]
    return x


def misfit(times, values, f):
    """Squares left by a mean and two modes, the first with frequency f; and that mean."""
    modes = []
    for t in times:
        first, second = (cmath.exp(2j * math.pi * f * r * t) for r in (1, SECOND_MODE))
        modes.append([1.0, first.real, first.imag, second.real, second.imag])
    matrix = [[sum(row[i] * row[k] for row in modes) for k in range(5)] for i in range(5)]
    right = [sum(row[i] * u for row, u in zip(modes, values)) for i in range(5)]
    x = solve(matrix, right)
    return sum((u - sum(a * b for a, b in zip(row, x))) ** 2
               for row, u in zip(modes, values)), x[0]


def fitted(run):
    """First frequency [Hz] by least squares, golden section, and the mean [mm]."""
    tip = run.table("tip")
    every = max(1, len(tip["Time"]) // 300)
    times, values = tip["Time"][::every], [1e3 * u for u in tip["displacement_x"][::every]]
    low, high, share = 250.0, 420.0, (math.sqrt(5) - 1) / 2
    while high - low > 1e-3:
        a, b = high - share * (high - low), low + share * (high - low)
        if misfit(times, values, a)[0] < misfit(times, values, b)[0]:
            high = b
        else:
            low = a
    return low, misfit(times, values, low)[1]


def frequency(run):
    return fitted(run)[0]


def mean_displacement(run):
    """Of the vibration under 1 kPa, as for 100 kPa [mm]."""
    return 100 * fitted(run)[1]


def tip_displacement(run):
    return 1e3 * run.table("tip")["displacement_x"][-1]


def peak(run):
    return 1e3 * max(run.table("tip")["displacement_x"])


def peak_over_static(step, static):
    return peak(step) / tip_displacement(static)


def tip_error_ratio(fine, coarse):
    """Error of the fine run over that of the coarse one."""
    return (tip_displacement(fine) - BEAM_TIP) / (tip_displacement(coarse) - BEAM_TIP)


def frequency_error_ratio(fine, coarse):
    return (frequency(fine) - BEAM_FREQUENCY) / (frequency(coarse) - BEAM_FREQUENCY)
