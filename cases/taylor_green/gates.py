"""The runs of the disc in Taylor-Green vortices, and what is read from them: orders."""
import math
import re

STEPS = ("2e-2", "1e-2", "5e-3")
FINEST_STEP = "1.25e-3"
MESHES = (16, 32, 64)
SHORT = ["endTime=0.4", "frames=1"]

TIME = {**{f"step{i}": [f"deltaT={s}", *SHORT] for i, s in enumerate(STEPS)},
        "stepFinest": [f"deltaT={FINEST_STEP}", *SHORT]}
# The flux correction that OpenFOAM takes by itself
OWN = {f"own{i}": [f"deltaT={s}", "fluxCorrection=-1", *SHORT]
       for i, s in enumerate((*STEPS, FINEST_STEP))}
SPACE = {f"mesh{m}": [f"M={m}", f"deltaT={0.16 / m:g}", *SHORT] for m in MESHES}
FLUID = {f"fluid{m}": [f"M={m}", f"deltaT={0.16 / m:g}", "G=1e-9", *SHORT] for m in MESHES}

RUNS = {**TIME, **OWN, **SPACE, **FLUID}


def vectors(path):
    """An ascii field of vectors."""
    text = path.read_text()
    start = re.search(r"^\s*\d+\s*\n\(", text, re.M).end()
    return [tuple(map(float, row.split())) for row in
            re.findall(r"\(([^()]+)\)", text[start:].split("\n)", 1)[0])]


def last_time(run):
    return max((p for p in run.folder.iterdir() if re.fullmatch(r"[0-9.e-]+", p.name)
                and (p / "lagrangian").is_dir()), key=lambda p: float(p.name))


def difference(a, b):
    """Root of the mean square."""
    return math.sqrt(sum((x - y) ** 2 for u, v in zip(a, b) for x, y in zip(u, v)) / len(a))


def displacements(run):
    return vectors(last_time(run) / "lagrangian" / "disc" / "displacement")


def velocities(run):
    return vectors(last_time(run) / "U")


def probed(run):
    """Displacements of the probes at the end."""
    tables = [run.table(name) for name in ("middle", "right", "top")]
    return [tuple(t[f"displacement_{c}"][-1] for c in "xy") for t in tables]


def key(run, name, default):
    text = (run.folder / "system" / "overrides").read_text()
    found = re.search(rf"^{name} (\S+);", text, re.M)
    return float(found[1]) if found else default


def order(of):
    """From the differences of a coarse and a finer run from the finest; twice as fine."""
    def measure(coarse, finer, finest):
        return math.log2(difference(of(coarse), of(finest)) / difference(of(finer), of(finest)))
    return measure


points_order = order(displacements)
flow_order = order(velocities)


def probes_order(coarse, middle, fine):
    """From the differences of runs on meshes that are each twice as fine."""
    return math.log2(difference(probed(coarse), probed(middle)) /
                     difference(probed(middle), probed(fine)))


def volume_change(run):
    """Size of the mean of J - 1 at the end [%]."""
    return 100 * abs(run.table("disc")["mean(J-1)"][-1])


def decay_error(run):
    """Error of the velocity against the exact decay, in the mean square, over its size."""
    M = int(key(run, "M", 32))
    mu = key(run, "mu", 0.005)
    k = 2 * math.pi
    time = float(last_time(run).name)
    speed = 0.5 * math.exp(-2 * mu * k * k * time)
    exact = []
    for j in range(M):
        for i in range(M):
            x, y = k * (i + 0.5) / M, k * (j + 0.5) / M
            exact.append((speed * math.sin(x) * math.cos(y),
                          -speed * math.cos(x) * math.sin(y), 0.0))
    return difference(velocities(run), exact) / (speed / math.sqrt(2))


def decay_order(coarse, fine):
    return math.log2(decay_error(coarse) / decay_error(fine))
