"""The runs of the slab in a shock tube, and what is read from them.

The exact velocity of a free slab. The shock (state 1 behind it) is reflected at t = 0 as from a
wall: the gas before the slab is at rest with p2, c2. The slab gives way with the velocity V(t) and
sends a simple wave back. Along the characteristics that come from the reflected shock
u + 2c/(g-1) is that behind it; as long as that is 2c2/(g-1), the gas at the slab has

    p_front = p2 (1 - (g-1)/2 V/c2)^(2g/(g-1)),

and behind the slab, where all characteristics come from the gas at rest,

    p_rear = p0 (1 + (g-1)/2 V/c0)^(2g/(g-1)),

so that m dV/dt = p_front - p_rear with the mass m of an area. What is left out: the wave overtakes
the reflected shock and weakens it, which changes u + 2c/(g-1) at third order in the change of
strength; and compression waves behind the slab steepen to a shock, of the same order. With the
pressure of a shock of the strength that V has made of it, front and rear, which errs to the other
side, V differs by at most 0.07 m/s in the first millisecond: `bound` below, a gate of its own."""
import math

G = 1.4
P0, RHO0, P1 = 101e3, 1.2, 155.7e3
THICKNESS = 0.01  # of the free slab
START = 0.05  # of the shock before it
MASS = 1.0  # kg/m2

FREE = ["variant=free"]
SONIC = ["solver=sonicFoam"]
IMMERSED = ["coupling=immersed", "pointsPerCell=2"]

RUNS = {
    "wall": [],
    "wallSonic": SONIC,
    "wallImmersed": IMMERSED,
    "wallSonicImmersed": SONIC + IMMERSED,
    "leak": ["variant=leak"],
    "leakSonic": ["variant=leak", *SONIC],
    "leakImmersed": ["variant=leak", *IMMERSED],
    "free5": [*FREE, "N=5"],
    "free": FREE,
    "free20": [*FREE, "N=20"],
    "freeSonic": FREE + SONIC,
    "freeImmersed": [*FREE, *IMMERSED, "stepRatio=0.5"],
}


def rows(path):
    """Numbers of a table, line by line."""
    return [[float(word) for word in line.split()]
            for line in path.read_text().splitlines() if line.strip() and line[0] != "#"]


def shocked(p, rho, behind):
    """Density behind a shock into p, rho, and the jump of velocity."""
    ratio = behind / p
    density = rho * ((G + 1) * ratio + G - 1) / ((G - 1) * ratio + G + 1)
    return density, (behind - p) * math.sqrt(2 / (rho * ((G + 1) * behind + (G - 1) * p)))


RHO1, U1 = shocked(P0, RHO0, P1)
SPEED = RHO1 * U1 / (RHO1 - RHO0)
P2 = P1 * ((3 * G - 1) * P1 - (G - 1) * P0) / ((G - 1) * P1 + (G + 1) * P0)
RHO2, _ = shocked(P1, RHO1, P2)


def behind_shock(p, rho, jump):
    """Pressure behind a shock into p, rho that changes the velocity by a jump."""
    b = 0.5 * (G + 1) * rho * jump * abs(jump)
    scale = (G - 1) / (G + 1) * p + p
    return p + 0.5 * (b + math.copysign(math.sqrt(b * b + 4 * abs(b) * scale), b))


def simple_waves(v):
    """Pressure before the slab less that behind it."""
    half = (G - 1) / 2
    power = 2 * G / (G - 1)
    return (P2 * (1 - half * v / math.sqrt(G * P2 / RHO2)) ** power
            - P0 * (1 + half * v / math.sqrt(G * P0 / RHO0)) ** power)


def two_shocks(v):
    return behind_shock(P1, RHO1, U1 - v) - behind_shock(P0, RHO0, v)


def velocities(load, end, steps=2000):
    """(t, V) by Runge and Kutta."""
    h, v, found = end / steps, 0.0, [(0.0, 0.0)]
    for k in range(steps):
        a = load(v) / MASS
        b = load(v + h / 2 * a) / MASS
        c = load(v + h / 2 * b) / MASS
        d = load(v + h * c) / MASS
        v += h / 6 * (a + 2 * b + 2 * c + d)
        found.append(((k + 1) * h, v))
    return found


def interpolate(table, t):
    if t <= table[0][0]:
        return table[0][1]
    h = table[1][0] - table[0][0]
    k = min(int(t / h), len(table) - 2)
    (s, a), (_, b) = table[k], table[k + 1]
    return a + (b - a) * (t - s) / h


def bound(run):
    """Largest difference between two answers, over the last velocity [%]."""
    end = run.table("force_slab")["Time"][-1] - START / SPEED
    one, other = velocities(simple_waves, end), velocities(two_shocks, end)
    return 100 * max(abs(a - b) for (_, a), (_, b) in zip(one, other)) / one[-1][1]


def velocity_errors(run):
    """(t, V, V - exact) of the centre of mass, from its places ten rows apart."""
    table = run.table("force_slab")
    times, places = table["Time"], table["centre_x"]
    exact = velocities(simple_waves, times[-1] - START / SPEED)
    found = []
    for k in range(len(times) - 10):
        t = (times[k] + times[k + 10]) / 2 - START / SPEED
        v = (places[k + 10] - places[k]) / (times[k + 10] - times[k])
        found.append((t, v, v - interpolate(exact, t)))
    return found


def velocity_error(run):
    """Largest, over the last velocity [%]."""
    found = velocity_errors(run)
    return 100 * max(abs(e) for _, _, e in found) / found[-1][1]


def last_velocity_error(run):
    _, v, e = velocity_errors(run)[-1]
    return 100 * e / (v - e)


def error_ratio(fine, coarse):
    return velocity_error(fine) / velocity_error(coarse)


def late(table, columns):
    """Mean of columns over the last 0.1 ms."""
    chosen = [row for row in table if row[0] > table[-1][0] - 1e-4]
    return sum(sum(row[k] for k in columns) for row in chosen) / len(chosen) / len(columns)


def reflected(run):
    """Pressure before the slab [kPa]."""
    return 1e-3 * late(rows(run.folder / "postProcessing/before/0/p"), (1, 2))


def pressure_of_force(run):
    """Force on the slab over its area, and the pressure behind it [kPa]."""
    force = rows(next(run.folder.glob("postProcessing/solid/0/force_slab.dat")))
    high = THICKNESS / 10
    return 1e-3 * (late(force, (1,)) / high**2 + P0)


def leaked(run):
    """Largest change of pressure behind the panel over the jump of the shock [%]."""
    most = 0
    for name in ("behindMax", "behindMin"):
        path = run.folder / f"postProcessing/{name}/0/volFieldValue.dat"
        most = max(most, max(abs(row[1] - P0) for row in rows(path)))
    return 100 * most / (P1 - P0)
