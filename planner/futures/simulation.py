"""SUMO drives particles; the only user of libsumo.

Particles must never meet. In a batch they share one run only where SUMO can be made to ignore
all others: at constant speed on nets of one lane. Elsewhere a batch is a single particle.
"""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from planner.errors import InputError, SumoError, is_short_of_memory
from planner.futures.fcd import Samples, read_samples
from planner.locks import temporary_folder
from planner.network.road_network import RoadNetwork
from planner.network.sumo import MESSAGES, sumo_environment

SLICE_S = 0.2  # of wall time between two answers to Ctrl-C
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


@dataclass(frozen=True)
class Run:
    """One SUMO run: vehicles that do not notice each other, and how they are driven."""

    vehicles: tuple[Vehicle, ...]
    free: bool  # SUMO's driver; otherwise the drawn speed and nothing else
    seed: int
    step_s: float
    end_s: float


def simulate(network: RoadNetwork, run: Run) -> Samples:
    """Return what SUMO's floating car data says of each vehicle at each step of a run.

    Raises
    ------
    SumoError
        With SUMO's own message, or if a vehicle never entered the net.
    """
    sumo_environment()
    with temporary_folder() as work:
        # Characters beyond ASCII by their numbers: read alike in every locale.
        routes = "\n".join(_route_file(run)).encode("ascii", "xmlcharrefreplace")
        (work / "routes.xml").write_bytes(routes)
        # SUMO parts paths at commas and puts variables into them.
        link = work / f"net{'.net.xml.gz' if network.path.suffix == '.gz' else '.net.xml'}"
        link.symlink_to(network.path.resolve())
        with _own_message(work / "errors.txt", link, network.given_as):
            _drive(run, _options(link, run, work))
        try:
            samples = read_samples(work / "fcd.parquet", network)
        except InputError as error:
            raise SumoError(_no_motion(work, network.given_as)) from error
    missing = {vehicle.name for vehicle in run.vehicles} - set(samples.names)
    if missing:
        raise SumoError(f"SUMO never let particle {min(missing)} into {network.given_as}")
    return samples


def _no_motion(work: Path, net: object) -> str:
    """Return why SUMO's file is cut: it does not notice when it cannot write."""
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


def _options(net: Path, run: Run, work: Path) -> list[str]:
    given = {
        "net-file": net,
        "route-files": work / "routes.xml",
        "step-length": run.step_s,
        "seed": run.seed,
        "fcd-output": work / "fcd.parquet",
        "fcd-output.attributes": "x,y,speed,lane,pos",
        "precision": 9,
        "time-to-teleport": -1,
        "collision.action": "none",
        "no-step-log": "true",
        "no-warnings": "true",
    }
    return ["sumo"] + [f"--{key}={value}" for key, value in given.items()]


def _route_file(run: Run) -> Iterator[str]:
    yield "<routes>"
    for vehicle in run.vehicles:
        speed = max(vehicle.speeds_mps)
        # SUMO's own driver keeps its imperfection; a constant speed has none.
        driver = "" if run.free else 'sigma="0"'
        name = quoteattr(vehicle.name)
        yield (
            f'<vType id={name} maxSpeed="{speed!r}" speedFactor="1" speedDev="0" {driver}/>'
            f'<vehicle id={name} type={name} depart="{vehicle.depart_s!r}" departLane="best" '
            f'departPos="{vehicle.start_m!r}" insertionChecks="none" '
            f'departSpeed="{"desired" if run.free else 0}">'
            f"<route edges={quoteattr(' '.join(vehicle.edges))}/></vehicle>"
        )
    yield "</routes>"


@contextmanager
def _own_message(errors: Path, link: Path, net: Path) -> Iterator[None]:
    """Put SUMO's own words in the place of libsumo's "Process Error"."""
    libsumo = import_libsumo()
    try:
        with _stderr_into(errors):
            yield
    except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
        reason = _reason(str(error), errors).replace(str(link), str(net))
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
                _take_the_wheel(libsumo, waiting.pop(name), free=run.free)
        if any(len(set(vehicle.speeds_mps)) > 1 for vehicle in run.vehicles):
            _drive_speed_by_road(libsumo, run)
        else:
            _run_on(libsumo, run)
    finally:
        libsumo.close()


def _take_the_wheel(libsumo: Any, vehicle: Vehicle, *, free: bool) -> None:
    if not free:
        libsumo.vehicle.setSpeedMode(vehicle.name, 0)
        libsumo.vehicle.setSpeed(vehicle.name, vehicle.speeds_mps[0])


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
            if run.free:
                libsumo.vehicle.setMaxSpeed(name, by_name[name].speeds_mps[index])
            elif not libsumo.vehicle.getRoadID(name).startswith(":"):
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
