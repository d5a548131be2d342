"""What every planner's result has to be, whoever wrote the planner: a flight of the problem's UAV.

Told at the first fault in words for the one who wrote it, with the remedy.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from planner.flight.plan import FlownLeg, Plan
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.search.problem import Problem
from planner.search.result import SearchResult

ROUNDING_S = ROUNDING_M = 1e-6
BY_PLAN = "planner.plan_of_legs and its like make plans that a UAV can fly"


def fault_of(problem: Problem, made: Any) -> str | None:
    """Return what is wrong with what a planner has returned for a problem, None if nothing is."""
    return next(_faults(problem, made), None)


def _faults(problem: Problem, made: Any) -> Iterator[str]:
    if not isinstance(made, SearchResult):
        yield f"returned {_kind(made)}, no SearchResult; return SearchResult(plan)"
        return
    if not isinstance(made.plan, Plan):
        yield f"returned a SearchResult of {_kind(made.plan)}, no Plan; {BY_PLAN}"
        return
    plan = made.plan
    if len(plan.tracks) != 1 or len(plan.legs) != 1:
        yield (
            f"returned {len(plan.tracks)} tracks and {len(plan.legs)} lists of legs for one UAV; "
            f"return one of each; {BY_PLAN}"
        )
        return
    yield from _track_faults(problem, plan.tracks[0])
    yield from _leg_faults(problem, plan.legs[0], plan.tracks[0])
    yield from _sensor_faults(problem, plan.legs[0], plan.tracks[0])


def _kind(thing: Any) -> str:
    name = type(thing).__name__
    return "None" if thing is None else f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"


def _track_faults(problem: Problem, track: Track) -> Iterator[str]:
    """Yield in what a track is none of the problem's UAV."""
    if not isinstance(track, Track):
        yield f"returned {_kind(track)} for a track; {BY_PLAN}"
        return
    if len(track.time_s) == 0:
        yield f"returned a track without waypoints; {BY_PLAN}"
        return
    uav, at = problem.uav, problem.start
    begins = (uav.take_off_s, uav.x_m, uav.y_m) if at is None else (at.time_s, at.x_m, at.y_m)
    first = (float(track.time_s[0]), float(track.x_m[0]), float(track.y_m[0]))
    if not np.allclose(first, begins, rtol=0.0, atol=ROUNDING_M):
        yield (
            f"begins at {_at(first)}, but the search begins at {_at(begins)}; start from "
            "problem.first_state"
        )
    yield from _speed_faults(uav, track)
    if track.end_s > uav.landing_s + ROUNDING_S:
        yield (
            f"is in the air until {track.end_s:,.1f} s, and the UAV has to land by "
            f"{uav.landing_s:,.1f} s; choose legs by planner.candidate_legs"
        )
    last = (float(track.x_m[-1]), float(track.y_m[-1]))
    home, flies = uav.return_to_m, len(track.time_s) > 1
    if home is not None and flies and not np.allclose(last, home, rtol=0.0, atol=1e-3):
        yield f"ends at {last[0]:,.1f}, {last[1]:,.1f} m, not where the UAV lands; {BY_PLAN}"


def _speed_faults(uav: Uav, track: Track) -> Iterator[str]:
    """Yield where a track is faster than its UAV can be over ground."""
    most_mps = uav.fastest.speed_mps
    metres = np.hypot(np.diff(track.x_m), np.diff(track.y_m))
    seconds = np.diff(track.time_s)
    fast = np.flatnonzero(metres > most_mps * seconds * (1.0 + 1e-9) + 1e-3)
    if len(fast):
        k = int(fast[0])
        yield (
            f"flies {metres[k]:,.1f} m in {seconds[k]:,.1f} s at {track.time_s[k]:,.1f} s, faster "
            f"than the UAV's {most_mps:g} m/s; {BY_PLAN}"
        )


def _leg_faults(problem: Problem, legs: tuple[FlownLeg, ...], track: Track) -> Iterator[str]:
    """Yield the first leg that is none of the problem's, or is flown when nobody flies."""
    for flown in legs:
        if not isinstance(flown, FlownLeg) or not 0 <= flown.leg < len(problem.legs):
            yield f"names a leg that is not there ({flown}); legs are 0 to {len(problem.legs) - 1}"
            return
        times = (track.time_s[0], flown.depart_s, flown.start_s, flown.end_s, track.end_s)
        if not all(a <= b + ROUNDING_S for a, b in pairwise(times)):
            yield f"flies leg {flown.leg} outside of its own track; {BY_PLAN}"
            return


def _sensor_faults(problem: Problem, legs: tuple[FlownLeg, ...], track: Track) -> Iterator[str]:
    """Yield when a sensor is on that has to be off."""
    on = track.sensor_on
    if len(on) == 0:
        return
    if on[0, 0] < track.time_s[0] - ROUNDING_S or on[-1, 1] > track.end_s + ROUNDING_S:
        yield f"has its sensor on before or after its flight; {BY_PLAN}"
    elif not problem.sensor.detects_in_transit and not _along(track, legs):
        yield f"has its sensor on off the roads, where this one sees nothing; {BY_PLAN}"


def _along(track: Track, legs: tuple[FlownLeg, ...]) -> bool:
    """Tell whether a sensor is on along roads, or where the UAV waits, and nowhere else."""
    stays = (np.diff(track.x_m) == 0.0) & (np.diff(track.y_m) == 0.0)
    waits = zip(track.time_s[:-1][stays], track.time_s[1:][stays], strict=True)
    allowed = [*((one.start_s, one.end_s) for one in legs), *waits]
    on = track.sensor_on
    spare_s = ROUNDING_S * (1 + len(allowed))
    is_short = np.sum(np.diff(on)) <= sum(to_s - from_s for from_s, to_s in allowed) + spare_s
    return bool(is_short) and all(
        any(from_s - ROUNDING_S <= begins_s <= to_s + ROUNDING_S for from_s, to_s in allowed)
        for begins_s in on[:, 0].tolist()
    )


def _at(where: tuple[float, float, float]) -> str:
    time_s, x_m, y_m = where
    return f"{x_m:,.1f}, {y_m:,.1f} m at {time_s:,.1f} s"
