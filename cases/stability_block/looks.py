"""What scripts/stability reads from runs of this case, apart from whether they end well."""
import math
import re


def vectors(path):
    """An ascii field of vectors."""
    text = path.read_text()
    start = re.search(r"^\s*\d+\s*\n\(", text, re.M).end()
    return [tuple(map(float, row.split())) for row in
            re.findall(r"\(([^()]+)\)", text[start:])]


def last_time(run):
    return max((p for p in run.folder.iterdir() if re.fullmatch(r"[0-9.e-]+", p.name)
                and (p / "lagrangian").is_dir()), key=lambda p: float(p.name))


def displacement(run):
    return vectors(last_time(run) / "lagrangian" / "block" / "displacement")


def counts(run):
    text = (run.folder / "system" / "overrides").read_text()
    return [int(re.search(rf"{key} (\d+);", text)[1]) for key in ("pointsX", "pointsY")]


def squares(values):
    return sum(x * x + y * y for x, y, _ in values)


def checkerboard(run):
    """Displacement that alternates from point to point over all displacement [%]: the share
    that the filter (1, -2, 1)/4 along both axes lets through, inside the body."""
    u = displacement(run)
    nx, ny = counts(run)
    filtered = []
    for j in range(1, ny - 1):
        for i in range(1, nx - 1):
            filtered.append([sum((1, -2, 1)[a] * (1, -2, 1)[b] / 16 *
                                 u[(j + b - 1) * nx + i + a - 1][c]
                                 for a in range(3) for b in range(3)) for c in range(3)])
    return 100 * math.sqrt(squares(filtered) / len(filtered) / (squares(u) / len(u)))


def leak(run):
    """What came through the channel beyond what the body has swept, over that [%]."""
    flux = run.table("surfaceFieldValue")
    steps = [b - a for a, b in zip([0] + flux["Time"], flux["Time"])]
    depth = 0.1
    through = -sum(phi * dt for phi, dt in zip(flux["sum(phi)"], steps)) / depth
    u = displacement(run)
    swept = sum(x for x, _, _ in u) / len(u)  # over the height 1
    return 100 * (through - swept) / swept


def stretch(run):
    """Largest elongation of half the block [%]."""
    return 100 * max(run.table("rightFace")["displacement_x"]) / 0.25


def smallest_J(run):
    return min(run.table("block")["min(J)"])


def isolated(run):
    """Points that bear no stress any more."""
    return max(run.table("block")["singular"])


def volume_change(run):
    """Size of the mean of J - 1 at the end [%]."""
    return run.volume_change()
