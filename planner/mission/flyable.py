"""Plans for a real aircraft: searched at an even speed, timed by the law, the better one kept.

Planners fly at one speed and turn at once. A real aircraft gets round corners more slowly, so what
is planned for its full speed comes too late. The law says how much: the plan is made again for the
even speed that the first one turned out to have, and the better one of both, as flown, is taken.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from planner.detection.evaluate import evaluate
from planner.flight.airspace import Airspace
from planner.flight.as_flown import Battery, as_flown
from planner.flight.law import Aircraft
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.search.problem import Problem
from planner.search.result import SearchResult

SLOWEST = 0.3  # of its full speed, that a plan is made for


def planned_to_fly(search: Callable[[Problem], SearchResult], problem: Problem) -> SearchResult:
    """Return the best plan of a search as a real aircraft flies it.

    Parameters
    ----------
    search
        Makes a plan at an even speed.
    problem
        With an aircraft.
    """
    aircraft = problem.uav.aircraft
    assert aircraft is not None
    first = search(at_speed(problem, aircraft.law.speed_mps))
    flown = _flown(first, problem, aircraft, aircraft.law.speed_mps)
    speed = max(SLOWEST, _kept_up(first.plan, flown.plan)) * aircraft.law.speed_mps
    if speed >= aircraft.law.speed_mps:
        return flown
    again = _flown(search(at_speed(problem, speed)), problem, aircraft, speed)
    return max((flown, again), key=lambda one: _reward(problem, one.plan))


def at_speed(problem: Problem, speed_mps: float) -> Problem:
    """Return the problem of an aircraft that is at its height, and flies at an even speed."""
    uav = problem.uav
    assert uav.aircraft is not None
    law, kept_s = uav.aircraft.law, uav.aircraft.reserve_s
    lasts_s = uav.max_flight_time_s - law.climb_s - law.descend_s - kept_s
    even = replace(
        uav,
        take_off_s=uav.take_off_s + law.climb_s,
        speed_mps=speed_mps,
        max_flight_time_s=max(0.0, lasts_s),
        aircraft=None,
    )
    return problem.replace(uav=even)


def battery_of(uav: Uav, aircraft: Aircraft, airspace: Airspace | None = None) -> Battery:
    """Return how long an aircraft may be in the air, and where it has to be then."""
    lasts_s, home_m = uav.max_flight_time_s, uav.return_to_m
    return Battery(lasts_s, aircraft.reserve_s, home_m, aircraft.headwind_mps, airspace)


def _flown(
    found: SearchResult, problem: Problem, aircraft: Aircraft, planned_mps: float
) -> SearchResult:
    battery = battery_of(problem.uav, aircraft, problem.airspace)
    return replace(found, plan=as_flown(found.plan, aircraft.law, battery, planned_mps=planned_mps))


def _kept_up(planned: Plan, flown: Plan) -> float:
    """Return the speed that a plan turned out to have, as a share of what it was made for."""
    away = [float(np.hypot(np.diff(track.x_m), np.diff(track.y_m)).sum()) for track in flown.tracks]
    up_s = [float(np.ptp(track.sensor_on)) for track in flown.tracks]
    meant = [float(np.hypot(np.diff(t.x_m), np.diff(t.y_m)).sum()) for t in planned.tracks]
    meant_s = [track.end_s - float(track.time_s[0]) for track in planned.tracks]
    if not sum(away) or not sum(meant):
        return 1.0
    return (sum(away) / sum(up_s)) / (sum(meant) / sum(meant_s))


def _reward(problem: Problem, plan: Plan) -> float:
    """Return what a plan earns on particles that had no part in it, or on its own."""
    futures = problem.holdout or problem.futures
    seen = evaluate(plan.tracks, futures, problem.sensor, problem.objective).seen_at
    return float(futures.weight @ problem.objective.reward(seen))
