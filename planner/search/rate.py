"""Gain per second of flight: the leg that earns most for its time, then the next."""

import numpy as np

from planner.search.fastest import fastest_gain
from planner.search.patrol import with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.stepwise import stepwise
from planner.search.what_if import WhatIf


def rate(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan that always flies the leg with the greatest gain per second of flight.

    Roads are flown in both directions and may be flown again, until the horizon: it is time that
    bounds the plan, not the budget's roads. Ties go to the lowest leg index.
    """
    engine = WhatIf(problem)
    return SearchResult(
        plan_of_legs(problem, "rate", with_patrol(problem, rate_order(engine), engine=engine))
    )


def rate_order(engine: WhatIf) -> tuple[int, ...]:
    """Return the legs that ``rate`` flies before its patrol."""
    return stepwise(engine, engine.problem.first_state, fastest_gain).order
