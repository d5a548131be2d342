"""Certificates of stored plans: on their own particles, and on other, independent ones."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from planner.arrays import Floats
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.intervals import lower_limit
from planner.mission.opening import OpenScenario
from planner.mission.planning import problem_of
from planner.mission.recorder import Recorder
from planner.search.problem import Problem


def problem_of_plan(opened: OpenScenario, plan: Plan, futures: Futures) -> Problem:
    """Return the problem that a plan answers: its UAVs take off when they do in the plan."""
    problem = problem_of(opened, futures)
    first_s = {number: uav.take_off_s for number, uav in enumerate(problem.uavs)}
    for flight, track in reversed(list(zip(plan.flights, plan.tracks, strict=True))):
        first_s[flight.uav] = float(track.time_s[0])
    uav, *others = (
        replace(uav, take_off_s=first_s[number]) for number, uav in enumerate(problem.uavs)
    )
    return problem.replace(uav=uav, others=tuple(others))


def refuse_unprovable(opened: OpenScenario, plan: Plan) -> None:
    """Do nothing if files can prove a plan's bound: each UAV flies once, from the ground.

    Raises
    ------
    NotApplicableError
        If one flies more than once, or is in the air when the plan begins.
    """
    if any(uav.in_air is not None for uav in opened.scenario.uavs):
        raise NotApplicableError(
            "there is no certificate yet for a flight that goes on in the air; certify the run "
            "that it was planned anew from"
        )
    if len({flight.uav for flight in plan.flights}) < len(plan.flights):
        raise NotApplicableError("there is no bound yet for UAVs that fly more than once")


def bounds_of_sets(
    recorder: Recorder, plan: Plan, sets: int, bound: Callable[[Problem], float | None]
) -> Floats:
    """Return the bounds for so many independent sets of particles.

    Parameters
    ----------
    bound
        Bounds all plans of the plan's class on a problem; None ends it early.
    """
    bounds: list[float] = []
    for number in range(sets):
        futures = recorder.bounding(number).futures
        found = bound(problem_of_plan(recorder.opened, plan, futures))
        if found is None:
            break
        bounds.append(found)
    return np.array(bounds)


def limit_of(bounds: Floats, by_s: float | None) -> float:
    """Return the 95 % confidence limit of the true optimum that bounds of many sets give."""
    return lower_limit(bounds) if by_s is None else -lower_limit(-bounds)
