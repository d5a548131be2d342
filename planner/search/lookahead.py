"""Two legs ahead: the leg that begins the pair with the greatest gain per second of flight."""

import numpy as np

from planner.search.fastest import Before, Unseen, fly_fastest
from planner.search.patrol import with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.state import SearchState
from planner.search.stepwise import (
    after_flight,
    first_fastest,
    rate_of,
    stepwise,
    toward_next,
)
from planner.search.what_if import WhatIf

FIRST_LEGS = 8  # of which second legs are tried: those that earn most per second by themselves


def lookahead(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan that always flies the first leg of the pair that earns most per second.

    Roads are flown in both directions and may be flown again, until the horizon: it is time that
    bounds the plan, not the budget's roads. Pairs begin with the ``FIRST_LEGS`` legs that earn
    most per second by themselves, and go on with any. Ties go to the lowest leg index.
    """
    flown = stepwise(WhatIf(problem), problem.first_state, fastest_pair)
    return SearchResult(plan_of_legs(problem, "lookahead", with_patrol(problem, flown.order)))


def fastest_pair(engine: WhatIf, state: SearchState) -> SearchState | None:
    """Return the state after the first leg of the fastest pair, or nearer to what is unseen."""
    problem = engine.problem
    flights, gained = fly_fastest(Unseen(engine, state), count=FIRST_LEGS)
    if not gained.any():
        return toward_next(engine, state)
    rates = rate_of(gained, flights.end_s - state.time_s)
    firsts = np.sort(np.argsort(-rates, kind="stable")[:FIRST_LEGS])
    reached = [after_flight(problem, state, flights, int(first)) for first in firsts]
    pairs = [
        _fastest_on(engine, after, gained[first], state.time_s)
        for first, after in zip(firsts, reached, strict=True)
    ]
    return reached[first_fastest(problem, np.maximum(rates[firsts], pairs))]


def _fastest_on(engine: WhatIf, state: SearchState, gained: float, since_s: float) -> float:
    """Return the most that can be earned per second with one leg more, from a time on."""
    flights, more = fly_fastest(Unseen(engine, state), before=Before(gained, since_s))
    rates = rate_of(gained + more, flights.end_s - since_s)
    return float(rates.max(initial=0.0))
