"""The runs of the torsion's validation, and what is read from them."""

RUNS = {
    **{f"compressible{n}": [f"N={n}"] for n in (4, 6, 8, 12)},
    **{f"incompressible{n}": [f"N={n}", "nuStab=0.49"] for n in (4, 6, 8, 12)},
}

CENTRE = {"compressible": 0.265, "incompressible": 0.279}  # as reference.csv


def last(run, table, column="displacement_x"):
    return run.table(table)[column][-1]


def centre(run):
    """Axial displacement of the turned end's centre [cm]."""
    return last(run, "centre")


def average(run):
    """Its mean over the turned end, by Gauss's rule of 3 x 3 points and symmetry [cm]."""
    return (64 * centre(run) + 160 * last(run, "side") + 100 * last(run, "corner")) / 324


def error_ratio(fine, coarse):
    """Error of the fine run over that of the coarse one."""
    reference = CENTRE[fine.folder.name.rstrip("0123456789")]
    return (centre(fine) - reference) / (centre(coarse) - reference)


def volume_change(run):
    """Mean over the points [%]."""
    return 100 * last(run, "beam", "mean(J-1)")


def smallest_J(run):
    return last(run, "beam", "min(J)")


def largest_J(run):
    return last(run, "beam", "max(J)")
