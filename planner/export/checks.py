"""What speaks against flying a flight as it is written, one line for each thing."""

from collections.abc import Iterator, Sequence
from math import hypot, inf

import numpy as np

from planner.clock import clock
from planner.errors import InputError
from planner.export.from_run import RunFlight
from planner.flight.separation import BESIDE_M, MISTIMED, meetings
from planner.flight.turning import tight_corners
from planner.messages import counted, percent
from planner.mission.aircraft import not_kept
from planner.scenario.fleet import APART_M

FAR_M = 900.0  # from home to the first waypoint, beyond which PX4 does not start a mission
ROUNDING_S = 1.0  # by which whole seconds of hovering may make a flight longer


def faults(run: RunFlight, *, most_waypoints: int | None) -> Iterator[str]:
    """Yield what is wrong with a flight, and the remedy.

    Parameters
    ----------
    most_waypoints
        That the autopilot takes; None: it is written in parts.
    """
    yield from map(str, not_kept(run.aircraft.law, climbs=run.flight.launch is None))
    many = len(run.flight.waypoints)
    if most_waypoints is not None and many > most_waypoints:
        yield (
            f"{many:,} waypoints are more than --max-waypoints {most_waypoints:,}; give a larger "
            "--tolerance, raise it, or have them in several files: --split"
        )
    yield from _pieces(run)
    if run.airspace is not None:
        try:
            run.airspace.refuse(run.track)
        except InputError as error:
            yield str(error)
    yield from _battery(run)
    home, first = run.flight.waypoints[:2]
    away_m = hypot(first.x_m - home.x_m, first.y_m - home.y_m)
    if away_m > FAR_M and not run.by_hand and run.flight.launch is None:
        yield (
            f"the first waypoint is {away_m:,.0f} m from where it takes off, more than "
            f"{FAR_M:.0f} m; take off nearer (uav.start)"
        )


def too_near(runs: Sequence[RunFlight], names: Sequence[str]) -> Iterator[str]:
    """Yield which flights of different UAVs may come too near each other, and when first."""
    courses, whose = [run.course for run in runs], [run.sortie.uav for run in runs]
    for one, other, near_s in meetings(courses, whose):
        yield nearness(names[one], names[other], near_s)


def nearness(one: str, other: str, near_s: float) -> str:
    """Return what is said of two flights that may come too near each other from a time on."""
    return (
        f"{one} and {other} may be nearer than {APART_M:g} m in height and {BESIDE_M:g} m beside "
        f"each other from {clock(near_s)} on, if times are off by {percent(MISTIMED, 0)}; start "
        f"and land {BESIDE_M:g} m apart, or take off later (uav.take_off_s)"
    )


def _pieces(run: RunFlight) -> Iterator[str]:
    law = run.aircraft.law
    if not law.can_hover:
        yield from _wings(run)
        return
    corner_m = law.corner_m
    short = sum(0.0 < metres < corner_m < inf for metres in run.flight.lengths_m)
    if short:
        yield (
            f"{counted(short, 'piece')} shorter than uav.corner_m, {corner_m:g} m, cannot be flown "
            "as drawn; give a larger --tolerance"
        )


def _wings(run: RunFlight) -> Iterator[str]:
    """Yield where it flies as only an aircraft can that hovers."""
    places = [(one.x_m, one.y_m) for one in run.flight.waypoints]
    moves = [k for k, place in enumerate(places) if k == 0 or place != places[k - 1]]
    holds = sum(one.hold_s > 0.0 for one in run.flight.waypoints)
    tight = tight_corners(np.array(places)[moves], run.aircraft.law)
    said = [f"hovers at {counted(holds, 'place')}"] * (holds > 0)
    said += [f"has {counted(tight, 'corner')} too tight"] * (tight > 0)
    if said:
        yield (
            f"for an aircraft that cannot hover (uav.hover) it {' and '.join(said)}; plan for it: "
            "--set uav.aircraft=..."
        )


def _battery(run: RunFlight) -> Iterator[str]:
    may_s = run.battery.lasts_s - run.battery.reserve_s
    if run.lasts_s > may_s + ROUNDING_S:
        yield (
            f"it is in the air for {clock(run.lasts_s)}, and the battery lasts for {clock(may_s)} "
            "with its reserve kept; plan a shorter flight"
        )


def remarks(run: RunFlight) -> Iterator[str]:
    """Yield what a pilot has to know of a flight, though nothing is wrong with it."""
    law = run.aircraft.law
    full_m = law.speed_mps**2 / law.acceleration_mps2
    short = sum(0.0 < metres < full_m for metres in run.flight.lengths_m)
    if short and law.can_hover:
        yield (
            f"it does not reach its speed on {counted(short, 'piece')} of "
            f"{len(run.flight.lengths_m)}, shorter than {full_m:.0f} m; the times allow for it"
        )
    if not law.can_hover:
        yield (
            "files for autopilots take off as multicopters do: for an aircraft on wings set its "
            "kind, its take-off and its landing; no flight of one has been tried"
        )
    if run.ended_s is not None:
        yield f"the battery ends the search at {clock(run.ended_s)}, before the end of the plan"
    if run.battery.lasts_s == inf:
        yield "no time in the air is given (uav.max_flight_time_s): no battery was checked"
    if not run.flight.comes_home:
        yield "it does not land where it took off: at its end it stays where it is, for the pilot"


def of_flights(names: Sequence[str], said: Sequence[Sequence[str]]) -> list[str]:
    """Return what is said of flights, each line with the name of its flight if it has one."""
    each = zip(names, said, strict=True)
    return [f"{name}: {line}" if name else line for name, lines in each for line in lines]
