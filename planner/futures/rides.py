"""One loaded SUMO session, one fork of it per ride: vehicles that never meet.

To load a town's net takes as long as to drive tens of vehicles through it. A fork is an exact copy
of the loaded session: what a vehicle does in it is, to the last bit, what it does in a SUMO that is
loaded anew for it. The process that forks imports neither numba nor pyarrow nor pandas and has no
threads, so that forks are quick and sound.
"""

import gc
import logging
import math
import pickle
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from planner.errors import LostError, PlannerError, SumoError
from planner.futures.forks import CAN_FORK, answer_of_fork, told_end
from planner.futures.simulation import (
    Vehicle,
    import_libsumo,
    own_message,
    plain_link,
    step_speed,
    sumo_options,
)
from planner.locks import temporary_folder

log = logging.getLogger(__name__)

RIDER = "rider"  # the name of the only vehicle, of its type and of its route
SHORT_M = 0.1  # before the end of an edge, where a vehicle can still be set down
TRIES = 2  # of a ride whose process dies

Found = TypeVar("Found")
Arrival = tuple[float, float, float]  # seconds after the last sample, x and y in metres


@dataclass(frozen=True)
class Session:
    """Vehicles that are driven one by one, each in its own copy of one loaded SUMO."""

    net: Path
    given_as: Path  # the file that messages name
    vehicles: tuple[Vehicle, ...]
    phases_s: tuple[int, ...]  # the second of the signals at which each one's time 0 is
    free: bool  # SUMO's driver; otherwise the drawn speed and nothing else
    seed: int  # of SUMO, for all of them
    step_s: float
    end_s: float  # on the vehicles' clock


@dataclass(frozen=True)
class Ride:
    """What one vehicle did."""

    xy_m: bytes  # float64 x, y, one pair per step from the first one on, in metres
    from_s: float  # when it was set down, on its own clock
    # from which sample on it is on an edge, or in a junction, and the edge that this counts to
    roads: tuple[tuple[int, str, str], ...] = field(repr=False)
    arrival: Arrival | None  # at its route's end


def drive_session(session: Session, *, forks: bool = CAN_FORK) -> list[Ride]:
    """Return each vehicle's ride, in their order.

    Parameters
    ----------
    forks
        Otherwise SUMO is loaded anew for each vehicle, to the same effect.

    Raises
    ------
    SumoError
        With SUMO's own message, or if a vehicle never entered the net.
    LostError
        If the process of a ride dies twice.
    """
    order = sorted(range(len(session.vehicles)), key=lambda k: (session.phases_s[k], k))
    drive = _in_forks if forks else _in_fresh_loads
    with temporary_folder() as work:
        link = plain_link(session.net, work)
        with own_message(work / "errors.txt", session.net, session.given_as):
            rides = dict(drive(session, link, order))
    return [rides[k] for k in range(len(session.vehicles))]


def _in_forks(session: Session, link: Path, order: list[int]) -> Iterator[tuple[int, Ride]]:
    libsumo = import_libsumo()
    libsumo.start(sumo_options(link, seed=session.seed, step_s=session.step_s))
    try:
        _make_type(libsumo, session)
        with frozen_heap():
            now_s = 0
            for k in order:
                now_s = _step_on(libsumo, session, now_s, k)
                name = f"particle {session.vehicles[k].name}"
                yield k, in_fork(libsumo, name, partial(_ride, libsumo, session, k))
    finally:
        libsumo.close()


@contextmanager
def frozen_heap() -> Iterator[None]:
    """Keep the collector from touching, and so copying, all pages of every fork."""
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()


def _in_fresh_loads(session: Session, link: Path, order: list[int]) -> Iterator[tuple[int, Ride]]:
    libsumo = import_libsumo()
    for k in order:
        libsumo.start(sumo_options(link, seed=session.seed, step_s=session.step_s))
        try:
            _make_type(libsumo, session)
            _step_on(libsumo, session, 0, k)
            yield k, _ride(libsumo, session, k)
        finally:
            libsumo.close()


def _step_on(libsumo: Any, session: Session, now_s: int, k: int) -> int:
    """Take the empty net on to the second of the signals at which a vehicle sets out."""
    phase_s = session.phases_s[k]
    for _ in range(round((phase_s - now_s) / session.step_s)):
        libsumo.simulationStep()
    return phase_s


def _make_type(libsumo: Any, session: Session) -> None:
    libsumo.vehicletype.copy("DEFAULT_VEHTYPE", RIDER)
    libsumo.vehicletype.setSpeedDeviation(RIDER, 0.0)
    if not session.free:
        # SUMO's own driver keeps its imperfection; a constant speed has none.
        libsumo.vehicletype.setImperfection(RIDER, 0.0)


def _ride(libsumo: Any, session: Session, k: int) -> Ride:
    """Set a vehicle down and drive it to its end, or to that of the session."""
    vehicle = session.vehicles[k]
    from_s = _set_down(libsumo, session, vehicle)
    steer = _steering(libsumo, session, vehicle)
    step, place, road_of = (
        libsumo.simulation.step,
        libsumo.vehicle.getPosition,
        libsumo.vehicle.getRoadID,
    )
    xy_m, roads = array("d", place(RIDER)), [(0, *_road(libsumo, vehicle, road_of(RIDER)))]
    goal, before_end = vehicle.edges[-1], None
    calms_at = _flee(libsumo, session, vehicle)
    lasts_s = min(session.end_s, vehicle.stop_s) - from_s
    for sample in range(1, 1 + math.ceil(lasts_s / session.step_s)):
        if steer is not None:
            steer()
        if sample == calms_at:
            _drive_at(libsumo, vehicle, 1.0)
        if roads[-1][1] == goal:
            before_end = _before_end(libsumo, vehicle)
        step()
        try:
            xy_m.extend(place(RIDER))
        except libsumo.TraCIException:
            if not libsumo.simulation.getArrivedNumber():
                raise
            arrival = arrival_of(xy_m, before_end, session.step_s)
            return Ride(xy_m.tobytes(), from_s, tuple(roads), arrival)
        road = road_of(RIDER)
        if road != roads[-1][1]:
            roads.append((sample, *_road(libsumo, vehicle, road)))
    return Ride(xy_m.tobytes(), from_s, tuple(roads), None)


def _road(libsumo: Any, vehicle: Vehicle, name: str) -> tuple[str, str]:
    """Return where a vehicle is, and the edge that this counts to: after a junction, the next."""
    if not name.startswith(":"):
        return name, name
    return name, vehicle.edges[libsumo.vehicle.getRouteIndex(RIDER) + 1]


def _set_down(libsumo: Any, session: Session, vehicle: Vehicle) -> float:
    """Put a vehicle on its first edge; return when it is there, on its own clock."""
    libsumo.route.add(RIDER, list(vehicle.edges))
    libsumo.vehicletype.setMaxSpeed(RIDER, max(vehicle.speeds_mps))
    for _ in range(round(vehicle.depart_s / session.step_s)):
        libsumo.simulationStep()
    start_m = max(0.0, min(vehicle.start_m, vehicle.lengths_m[0] - SHORT_M))
    speed = "desired" if session.free else "0"
    libsumo.vehicle.add(
        RIDER,
        RIDER,
        RIDER,
        depart="now",
        departLane="best",
        departPos=repr(start_m),
        departSpeed=speed,
        arrivalPos=repr(vehicle.end_m) if math.isfinite(vehicle.end_m) else "max",
    )
    at_s = vehicle.depart_s
    while at_s <= session.end_s:
        libsumo.simulationStep()
        if libsumo.simulation.getDepartedNumber():
            if not session.free:
                libsumo.vehicle.setSpeedMode(RIDER, 0)
                libsumo.vehicle.setSpeed(RIDER, vehicle.speeds_mps[0])
            return at_s
        at_s += session.step_s
    raise SumoError(f"SUMO never let particle {vehicle.name} into {session.given_as}")


def _flee(libsumo: Any, session: Session, vehicle: Vehicle) -> int:
    """Let a vehicle drive faster than it may; return the step in which it no longer does."""
    if not (session.free and vehicle.flees_s > 0.0):
        return 0
    _drive_at(libsumo, vehicle, vehicle.flees)
    return 1 + math.ceil(vehicle.flees_s / session.step_s)


def _drive_at(libsumo: Any, vehicle: Vehicle, factor: float) -> None:
    libsumo.vehicle.setMaxSpeed(RIDER, vehicle.speeds_mps[0] * factor)
    libsumo.vehicle.setSpeedFactor(RIDER, factor)  # after it, which would undo this


def _steering(libsumo: Any, session: Session, vehicle: Vehicle) -> Callable[[], None] | None:
    """Return what sets a vehicle's speed before each step, None where it stays as it is."""
    if len(set(vehicle.speeds_mps)) == 1:
        return None

    def by_limit() -> None:
        index = libsumo.vehicle.getRouteIndex(RIDER)
        libsumo.vehicle.setMaxSpeed(RIDER, vehicle.speeds_mps[index])

    def by_speed() -> None:
        if not libsumo.vehicle.getRoadID(RIDER).startswith(":"):
            index, along_m = (
                libsumo.vehicle.getRouteIndex(RIDER),
                libsumo.vehicle.getLanePosition(RIDER),
            )
            libsumo.vehicle.setSpeed(RIDER, step_speed(vehicle, index, along_m, session.step_s))

    return by_limit if session.free else by_speed


def _before_end(libsumo: Any, vehicle: Vehicle) -> tuple[float, float]:
    """Return how far a vehicle is from its route's end, on its lane, in metres, and its speed."""
    lane = libsumo.vehicle.getLaneID(RIDER)
    end_m = min(libsumo.lane.getLength(lane), vehicle.end_m)
    rest_m = end_m - libsumo.vehicle.getLanePosition(RIDER)
    return rest_m, libsumo.vehicle.getSpeed(RIDER)


def arrival_of(
    xy_m: Sequence[float], before_end: tuple[float, float] | None, step_s: float
) -> Arrival | None:
    """Return when and where a vehicle came to its route's end, within a step of its last sample.

    It has driven straight on and as fast as before; None where it was not seen to drive.
    """
    if before_end is None or len(xy_m) < 4:
        return None
    rest_m, speed_mps = before_end
    x_m, y_m = xy_m[-2] - xy_m[-4], xy_m[-1] - xy_m[-3]
    length_m = math.hypot(x_m, y_m)
    if not (rest_m > 0 and speed_mps > 0 and length_m > 0):
        return None
    share = rest_m / length_m
    return min(rest_m / speed_mps, step_s), xy_m[-2] + x_m * share, xy_m[-1] + y_m * share


def in_fork(libsumo: Any, name: str, work: Callable[[], Found]) -> Found:
    """Return what work finds in a process of its own, which is started again if it dies.

    Parameters
    ----------
    name
        Whose work it is, for messages.

    Raises
    ------
    LostError
        If the process dies twice.
    """
    for left in reversed(range(TRIES)):
        answer, code = answer_of_fork(partial(_pickled, libsumo, work))
        if code == 0:
            found, error = pickle.loads(answer)
            if error is None:
                there: Found = found
                return there
            raise libsumo.TraCIException(error) if isinstance(error, str) else error
        if left:
            log.warning("%s: its process %s; driven again", name, told_end(code))
    raise LostError(
        f"{name}: its process {told_end(code)}, {TRIES} times; what is recorded is kept: "
        "run it again, with fewer --jobs if memory is short"
    )


def _pickled(libsumo: Any, work: Callable[[], Any]) -> bytes:
    """Return what work finds, or why it finds nothing."""
    answer: Any = None
    wrong: PlannerError | str | None = None
    try:
        answer = work()
    except PlannerError as error:
        wrong = error
    except libsumo.TraCIException as error:  # which cannot be pickled
        wrong = str(error)
    return pickle.dumps((answer, wrong), pickle.HIGHEST_PROTOCOL)
