"""The runs of Cook's membrane's validation, and what is read from them."""

REFINEMENTS = (12, 24, 48, 96)

RUNS = {
    **{f"N{n}": [f"N={n}"] for n in REFINEMENTS},
    "weakControl48": ["N=48", "zeroEnergy=0.1"],
    "strongControl48": ["N=48", "zeroEnergy=4"],
    "shortHorizon48": ["N=48", "horizon=2.015"],
    "stiff24": ["N=24", "nuStab=0.4999"],
    "soft48": ["N=48", "nuStab=0"],
}


def up(run):
    return run.table("corner")["displacement_y"][-1]


def along(run):
    return run.table("corner")["displacement_x"][-1]


def volume_change(run):
    return run.table("membrane")["mean(J-1)"][-1]
