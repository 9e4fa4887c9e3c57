"""The runs of the disc in the cavity, and what is read from them."""
import math

MESHES = (32, 64, 96)

RUNS = {f"disc{m}": [f"M={m}"] for m in MESHES}


def middle(run):
    probe = run.table("middle")
    return probe["displacement_x"][-1], probe["displacement_y"][-1]


def completed(run):
    return 0 if run.failed else 1


def volume_change(run):
    """Largest size of the mean of J - 1 [%]."""
    return 100 * max(map(abs, run.table("disc")["mean(J-1)"]))


def smallest_J(run):
    return min(run.table("disc")["min(J)"])


def distance_ratio(fine, coarse, finest):
    """Distance of the disc's middle at the end from that of the finest run: fine over coarse."""
    return math.dist(middle(fine), middle(finest)) / math.dist(middle(coarse), middle(finest))
