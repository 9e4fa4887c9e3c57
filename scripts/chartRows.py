"""The rows of cases/chart.csv: what scripts/chart writes and scripts/advise reads."""
import csv
import os
import pathlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
CSV = ROOT / "cases" / "chart.csv"

# One row for each quantity of a run. Errors are in percent of the reference where that is not
# 0, else in the quantity's unit. Seconds: of processor, all that Allrun began; wall time of the
# solver without meshing. known_to: what the reference itself may be wrong by; errors below it
# are alike. Shares are of the wall time, changes of volume at the end, in percent.
FIELDS = ["case", "arguments", "quantity", "unit", "value", "reference", "error", "error_unit",
          "absolute_error", "known_to", "core_seconds", "wall_seconds", "ranks", "steps",
          "volume_change", "flow", "solid", "transfer", "output", "status", "case_state",
          "library", "parameters"]
NUMBERS = ["value", "reference", "error", "absolute_error", "known_to", "core_seconds",
           "wall_seconds", "ranks", "steps", "volume_change", "flow", "solid", "transfer",
           "output"]


def read(path=CSV):
    """Rows with numbers as floats, None where there is none."""
    if not path.is_file():
        return []
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for name in NUMBERS:
            row[name] = float(row[name]) if row.get(name) else None
    return rows


def written(value):
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else value


def write(rows, path=CSV):
    """All at once: an interruption leaves the old file."""
    fresh = path.with_suffix(".new")
    with open(fresh, "w", newline="") as file:
        table = csv.DictWriter(file, FIELDS, lineterminator="\n")
        table.writeheader()
        table.writerows({name: written(row.get(name)) for name in FIELDS} for row in rows)
    os.replace(fresh, path)


def keys(row):
    """The arguments as {key: value}."""
    return dict(word.split("=", 1) for word in row["arguments"].split())


def is_good(row):
    return row["status"] == "ok" and row["absolute_error"] is not None


def sure_error(row):
    """Size of the error, or what the reference is known to if that is more."""
    return max(row["absolute_error"], row["known_to"] or 0)


def front(rows):
    """The good rows that no other beats in both cost and error, cheapest first."""
    best, kept = float("inf"), []
    for row in sorted(filter(is_good, rows), key=lambda r: (r["core_seconds"], sure_error(r))):
        if sure_error(row) < best:
            best = sure_error(row)
            kept.append(row)
    return kept


def refinements(rows):
    """{(case, quantity, keys but N): [(N, row)]}, the good rows that have an N, by N."""
    found = {}
    for row in filter(is_good, rows):
        given = keys(row)
        if "N" in given:
            same = " ".join(sorted(f"{k}={v}" for k, v in given.items() if k != "N"))
            found.setdefault((row["case"], row["quantity"], same), []).append(
                (int(given["N"]), row))
    return {key: sorted(pairs, key=lambda pair: pair[0]) for key, pairs in found.items()}
