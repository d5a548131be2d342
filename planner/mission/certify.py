"""Certificates of stored plans: on their own particles, and on other, independent ones."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Floats
from planner.bounds.certificate import Certificate, Effort, certified
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.intervals import lower_limit
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder, problem_of
from planner.search.problem import Problem

Told = Callable[[int, float, float, float], None]  # step, value, bound, gap


@dataclass(frozen=True)
class Limits:
    """When certifying ends."""

    gap: float
    steps: int
    seconds: float  # for each set of particles
    asked: Callable[[], bool]


def problem_of_plan(opened: OpenScenario, plan: Plan, futures: Futures) -> Problem:
    """Return the problem that a plan answers: it takes off when the plan does."""
    problem = problem_of(opened, futures)
    take_off_s = float(plan.tracks[0].time_s[0])
    return problem.replace(uav=replace(problem.uav, take_off_s=take_off_s))


def certify(problem: Problem, plan: Plan, limits: Limits, told: Told | None = None) -> Certificate:
    """Return the certificate of a plan on a problem's particles."""
    until_s = time.monotonic() + limits.seconds

    def stop() -> bool:
        return limits.asked() or time.monotonic() > until_s

    return certified(problem, plan, Effort(limits.gap, limits.steps, stop, told))


def bounds_of_sets(
    recorder: Recorder, plan: Plan, limits: Limits, sets: int, told: Callable[[int], None]
) -> Floats:
    """Return the bounds for so many independent sets of particles, fewer if asked to end."""
    bounds: list[float] = []
    for number in range(sets):
        if limits.asked():
            break
        futures = recorder.bounding(number).futures
        problem = problem_of_plan(recorder.opened, plan, futures)
        bounds.append(certify(problem, plan, limits).bound)
        told(number + 1)
    return np.array(bounds)


def limit_of(bounds: Floats, by_s: float | None) -> float:
    """Return the 95 % confidence limit of the true optimum that bounds of many sets give."""
    return lower_limit(bounds) if by_s is None else -lower_limit(-bounds)
