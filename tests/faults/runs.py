"""Runs that are interrupted and resumed: their cases, what they end with, how that is compared."""

import pathlib
import shutil

import harness

# Small cases that break. Both write often, so that many of the kills fall into a write, and after
# a number of steps: intervals of time begin anew where a run goes on.
CASES = {
    "band": dict(
        case="cases/elastic_band",
        application="pimpleFoam",
        keys="N=8 variant=notch pressureDifference=60 endTime=0.24 frames=1",
        meshes=["blockMesh", "blockMesh -region band"],
        overrides="fluidCellsX 80; fluidCellsY 40; bandCellsY 64;",
        interval=5,
    ),
    "plate": dict(
        case="cases/precracked_plate",
        application="periSolidFoam",
        keys="N=100 variant=growth frames=1",
        meshes=["blockMesh -region plate"],
        overrides="quarter 25; half 50;",
        interval=5,
    ),
}

# The solver's sum of its continuity errors, which OpenFOAM only prints: kept as text of ten digits.
PASSING = {"cumulativeContErr"}


def make(name, folder, ranks, more=""):
    """Makes a case that goes on from its latest time, decomposed if on several ranks."""
    about = CASES[name]
    harness.shell(
        f"""
        set -e
        source "{harness.ROOT}/scripts/caseFunctions"
        start_case "{harness.ROOT}/{about['case']}" run="{folder}" ranks={ranks} {about['keys']}
        echo '{about['overrides']}' >>system/overrides
        {"".join(f"run_tool {tool};" for tool in about['meshes'])}
        printf '%s\\n' 'startFrom latestTime; writeControl timeStep;' \\
            'writeInterval {about['interval']};' '{more}' >>system/controlDict
        ((ranks == 1)) || decompose
        """
    )
    return folder


def command(name, ranks):
    return harness.on_ranks(ranks, [CASES[name]["application"]])


def start(name, folder, ranks):
    return harness.Run(command(name, ranks), folder)


def resume(folder):
    """Sets incomplete times aside; why it failed, or nothing."""
    status, text = harness.shell("periResume", cwd=folder, check=False)
    return f"periResume: exit status {status}: {text[-300:]}" if status else ""


def homes(folder):
    """Where times are: the case, or the folders of its ranks."""
    ranks = sorted(pathlib.Path(folder).glob("processor[0-9]*"))
    return ranks or [pathlib.Path(folder)]


def is_time(path):
    try:
        float(path.name)
    except ValueError:
        return False
    return path.is_dir()


def times(folder):
    """Times that are there, of the first rank, in order."""
    return sorted((t for t in homes(folder)[0].iterdir() if is_time(t)), key=lambda t: float(t.name))


def last(folder):
    return times(folder)[-1].name


def difference(folder, reference):
    """Why the last time of a run is not that of the undisturbed one; nothing: it is."""
    if last(folder) != last(reference):
        return f"the last time is {last(folder)} in place of {last(reference)}"
    time = last(reference)
    for mine, its in zip(homes(folder), homes(reference)):
        left = {f.relative_to(mine / time) for f in (mine / time).rglob("*") if f.is_file()}
        right = {f.relative_to(its / time) for f in (its / time).rglob("*") if f.is_file()}
        if left != right:
            return f"{time} has other files: {sorted(map(str, left ^ right))[:4]}"
        for file in sorted(right):
            if file.name not in PASSING and (mine / time / file).read_bytes() != (
                its / time / file
            ).read_bytes():
                return f"{mine.name}/{time}/{file} differs"
    return ""


def went_wrong(run, status):
    """Why a run that should have ended well did not; nothing: it did."""
    log = run.text()
    crash = harness.CRASH.search(log)
    if status is None:
        quiet = run.log.stat().st_mtime
        return f"killed after {run.seconds:.0f} s, {run.ended - quiet:.0f} s after its log last grew"
    if status or crash:
        return f"exit status {status}: {' '.join((harness.error_of(log) or log[-300:]).split())[:400]}"
    return ""


def copy(folder, new):
    shutil.copytree(folder, new, symlinks=True)
    return new
