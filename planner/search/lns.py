"""Large neighbourhood search: cut a road order at a random place, and find a better way on.

What a leg sees depends on when it is flown, so an order cannot be mended in its middle without
shifting all that follows. What follows a cut is therefore found anew by a narrow beam, from the
state in which the cut leaves the search.
"""

from collections.abc import Callable, Sequence

import numpy as np

from planner.search.beam import BUCKET_S, Beam, RewardToGo, beam_order, bucket_s, is_small, near_m
from planner.search.patrol import with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.rate import rate_order
from planner.search.result import SearchLog, SearchResult
from planner.search.sightings import earned
from planner.search.state import SearchState
from planner.search.stepwise import after_flight
from planner.search.what_if import WhatIf

WIDTHS = (2, 20)  # of the beams that repair, drawn anew for each cut
REPAIR = 1500  # units of work that a repair takes beside its flights
REPAIRS = 20  # that the work suffices for at least, in nets where one would never come to an end


def lns(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the plan of ``rate``, polished by as many repairs as the budget's work allows."""
    engine, log = WhatIf(problem), SearchLog(problem, budget)
    first = rate_order(engine)
    order = polished(engine, first, budget.work, rng, stop=log.stop, reached=log.reached)
    return log.result(plan_of_legs(problem, "lns", with_patrol(problem, order, engine=engine)))


def polished(
    engine: WhatIf,
    order: Sequence[int],
    work: int,
    rng: np.random.Generator,
    *,
    stop: Callable[[], bool],
    reached: Callable[[float, int], None] | None = None,
) -> Sequence[int]:
    """Return an order with at least the reward of the given one on the problem's particles.

    Parameters
    ----------
    work
        How many units the repairs may take.
    stop
        Asked before each repair, and while it searches.
    reached
        Given the reward and the work done after each repair.
    """
    problem, states = engine.problem, _states(engine, order)
    reward, done = _reward(problem, states[-1]), 0
    stretch = bucket_s(problem) / BUCKET_S
    share = work if is_small(problem) else max(REPAIR, work // REPAIRS)
    while done < work and len(order) > 1 and not stop():
        cut = int(rng.integers(len(order)))
        reach_m = float(rng.choice([0.0, 0.5, 1.0])) * near_m(problem)
        width, lasts_s = int(rng.integers(*WIDTHS)), stretch * float(rng.uniform(25.0, 100.0))
        beam = Beam(width, reach_m, lasts_s)
        reward_to_go = RewardToGo.of(problem, order)
        rest, flights = beam_order(
            engine,
            beam,
            reward_to_go,
            start=states[cut],
            stop=stop,
            most=min(share, work - done),
        )
        done += REPAIR + flights
        repaired = [*order[:cut], *rest]
        after = _states(engine, rest, states[cut])
        now = _reward(problem, after[-1])
        if now > reward:
            order, states, reward = repaired, [*states[:cut], *after], now
        if reached:
            reached(reward, done)
    return order


def _states(
    engine: WhatIf, order: Sequence[int], start: SearchState | None = None
) -> list[SearchState]:
    """Return the states before each leg of an order and after the last one."""
    states = [start or engine.problem.first_state]
    for leg in order:
        flights = engine.fly(states[-1], np.array([leg]))
        states.append(after_flight(engine.problem, states[-1], flights, 0))
    return states


def _reward(problem: Problem, state: SearchState) -> float:
    """Return the expected reward of the order that has led to a state."""
    if problem.sensor.is_perfect and not problem.flown:
        return float(problem.weight_at_start @ problem.objective.reward(state.seen_at))
    plan = plan_of_legs(problem, "lns", state.order)
    return earned(problem, plan, problem.futures, problem.weight_at_start)
