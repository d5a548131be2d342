"""Whether this computer has what the planner needs, and what to do where it has not."""

import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.errors import PlannerError
from planner.files import cache_folder
from planner.network.sumo import binary, sumo_environment
from planner.provenance import PACKAGES, versions

SUMO_RELEASE = "1.28"  # the programs and both libraries move together
ARROW_RELEASE = "23"  # libsumo is compiled against it
APT_LINE = "apt-get install --no-install-recommends libgl1 libx11-6 libxext6 libxrender1 libatomic1"
PIP_LINE = "python -m pip install --force-reinstall"
WAIT_S = 60.0  # a program that has not answered by then hangs


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    what: str
    fine: bool
    told: str  # what was found
    remedy: str = ""  # what to do, where it is not fine


def examine() -> list[Finding]:
    """Return what was found, in the order in which faults are best mended.

    Never raises: whatever goes wrong becomes a finding.
    """
    looks: list[Callable[[], Iterator[Finding]]] = [
        _python,
        _packages,
        _library,
        _programs,
        _cache,
        _compiler,
    ]
    return [finding for look in looks for finding in look()]


def _python() -> Iterator[Finding]:
    fine = sys.version_info >= (3, 11)
    told = f"{platform.python_version()} at {sys.executable}"
    yield Finding("Python", fine, told, "" if fine else "install Python 3.11 or later")


def _packages() -> Iterator[Finding]:
    releases = {
        "sumo": SUMO_RELEASE,
        "libsumo": SUMO_RELEASE,
        "sumolib": SUMO_RELEASE,
        "pyarrow": ARROW_RELEASE,
    }
    for name, found in versions().items():
        release = releases.get(name)
        fine = found is not None and (release is None or found.startswith(f"{release}."))
        wanted = PACKAGES[name] + (f"=={release}.*" if release else "")
        remedy = "python -m pip install . in its folder" if name == "planner" else ""
        remedy = "" if fine else remedy or f"{PIP_LINE} '{wanted}'"
        yield Finding(name, fine, found or "not installed", remedy)


def _library() -> Iterator[Finding]:
    """Load SUMO's library in a process of its own: a broken one may take the process with it."""
    code = "import libsumo; print(libsumo.simulation.getVersion()[1])"
    told, fine = _run([sys.executable, "-c", code], LIBSUMO_AS_TRACI="quiet")
    yield Finding("SUMO's library loads", fine, told, "" if fine else _remedy(told))


def _programs() -> Iterator[Finding]:
    for name in ("netconvert", "sumo"):
        try:
            sumo_environment()
            told, fine = _run([str(binary(name)), "--version"])
        except PlannerError as error:
            told, fine = str(error), False
        yield Finding(f"{name} runs", fine, told, "" if fine else _remedy(told))


def _run(command: list[str], **environment: str) -> tuple[str, bool]:
    """Return the telling line of a program's output, and whether it ended well."""
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=WAIT_S,
            env={**os.environ, **environment},
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {WAIT_S:.0f} s", False
    except OSError as error:
        return f"cannot be run: {error.strerror or error}", False
    if done.returncode == 0:
        return (done.stdout.strip().splitlines() or [""])[0], True
    said = (done.stderr.strip() or done.stdout.strip()).splitlines()
    return (said[-1] if said else f"ended with code {done.returncode}"), False


def _remedy(told: str) -> str:
    if "cannot open shared object file" in told:
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        return APT_LINE if root else f"sudo {APT_LINE}"
    release = f"{SUMO_RELEASE}.*"
    return f"{PIP_LINE} 'eclipse-sumo=={release}' 'libsumo=={release}' 'sumolib=={release}'"


def _cache() -> Iterator[Finding]:
    yield _writable("cache can be written", cache_folder(), "PLANNER_CACHE")


def _writable(what: str, folder: Path, variable: str) -> Finding:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            file.write(b"x" * 65536)
    except OSError as error:
        told = f"{folder}: {error.strerror or error}"
        remedy = f"set {variable} to a folder that you can write, on a disk with room"
        return Finding(what, False, told, remedy)
    return Finding(what, True, str(folder))


def _compiler() -> Iterator[Finding]:
    """Have the detection kernel answer a question whose answer is known."""
    what = "compiled code runs"
    try:
        seen_s = _see_a_target_at_rest()
    except Exception as error:
        told = " ".join(str(error).split()) or type(error).__name__
        yield Finding(what, False, told[:200], f"{PIP_LINE} numba llvmlite")
        return
    fine = abs(seen_s - 9.0) < 1e-9
    told = "detects as it should" if fine else f"sees at {seen_s} s what is to be seen at 9 s"
    yield Finding(what, fine, told, "" if fine else f"{PIP_LINE} numba llvmlite")
    folder = os.environ.get("NUMBA_CACHE_DIR", "")
    if folder:
        yield _writable("compiled code is kept", Path(folder), "NUMBA_CACHE_DIR")


def _see_a_target_at_rest() -> float:
    """Return when a UAV at 100 m/s comes within 100 m of a target 1 km ahead: 9 s."""
    from planner.detection.first_detection import first_detection
    from planner.flight.track import Track
    from planner.futures.futures import Futures

    zero, one = np.zeros(1), np.ones(1)
    edge, rests = np.zeros(1, np.int32), np.zeros(1, np.bool_)
    still = Futures(zero, 1000 * one, zero, edge, np.arange(2), one, rests)
    times = np.array([0.0, 20.0])
    flight = Track(times, 100 * times, 0 * times, times[np.newaxis])
    return float(first_detection(still, flight, 100.0)[0])
