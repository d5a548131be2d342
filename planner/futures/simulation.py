"""SUMO drives vehicles together, where it can be made to ignore all others; the door to libsumo.

That is at constant speed on nets of one lane. Elsewhere each rides alone (`rides`).
"""

import math
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from planner.errors import SumoError, is_short_of_memory
from planner.locks import temporary_folder
from planner.network.sumo import MESSAGES, sumo_environment

SLICE_S = 0.2  # of wall time between two answers to Ctrl-C
PARQUET = b"PAR1"  # with which such files begin and end
LEAST_BYTES = 1 << 20  # free, where SUMO records
LIBRARIES = "libgl1 libx11-6 libxext6 libxrender1 libatomic1"


@dataclass(frozen=True)
class Vehicle:
    """One particle in SUMO's words."""

    name: str
    edges: tuple[str, ...]
    speeds_mps: tuple[float, ...]  # one per edge
    lengths_m: tuple[float, ...]  # one per edge
    start_m: float
    depart_s: float
    stop_s: float = math.inf  # when it rests, wherever it is; in rides only
    end_m: float = math.inf  # along the last edge, where it arrives; in rides only
    flees_s: float = 0.0  # for so long it drives faster by a factor; in rides only
    flees: float = 1.0


@dataclass(frozen=True)
class Run:
    """One SUMO run: vehicles that do not notice each other, at their drawn speeds."""

    net: Path
    given_as: Path  # the file that messages name
    vehicles: tuple[Vehicle, ...]
    seed: int
    step_s: float
    end_s: float


def drive_together(run: Run) -> bytes:
    """Return SUMO's floating car data of each vehicle at each step of a run, as a Parquet file.

    Raises
    ------
    SumoError
        With SUMO's own message, or if SUMO wrote no whole file.
    """
    with temporary_folder() as work:
        link = plain_link(run.net, work)
        # Characters beyond ASCII by their numbers: read alike in every locale.
        routes = "\n".join(_route_file(run)).encode("ascii", "xmlcharrefreplace")
        (work / "routes.xml").write_bytes(routes)
        with own_message(work / "errors.txt", run.net, run.given_as):
            _drive(run, _options(link, run, work))
        recorded = work / "fcd.parquet"
        if not recorded.is_file() or not _is_whole(content := recorded.read_bytes()):
            raise SumoError(_no_motion(work, run.given_as))
    return content


def _is_whole(content: bytes) -> bool:
    """Return whether a Parquet file has its end: SUMO does not notice when it cannot write."""
    return len(content) > 2 * len(PARQUET) and content.endswith(PARQUET)


def plain_link(net: Path, work: Path) -> Path:
    """Return a link to a net without what SUMO takes for more: it parts paths at commas."""
    link = work / f"net{'.net.xml.gz' if net.suffix == '.gz' else '.net.xml'}"
    link.symlink_to(net.resolve())
    return link


def _no_motion(work: Path, net: object) -> str:
    """Return why SUMO's file is cut."""
    if shutil.disk_usage(work).free < LEAST_BYTES:
        return f"no space left in {work.parent} for what SUMO records; set TMPDIR to another folder"
    return f"SUMO recorded no motion on {net}"


def import_libsumo() -> Any:
    """Return libsumo, or say which system libraries it wants.

    Raises
    ------
    SumoError
        If a shared library is missing, with the command that installs it.
    MemoryError
        If there is no room for them.
    """
    sumo_environment()
    try:
        import libsumo
    except ImportError as error:
        if is_short_of_memory(error):
            raise MemoryError(str(error)) from error
        raise SumoError(
            f"libsumo cannot be loaded ({error}); install its system libraries, "
            f"on Debian and Ubuntu: apt-get install {LIBRARIES}"
        ) from error
    return libsumo


def sumo_options(
    net: Path, *, seed: int, step_s: float, more: Mapping[str, object] | None = None
) -> list[str]:
    """Return the words that start SUMO on a net, by its link, with more options than the usual."""
    given = {
        "net-file": net,
        "step-length": step_s,
        "seed": seed,
        "time-to-teleport": -1,
        "collision.action": "none",
        "no-step-log": "true",
        "no-warnings": "true",
        **(more or {}),
    }
    return ["sumo"] + [f"--{key}={value}" for key, value in given.items()]


def _options(net: Path, run: Run, work: Path) -> list[str]:
    more = {
        "route-files": work / "routes.xml",
        "fcd-output": work / "fcd.parquet",
        "fcd-output.attributes": "x,y,speed,lane,pos",
        "precision": 9,
    }
    return sumo_options(net, seed=run.seed, step_s=run.step_s, more=more)


def _route_file(run: Run) -> Iterator[str]:
    yield "<routes>"
    for vehicle in run.vehicles:
        speed = max(vehicle.speeds_mps)
        name = quoteattr(vehicle.name)
        yield (
            f'<vType id={name} maxSpeed="{speed!r}" speedFactor="1" speedDev="0" sigma="0"/>'
            f'<vehicle id={name} type={name} depart="{vehicle.depart_s!r}" departLane="best" '
            f'departPos="{vehicle.start_m!r}" insertionChecks="none" '
            'departSpeed="0">'
            f"<route edges={quoteattr(' '.join(vehicle.edges))}/></vehicle>"
        )
    yield "</routes>"


@contextmanager
def own_message(errors: Path, net: Path, given_as: Path) -> Iterator[None]:
    """Put SUMO's own words in the place of libsumo's "Process Error".

    In place of links beside the file of errors they name what these lead to, and the net as it was
    given.
    """
    libsumo = import_libsumo()
    try:
        with _stderr_into(errors):
            yield
    except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
        reason, real = _reason(str(error), errors), net.resolve()
        for link in errors.parent.rglob("*"):
            if link.is_symlink():
                file = link.resolve()
                reason = reason.replace(str(link), str(given_as if file == real else file))
        raise SumoError(f"SUMO failed: {reason}") from error


@contextmanager
def _stderr_into(path: Path) -> Iterator[None]:
    """Catch what SUMO writes to stderr; its own log may still lie in its memory when it fails."""
    stderr = os.dup(2)
    try:
        with path.open("wb") as file:
            os.dup2(file.fileno(), 2)
        yield
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)


def _reason(message: str, errors: Path) -> str:
    if message and "Process Error" not in message:
        return message
    said = errors.read_text(encoding="utf-8", errors="replace").splitlines()
    lines = [line.removeprefix("Error:").strip() for line in said if "Warning:" not in line]
    lines = [line for line in lines if line]
    if len(lines) > MESSAGES:
        lines[MESSAGES:] = [f"(and {len(lines) - MESSAGES} more)"]
    return " ".join(lines) or "it gives no reason"


def _drive(run: Run, options: list[str]) -> None:
    libsumo = import_libsumo()
    libsumo.start(options)
    try:
        waiting = {vehicle.name: vehicle for vehicle in run.vehicles}
        while waiting and libsumo.simulation.getTime() <= run.end_s:
            libsumo.simulationStep()
            for name in libsumo.simulation.getDepartedIDList():
                libsumo.vehicle.setSpeedMode(name, 0)
                libsumo.vehicle.setSpeed(name, waiting.pop(name).speeds_mps[0])
        if any(len(set(vehicle.speeds_mps)) > 1 for vehicle in run.vehicles):
            _drive_speed_by_road(libsumo, run)
        else:
            _run_on(libsumo, run)
    finally:
        libsumo.close()


def _run_on(libsumo: Any, run: Run) -> None:
    """Step to the end in slices of wall time, as libsumo ignores Ctrl-C while it steps."""
    steps = 1
    while libsumo.simulation.getTime() <= run.end_s and _someone_drives(libsumo):
        begun = time.perf_counter()
        until = min(libsumo.simulation.getTime() + steps * run.step_s, run.end_s + run.step_s)
        libsumo.simulationStep(until)
        steps = max(1, int(steps * min(4.0, SLICE_S / (time.perf_counter() - begun + 1e-9))))


def _someone_drives(libsumo: Any) -> bool:
    return bool(libsumo.simulation.getMinExpectedNumber() > 0)


def _drive_speed_by_road(libsumo: Any, run: Run) -> None:
    by_name = {vehicle.name: vehicle for vehicle in run.vehicles}
    while libsumo.simulation.getTime() <= run.end_s and _someone_drives(libsumo):
        for name in libsumo.vehicle.getIDList():
            index = libsumo.vehicle.getRouteIndex(name)
            if not libsumo.vehicle.getRoadID(name).startswith(":"):
                along_m = libsumo.vehicle.getLanePosition(name)
                speed = step_speed(by_name[name], index, along_m, run.step_s)
                libsumo.vehicle.setSpeed(name, speed)
        libsumo.simulationStep()


def step_speed(vehicle: Vehicle, index: int, along_m: float, step_s: float) -> float:
    """Return the mean speed of the next step, in which a vehicle may enter further roads, m/s."""
    left_s, driven_m = step_s, 0.0
    rest_m = vehicle.lengths_m[index] - along_m
    while index + 1 < len(vehicle.edges) and rest_m < vehicle.speeds_mps[index] * left_s:
        driven_m += rest_m
        left_s -= rest_m / vehicle.speeds_mps[index]
        index += 1
        rest_m = vehicle.lengths_m[index]
    return (driven_m + vehicle.speeds_mps[index] * left_s) / step_s
