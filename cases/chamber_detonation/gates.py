"""The runs of the chamber, and what is read from them."""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from flowFields import points
from writtenFields import write_times

RUNS = {
    "printed40": ["N=40", "frames=1"],
    "strong40": ["N=40", "charge=1000", "frames=1"],
    **{f"apart{n}": [f"N={n}", "charge=1000", "coupling=partitioned", "frames=1"]
       for n in (40, 60, 80, 120)},
    "twoPoints60": ["N=60", "charge=1000", "coupling=partitioned", "frames=1", "pointsPerCell=2"],
    "onePoint60": ["N=60", "charge=1000", "coupling=partitioned", "frames=1", "pointsPerCell=1"],
    "yield40": ["N=40", "charge=50000", "coupling=partitioned", "duration=500", "frames=5"],
    "points40": ["N=40", "charge=50000", "coupling=partitioned", "duration=500", "frames=5",
                 "formulation=correspondence"],
}
DEPTH = 0.0035  # m


def rows(run, function, name):
    """Of a table of OpenFOAM's own function objects."""
    path = next(run.folder.glob(f"postProcessing/{function}/0/{name}"))
    return [[float(word) for word in line.split()] for line in path.read_text().splitlines()
            if not line.startswith("#")]


def mass_drift(run):
    """Of the gas, largest over the run [%]."""
    mass = [row[1] for row in rows(run, "mass", "volFieldValue.dat")]
    return max(abs(100 * (m / mass[0] - 1)) for m in mass)


def energy_drift(run):
    """Of the gas and the bar's motion and strain, largest over the run [%]. Energy that
    plastic flow turned into heat of the bar is not in any table."""
    gas = {row[0]: row[1] + row[2] for row in rows(run, "energy", "volFieldValue.dat")}
    times = sorted(gas)
    first, worst, k = gas[times[0]], 0.0, 0
    block = run.table("block")
    for t, kinetic, strain in zip(block["Time"], block["kineticEnergy"], block["strainEnergy"]):
        while k + 1 < len(times) and times[k] < t * (1 - 1e-9):
            k += 1
        total = gas[times[k]] + DEPTH * (kinetic + strain)
        if abs(total - first) > abs(worst):
            worst = total - first
    return 100 * worst / first


def pressure(run, place):
    """Largest at P1 or P2, without the charge itself [MPa]."""
    return max(row[place] for row in rows(run, "pressure", "p") if row[0] > 1e-5) / 1e6


def right_wall(run):
    return pressure(run, 2)


def arrival(run):
    """When p at P2 is beyond 0.15 MPa first [ms]."""
    return 1e3 * next(row[0] for row in rows(run, "pressure", "p") if row[2] > 1.5e5)


def displacement(run):
    """Of the centre of mass, at the end [mm]."""
    x = run.table("force_block")["centre_x"]
    return 1e3 * (x[-1] - 0.2)


def displacement_um(run):
    return 1e3 * displacement(run)


def impulse(run):
    """Largest of the fluid on the bar along x [N s]."""
    return max(run.table("force_block")["impulse_x"])


def displacement_ratio(fine, coarse):
    return displacement(fine) / displacement(coarse)


def solid_share(run):
    """Of solid and transfer, of the wall time [%]."""
    return 100 * (run.parts["solid"] + run.parts["transfer"]) / run.core_seconds


def kinetic_peak(run):
    """Of the bar [J]."""
    return DEPTH * max(run.table("block")["kineticEnergy"])


def mises(run):
    """Largest in the middle of the left face [MPa]."""
    t = run.table("left")
    xx, xy, yy, zz = (t[f"sigma_{c}"] for c in ("xx", "xy", "yy", "zz"))
    return 1e-6 * max(math.sqrt(((a - b)**2 + (b - c)**2 + (c - a)**2) / 2 + 3 * d * d)
                      for a, b, c, d in zip(xx, yy, zz, xy))


def plastic(run):
    """Largest in the middle of the left face."""
    return max(run.table("left")["plasticStrain"])


def wider(run):
    """Growth of the bar's left face at the end: mushrooming [mm]."""
    now, rest = shape(run)
    left = min(x for x, _ in rest)
    face = [k for k, (x, _) in enumerate(rest) if x < left + 1e-6]
    return 1e3 * (span(now, face) - span(rest, face))


def span(places, which):
    y = [places[k][1] for k in which]
    return max(y) - min(y)


def shape(run):
    """Places at the last write time and at rest."""
    rest, now = points(list(write_times(run.folder).values())[-1], "block")
    return [p[:2] for p in now], [p[:2] for p in rest]


def roughness(run):
    """Second differences of the displacement along rows and columns at the end, root mean
    square over the spacing: what motions without energy leave. Near 0 for a smooth field."""
    now, rest = shape(run)
    xs, ys = (sorted({round(p[i], 7) for p in rest}) for i in (0, 1))
    column = {x: i for i, x in enumerate(xs)}
    line = {y: i for i, y in enumerate(ys)}
    u = {(column[round(x, 7)], line[round(y, 7)]): (a - x, b - y)
         for (x, y), (a, b) in zip(rest, now)}
    total = n = 0
    for (i, j), here in u.items():
        for di, dj in ((1, 0), (0, 1)):
            before, after = u.get((i - di, j - dj)), u.get((i + di, j + dj))
            if before and after:
                total += sum((b - 2*h + a)**2 for b, h, a in zip(before, here, after))
                n += 1
    return math.sqrt(total / n) / (xs[1] - xs[0])


def roughness_ratio(one, other):
    return roughness(one) / roughness(other)
