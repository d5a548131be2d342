"""`planner doctor`: whether this computer has what the planner needs, and what to do if not.

What may be broken is loaded by the check that asks for it, so that all others can still answer.
"""

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.cache import cache_folder, clear, limit_bytes, sizes
from planner.cli.printing import print_result
from planner.errors import PlannerError
from planner.network.sumo import binary, sumo_environment
from planner.provenance import PACKAGES, versions

if TYPE_CHECKING:
    from rich.table import Table

SUMMARY = "check this installation and suggest a remedy for each fault"
DETAILS = ""
EXAMPLES = (
    ("doctor", "first of all on a new computer"),
    ("doctor --compile", "after an installation"),
    ("doctor --clear", "empty the cache"),
)

SUMO_RELEASE = "1.28"  # the programs and both libraries move together
ARROW_RELEASE = "23"  # libsumo is compiled against it
APT_LINE = "apt-get install --no-install-recommends libgl1 libx11-6 libxext6 libxrender1 libatomic1"
PIP_LINE = "python -m pip install --force-reinstall"
TOWN = "berlin"  # a shipped scenario
WAIT_S = 60.0  # a program that has not answered by then hangs


@dataclass(frozen=True)
class Finding:
    """The result of one check."""

    what: str
    fine: bool
    found: str
    remedy: str = ""  # what to do if it is not fine

    def as_dict(self) -> dict[str, Any]:
        """Return it as `planner doctor --json` prints it."""
        return {
            "what": self.what,
            "fine": self.fine,
            "told": self.found,
            "remedy": self.remedy,
        }


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner doctor`."""
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--compile",
        action="store_true",
        help="compile all that is compiled, so that no search waits for it: a minute or two",
    )
    what.add_argument(
        "--clear", action="store_true", help="empty the cache, but for what is in use"
    )


def run(arguments: argparse.Namespace) -> int:
    """Examine the installation; return 1 if something has to be mended."""
    if arguments.clear:
        freed = clear()
        print_result(arguments, {"freed_bytes": freed}, [f"freed {freed / 1e6:,.0f} MB"])
        return 0
    if arguments.compile:
        _compile(arguments)
        return 0
    findings = examine()
    summary = {"findings": [finding.as_dict() for finding in findings]}
    print_result(arguments, summary, [doctor_table(findings)])
    return 0 if all(finding.fine for finding in findings) else 1


def _compile(arguments: argparse.Namespace) -> None:
    from planner.cli.progress import progress_bar
    from planner.mission.warm_up import compile_all

    begun_s = time.monotonic()
    with progress_bar("compiling") as progress:
        compile_all(progress)
    took_s = time.monotonic() - begun_s
    print_result(arguments, {"took_s": took_s}, [f"all is compiled, after {took_s:.0f} s"])


def doctor_table(findings: Iterable[Finding]) -> "Table":
    """Return the findings as a table, with faults marked and their remedies."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, title_justify="left")
    for name in ("", "", "found", "remedy"):
        table.add_column(name, overflow="fold")
    for finding in findings:
        mark = "ok" if finding.fine else "FAULT"
        style = None if finding.fine else "bold red"
        table.add_row(mark, finding.what, finding.found, finding.remedy, style=style)
    return table


def examine() -> list[Finding]:
    """Return all findings, in the order in which faults are best mended.

    Never raises: whatever goes wrong becomes a finding.
    """
    checks: list[Callable[[], Iterator[Finding]]] = [
        _python,
        _packages,
        _library,
        _programs,
        _town,
        _cache,
        _compiler,
    ]
    return [finding for check in checks for finding in check()]


def _python() -> Iterator[Finding]:
    fine = sys.version_info >= (3, 11)
    found = f"{platform.python_version()} at {sys.executable}"
    yield Finding("Python", fine, found, "" if fine else "install Python 3.11 or later")


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
    """Load SUMO's library in a separate process, as a broken one may crash the process."""
    code = "import libsumo; print(libsumo.simulation.getVersion()[1])"
    answer, fine = _run([sys.executable, "-c", code], LIBSUMO_AS_TRACI="quiet")
    yield Finding("SUMO's library loads", fine, answer, "" if fine else _remedy(answer))


def _programs() -> Iterator[Finding]:
    for name in ("netconvert", "sumo"):
        try:
            sumo_environment()
            answer, fine = _run([str(binary(name)), "--version"])
        except PlannerError as error:
            answer, fine = str(error), False
        yield Finding(f"{name} runs", fine, answer, "" if fine else _remedy(answer))


def _town() -> Iterator[Finding]:
    """Look for the net of a shipped scenario, which comes with SUMO."""
    what = f"{TOWN}'s net comes with SUMO"
    try:
        net = _net_of_town()
    except (PlannerError, ImportError) as error:
        yield Finding(what, False, str(error), _remedy(""))
        return
    yield Finding(what, True, str(net))


def _net_of_town() -> Path:
    from planner.network.read import source_files
    from planner.scenario.draft import read_draft

    draft = read_draft(TOWN)
    assert draft.network is not None
    (net,) = source_files(draft.network, draft.folder).values()
    return net


def _run(command: list[str], **environment: str) -> tuple[str, bool]:
    """Return the most useful line of a program's output, and whether it succeeded."""
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


def _remedy(answer: str) -> str:
    if "cannot open shared object file" in answer:
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        return APT_LINE if root else f"sudo {APT_LINE}"
    release = f"{SUMO_RELEASE}.*"
    return f"{PIP_LINE} 'eclipse-sumo=={release}' 'libsumo=={release}' 'sumolib=={release}'"


def _cache() -> Iterator[Finding]:
    try:
        yield _writable("cache can be written", cache_folder(), "PLANNER_CACHE")
        takes = ", ".join(f"{part} {taken / 1e6:,.0f} MB" for part, taken in sizes().items())
        yield Finding("cache's size", True, f"{takes}; at most {limit_bytes() / 1e9:g} GB")
    except PlannerError as error:
        yield Finding("cache can be trusted", False, str(error), "as it says")


def _writable(what: str, folder: Path, variable: str) -> Finding:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            file.write(b"x" * 65536)
    except OSError as error:
        fault = f"{folder}: {error.strerror or error}"
        remedy = f"set {variable} to a writable folder, on a disk with free space"
        return Finding(what, False, fault, remedy)
    return Finding(what, True, str(folder))


def _compiler() -> Iterator[Finding]:
    """Ask the detection kernel a question whose answer is known."""
    what = "compiled code runs"
    try:
        seen_s = _see_a_target_at_rest()
    except Exception as error:
        fault = " ".join(str(error).split()) or type(error).__name__
        yield Finding(what, False, fault[:200], f"{PIP_LINE} numba llvmlite")
        return
    fine = abs(seen_s - 9.0) < 1e-9
    answer = "detects as it should" if fine else f"detects at {seen_s} s what comes in view at 9 s"
    yield Finding(what, fine, answer, "" if fine else f"{PIP_LINE} numba llvmlite")
    folder = os.environ.get("NUMBA_CACHE_DIR", "")
    if folder:
        yield _writable("compiled code is kept", Path(folder), "NUMBA_CACHE_DIR")


def _see_a_target_at_rest() -> float:
    """Return when a UAV at 100 m/s comes within 100 m of a target 1 km ahead: 9 s."""
    import numpy as np

    from planner.detection.first_detection import first_detection
    from planner.flight.track import Track
    from planner.futures.futures import Futures

    zero, one = np.zeros(1), np.ones(1)
    rests = np.zeros(1, np.bool_)
    still = Futures(zero, 1000 * one, zero, np.arange(2), one, rests)
    times = np.array([0.0, 20.0])
    flight = Track(times, 100 * times, 0 * times, times[np.newaxis])
    return float(first_detection(still, flight, 100.0)[0])
