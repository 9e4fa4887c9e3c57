"""Runs of cases by their Allrun, kept and not repeated: what validate, chart and stability
share. Nothing here needs more than Python itself."""
import hashlib
import importlib.util
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(sys.argv[0]).name


def fail(message):
    sys.exit(f"{PROGRAM}: {message}")


def say(message):
    print(f"{PROGRAM}: {message}", flush=True)


# The library must exist before its state is taken.
def build():
    if subprocess.run(["make", "--no-print-directory", "-C", ROOT, "all"],
                      stdout=subprocess.DEVNULL).returncode:
        fail("periFoam could not be built")


def load(path):
    """A file of Python, wherever it is."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def load_gates(case):
    path = case / "gates.py"
    if not path.is_file():
        names = sorted(p.parent.name for p in ROOT.glob("cases/*/gates.py"))
        fail(f"no gates for '{case.name}'; allowed: {', '.join(names)}")
    return load(path)


# ---- what changes a run ----------------------------------------------------------------

def digest(files):
    return hashlib.sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


def case_state(case):
    """Changes with the case's own files."""
    files = [case / "Allrun"]
    for folder in ("0.orig", "constant", "system"):
        files += sorted(f for f in (case / folder).rglob("*") if f.is_file())
    return digest(files)


def library_state():
    """Changes with what was built."""
    return digest([ROOT / "lib" / "libperiFoam.so", ROOT / "bin" / "periSolidFoam"])


def source_state():
    """Changes with the sources, and is the same on all machines."""
    files = [f for folder in ("pd_solver/include", "pd_solver/src", "foam_adapter")
             for f in (ROOT / folder).rglob("*") if f.is_file()]
    return digest(sorted(files))[:8]


# ---- what a run left -------------------------------------------------------------------

def columns(path):
    """A postProcessing table as {column: [values]}; the last comment names the columns."""
    names, rows = [], []
    for line in path.read_text().splitlines():
        if line.startswith("#"):
            names = line[1:].split()
        elif line.strip():
            rows.append([float(word) for word in line.split()])
    return {name: [row[i] for row in rows] for i, name in enumerate(names)}


def application(folder):
    text = (folder / "system" / "controlDict").read_text()
    return re.search(r"^\s*application\s+(\w+)\s*;", text, re.M)[1]


class Run:
    """One finished run: its tables, its log and what it cost."""

    def __init__(self, folder):
        self.folder = folder
        record = json.loads((folder / "done").read_text())
        self.failed = record["status"] != 0
        self.message = record["message"]
        self.key = record["key"]
        self.cpu_seconds = record["cpu_seconds"]
        self.parts = {}
        self.steps = 0
        self.log = ""
        log = folder / f"log.{application(folder)}"
        if log.is_file():
            self.log = log.read_text(errors="replace")
        if self.started():
            cost = self.table("cost")
            apart = ("Time", "step", "deltaT", "stableStep")
            self.parts = {k: v[-1] for k, v in cost.items() if k not in apart and v}
            self.steps = int(max(cost["step"], default=0))
        self.core_seconds = sum(self.parts.values())  # of one rank, without meshing

    def started(self):
        return any(self.folder.glob("postProcessing/*/0/cost.dat"))

    def table(self, name):
        """By its name, whatever the function object is called."""
        return columns(next(self.folder.glob(f"postProcessing/*/0/{name}.dat")))

    def shares(self):
        """Parts of the wall time in percent."""
        whole = self.core_seconds or 1
        return {part: 100 * seconds / whole for part, seconds in self.parts.items()}

    def volume_change(self):
        """Largest size of the mean of J - 1 at the end among the bodies, in percent."""
        means = []
        for path in self.folder.glob("postProcessing/*/0/*.dat"):
            mean = columns(path).get("mean(J-1)")
            means += [100 * abs(mean[-1])] if mean else []
        return max(means, default=None)


def finished(folder, key):
    """The run of a folder if it ended, well or not, with the same key."""
    try:
        run = Run(folder)
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return run if run.key == key else None


def error_message(text):
    """The first error of OpenFOAM in a log or on stderr, in one line; else the last line."""
    found = re.search(r"--> FOAM FATAL (?:IO )?ERROR:?\s*\n(.*?)(?:\n\s*\n|\n\s*From |\nfile:|"
                      r"\nFOAM exiting|\Z)", text, re.S)
    if found:
        return " ".join(found[1].split())
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip() if lines else ""


CRASH = re.compile(r"^#\d+ .*(?:printStack|sigFpe|sigSegv)|Signal code:|Segmentation fault", re.M)


def is_crash(text):
    return bool(CRASH.search(text))


# ---- running ---------------------------------------------------------------------------

running = set()
interrupted = False


def interrupt(_signal, _frame):
    """Ends what runs, too: it is in process groups of its own, which Ctrl-C does not reach."""
    global interrupted
    interrupted = True
    for process in list(running):
        signal_group(process, signal.SIGTERM)
    sys.exit(f"{PROGRAM}: interrupted; the same command goes on")


for kind in (signal.SIGINT, signal.SIGTERM):
    signal.signal(kind, interrupt)


def signal_group(process, kind):
    try:
        os.killpg(process.pid, kind)
    except ProcessLookupError:
        pass


def wait(process, limit):
    """Exit status and processor time of a process and its children; None: out of time."""
    end = None if limit is None else time.monotonic() + limit
    pause = 0.01
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage.ru_utime + usage.ru_stime
        if end and time.monotonic() > end:
            return None, 0.0
        time.sleep(pause)
        pause = min(0.2, 1.5 * pause)


def stop(process):
    """Ends a script and all that it began."""
    signal_group(process, signal.SIGTERM)
    try:
        process.wait(timeout=10)
    except subprocess.TimeoutExpired:
        signal_group(process, signal.SIGKILL)
        process.wait()


def execute(case, folder, arguments, key, limit=None):
    """Allrun in a folder, unless that holds the same run. None: not done within the limit
    in seconds, and to be done again."""
    run = finished(folder, key)
    if run or interrupted:
        return run
    say(f"running {folder.name}: {' '.join(arguments)}")
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen([case / "Allrun", f"run={folder}", *arguments],
                                   stdout=subprocess.DEVNULL, stderr=errors,
                                   start_new_session=True)
        running.add(process)
        try:
            status, seconds = wait(process, limit)
        finally:
            if process.returncode is None:
                stop(process)
            running.discard(process)
        if status is None or interrupted:
            return None
        errors.seek(0)
        text = errors.read()
    if not (folder / "system" / "controlDict").is_file():
        fail(f"the run {folder.name} did not start: {text}")
    (folder / "done").write_text(json.dumps({
        "status": status, "cpu_seconds": round(seconds, 2), "key": key,
        "message": error_message(text) if status else "",
    }, indent=1) + "\n")
    return Run(folder)


def parameters(case, arguments):
    """All keys of a case and their values, after variants and these arguments."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["cp", "-r", case / "system", folder], check=True)
        overrides = [a.split("=", 1) for a in arguments if not a.startswith("ranks=")]
        path = pathlib.Path(folder, "system", "overrides")
        path.write_text("".join(f"{key} {value};\n" for key, value in overrides))
        command = '. "$0"; foamDictionary system/parameters'
        done = subprocess.run(["bash", "-c", command, ROOT / ".cache" / "env.sh"], cwd=folder,
                              capture_output=True, text=True)
        if done.returncode:
            fail(f"{case.name}, {' '.join(arguments)}: {error_message(done.stderr)}")
        return dict(re.findall(r"^(\w+)\s+([^{};]+);", done.stdout, re.M))
