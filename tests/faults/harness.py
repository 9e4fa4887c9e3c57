"""What the scripts of this folder share: environment, small cases, runs within limits."""

import atexit
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]

# What a process that met a signal leaves in OpenFOAM's log, or mpirun in its own.
CRASH = re.compile(
    r"sigFpe::sigHandler|sigSegv::sigHandler|error::printStack|Segmentation fault"
    r"|terminate called|MPI_ERR|exited on signal (?!(9|15) )"
)
NOT_FINITE = re.compile(r"(^|[\s(])[-+]?(nan|inf)([\s)]|$)", re.IGNORECASE | re.MULTILINE)

failed = 0

# Groups that are running; none outlives the script, however it ends.
groups = set()


def end_groups():
    for group in list(groups):
        try:
            os.killpg(group, signal.SIGKILL)
        except ProcessLookupError:
            pass


atexit.register(end_groups)
signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))


def passed(what):
    print("PASS", what, flush=True)


def fail(what, why):
    global failed
    failed += 1
    print(f"FAIL {what}: {why}", flush=True)


def environment():
    """That of .cache/env.sh, as a shell that sources it has it."""
    text = subprocess.run(
        ["bash", "-c", f'source "{ROOT}/.cache/env.sh" && env -0'],
        check=True,
        stdout=subprocess.PIPE,
    ).stdout
    pairs = (entry.partition(b"=") for entry in text.split(b"\0") if entry)
    env = {os.fsdecode(k): os.fsdecode(v) for k, _, v in pairs}
    # Ranks that wait leave their core to others: there may be fewer cores than ranks
    return dict(env, OMPI_MCA_mpi_yield_when_idle="1")


ENV = environment()


def scratch_folder():
    """A folder for the cases, in memory if there is room. KEEP=1 keeps it."""
    where = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    folder = pathlib.Path(tempfile.mkdtemp(prefix="faults.", dir=where))
    return folder


def leave(folder):
    if os.environ.get("KEEP"):
        print(folder, file=sys.stderr)
    else:
        shutil.rmtree(folder, ignore_errors=True)


def shell(commands, cwd=None, check=True):
    """Runs commands of bash with OpenFOAM's environment; their output and exit status."""
    done = subprocess.run(
        ["bash", "-c", commands],
        cwd=cwd,
        env=ENV,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    if check and done.returncode:
        sys.exit(f"{commands}\n{done.stdout.decode(errors='replace')}")
    return done.returncode, done.stdout.decode(errors="replace")


class Run:
    """A process group with its log, CPU time and wall time bounded."""

    def __init__(self, command, cwd, cpu=None, log="log"):
        def limits():
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            if cpu:
                resource.setrlimit(resource.RLIMIT_CPU, (cpu, cpu + 1))

        self.log = pathlib.Path(cwd, log)
        self.began = time.monotonic()
        with open(self.log, "wb") as out:
            self.process = subprocess.Popen(
                command,
                cwd=cwd,
                env=dict(ENV, PWD=str(cwd)),  # OpenFOAM warns of another
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=limits,
            )

        groups.add(self.process.pid)

    def wait(self, seconds):
        """The exit status; None: still running."""
        try:
            return self.process.wait(timeout=max(seconds, 0))
        except subprocess.TimeoutExpired:
            return None

    def kill(self, how=signal.SIGKILL):
        try:
            os.killpg(self.process.pid, how)
        except ProcessLookupError:
            pass

    def members(self):
        """Processes of the group that are still there."""
        out = subprocess.run(
            ["pgrep", "-s", str(self.process.pid)], stdout=subprocess.PIPE, text=True
        ).stdout
        return [int(pid) for pid in out.split()]

    def left(self):
        """How many processes stay when it has ended: mpirun's others end a moment later."""
        for _ in range(50):
            if not self.members():
                return 0
            time.sleep(0.1)
        return len(self.members())

    def end(self, seconds):
        """Waits, kills what is left after the limit; exit status or None."""
        status = self.wait(seconds)
        self.ended = time.time()
        self.kill()
        self.process.wait()
        groups.discard(self.process.pid)
        return status

    def text(self):
        return self.log.read_text(errors="replace")

    @property
    def seconds(self):
        return time.monotonic() - self.began


def on_ranks(ranks, command):
    """The command as it runs on some ranks."""
    if ranks == 1:
        return command
    return ["mpirun", "--oversubscribe", "-np", str(ranks), *command, "-parallel"]


def error_of(log):
    """The text of the first error that OpenFOAM ended by; empty: none."""
    found = re.search(r"--> FOAM FATAL (IO )?ERROR.*?(FOAM (parallel run )?(exiting|aborting)|\Z)", log, re.S)
    return found.group(0) if found else ""


def not_finite(case):
    """The first table or field with a number that is not finite."""
    for pattern in ("postProcessing/*/*/*.dat", "[0-9]*/lagrangian/*/*", "[0-9]*/*/*"):
        for file in pathlib.Path(case).glob(pattern):
            if file.is_file() and NOT_FINITE.search(file.read_text(errors="replace")):
                return file.relative_to(case)
    return None


def adapter_bases(scratch):
    """The cases of tests/adapter: a band in a flow, a plate without one."""
    adapter = ROOT / "tests/adapter"
    shell(
        f"""
        set -e
        root='{ROOT}' here='{adapter}' base='{scratch}/flow' solid='{scratch}/plate'
        source "$here/harness"
        from=$base make_base
        from=$solid make_solid_base
        """
    )
    return scratch / "flow", scratch / "plate"
