"""Particles as riders: ordinary cars in a town's traffic, a few in each copy of it.

SUMO is loaded with the traffic once per realisation and stepped on to the target's time 0. A fork
is an exact copy of that moment. What rides in it brakes, queues and is braked for like any other
car; few ride in each, so that they hardly meet each other.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from planner.futures.forks import CAN_FORK, refuse_to_outlive
from planner.futures.rider import OURS, Fate, Rider, events_of
from planner.futures.rides import Ride, Session, drive_session, frozen_heap, in_fork
from planner.futures.simulation import Run, Vehicle, drive_together, import_libsumo, own_message
from planner.futures.steering import Step, stepper
from planner.futures.traffic import Traffic, traffic_options
from planner.futures.warm_up import Warm, warm_up
from planner.locks import temporary_folder

LOOK_STEPS = 100  # of a warm-up, after which the program that waits is looked for
DRIVEN_S = 300.0  # in which the ways are compared that a particle makes with and without others


@dataclass(frozen=True)
class TrafficSession:
    """Vehicles that ride in one realisation of the traffic, a few in each copy of it."""

    net: Path
    given_as: Path  # the file that messages name
    traffic: Traffic
    realisation: int
    together: tuple[tuple[Vehicle, ...], ...]  # who rides in one copy
    alone: tuple[bool, ...]  # whether the first of these rides once more, without the others
    end_s: float  # on the vehicles' clock


class Ridden(NamedTuple):
    """What those did that rode in one copy."""

    step_s: float  # of the traffic, and between two samples
    rides: tuple[Ride, ...]
    fates: tuple[Fate, ...]
    number: int = 0  # in `TrafficSession.together`
    alone: Ride | None = None  # of the first vehicle, without the others, up to `DRIVEN_S`
    warm: Warm | None = None  # what the traffic was like at time 0


Copy = Callable[[Sequence[Vehicle], float], Ridden]  # lets some ride in a copy, to an end


def drive(task: Run | Session | TrafficSession) -> bytes | list[Ride] | Iterator[Ridden]:
    """Do what a worker is there for: drive together, or one by one, or in traffic."""
    if isinstance(task, Run):
        return drive_together(task)
    return drive_session(task) if isinstance(task, Session) else ride_in_traffic(task)


def ride_in_traffic(session: TrafficSession, *, forks: bool = CAN_FORK) -> Iterator[Ridden]:
    """Yield what the vehicles of each copy did, one copy after the other.

    Parameters
    ----------
    forks
        Otherwise the traffic is loaded and warmed up anew for each copy, to the same effect.

    Raises
    ------
    SumoError
        With SUMO's own message.
    LostError
        If the process of a copy dies twice.
    """
    with temporary_folder() as folder:
        (work := folder / "sumo").mkdir()
        with (
            own_message(folder / "errors.txt", session.net, session.given_as),
            (_forking if forks else _loading)(session, work) as copy,
        ):
            yield from _each(session, copy)


def _each(session: TrafficSession, copy: Copy) -> Iterator[Ridden]:
    for number, vehicles in enumerate(session.together):
        ridden, alone = copy(vehicles, session.end_s), None
        if session.alone[number] and len(vehicles) > 1:
            end_s = min(session.end_s, vehicles[0].depart_s + DRIVEN_S)
            (alone,) = copy(vehicles[:1], end_s).rides
        yield ridden._replace(number=number, alone=alone)


@contextmanager
def _forking(session: TrafficSession, work: Path) -> Iterator[Copy]:
    """Have the traffic loaded and warmed up once, and a fork of it for each copy."""
    libsumo = import_libsumo()
    libsumo.start(_options(session, work))
    try:
        step, warm = _warmed_up(libsumo, session)

        def copy(vehicles: Sequence[Vehicle], end_s: float) -> Ridden:
            name = "particles " + ", ".join(vehicle.name for vehicle in vehicles)
            ride = partial(_ridden, libsumo, step, vehicles, end_s)
            return in_fork(libsumo, name, ride)._replace(warm=warm)

        with frozen_heap():
            yield copy
    finally:
        libsumo.close()


@contextmanager
def _loading(session: TrafficSession, work: Path) -> Iterator[Copy]:
    """Have the traffic loaded and warmed up anew for each copy."""
    libsumo, loads = import_libsumo(), count()

    def copy(vehicles: Sequence[Vehicle], end_s: float) -> Ridden:
        (own := work / str(next(loads))).mkdir()
        libsumo.start(_options(session, own))
        try:
            step, warm = _warmed_up(libsumo, session)
            return _ridden(libsumo, step, vehicles, end_s)._replace(warm=warm)
        finally:
            libsumo.close()

    yield copy


def _options(session: TrafficSession, work: Path) -> list[str]:
    return traffic_options(session.traffic, session.net, session.realisation, work)


def _warmed_up(libsumo: Any, session: TrafficSession) -> tuple[Step, Warm]:
    """Step the traffic on to the target's time 0; return what makes a step of it."""
    step, taken = stepper(libsumo, session.traffic.control), count()

    def attended() -> None:
        if next(taken) % LOOK_STEPS == 0:
            refuse_to_outlive()
        step()

    warm = warm_up(libsumo, attended, session.traffic.at_s)
    libsumo.vehicletype.copy("DEFAULT_VEHTYPE", OURS)
    libsumo.vehicletype.setSpeedDeviation(OURS, 0.0)
    return step, warm


def _ridden(libsumo: Any, step: Step, vehicles: Sequence[Vehicle], end_s: float) -> Ridden:
    """Let some vehicles ride to the end, in this copy of the traffic."""
    step_s = libsumo.simulation.getDeltaT()
    riders = [Rider(libsumo, vehicle, step_s, end_s) for vehicle in vehicles]
    taken: set[str] = set()
    for sample in range(1 + math.ceil(end_s / step_s)):
        for rider in riders:
            rider.prepare(sample, taken)
        step()
        events = events_of(libsumo)
        for rider in riders:
            rider.look(sample, events)
    rides, fates = zip(*(rider.ridden() for rider in riders), strict=True)
    return Ridden(step_s, rides, fates)
