"""The best plan that the work buys: exact where that is possible, else ever wider beams, polished.

With free movement allowed, the best order of roads is where it starts from.

Orders are made on the problem's particles and chosen between on its holdout, other particles that
had no part in making them. What the plan is worth is for a third, fresh set to say.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner.flight.plan import Plan
from planner.search.anneal_waypoints import anneal_waypoints, waypoints_of
from planner.search.beam import RewardToGo, beam_of, beam_order, holdout_value, near_m, random_order
from planner.search.exact import best_order
from planner.search.lns import polished
from planner.search.patrol import with_patrol
from planner.search.plan import needs_open_country, plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.rate import rate_order
from planner.search.result import SearchLog, SearchResult, TracePoint
from planner.search.what_if import WhatIf

FEW_ROADS = 7  # of which the best order is found for certain
NARROW, NEAR, WIDER = 40, 4, 2  # widths of the first beams, along roads and between; growth
LAST = 3  # times the budget that beams may take; the last one begins within it, and is the widest
POLISH = 0.25  # share of a round's work that goes into polishing
ROADS = 0.1  # share of all work that goes into orders of roads before the movement gets free


def best(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the best plan found within the budget's work, about; or until it says stop.

    Raises
    ------
    NotApplicableError
        If the budget allows free movement, and the sensor only looks along roads.
    """
    if not budget.free:
        return _best_over_roads(problem, budget, rng)
    needs_open_country(problem, "free movement")
    work = int(ROADS * budget.work)
    roads = _best_over_roads(problem, budget.part(work), rng)
    left, start = budget.part(budget.work - work, after=work), waypoints_of(problem, roads.plan)
    return _better(
        problem, roads, anneal_waypoints(problem, budget=left, rng=rng, start=start), work
    )


def _better(
    problem: Problem, roads: SearchResult, freed: SearchResult, before: int
) -> SearchResult:
    """Return the better plan on the holdout particles, and what both searches did for it.

    Parameters
    ----------
    before
        Units of work after which the movement got free.
    """
    plans = (roads.plan, replace(freed.plan, method="best"))
    chosen = max(plans, key=lambda plan: holdout_value(problem, plan))
    work = roads.work if freed.work is None else before + freed.work
    value = problem.objective.value(holdout_value(problem, chosen))
    trace = (*roads.trace, TracePoint(work or 0, value))
    return SearchResult(chosen, work, roads.stopped or freed.stopped, trace)


def _best_over_roads(problem: Problem, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the plan that does best on the holdout of those that the budget's work buys."""
    log = SearchLog(problem, budget)
    chosen, value, done = None, -np.inf, 0
    for plan, work in _road_plans(problem, budget, rng, log):
        done += work
        worth = holdout_value(problem, plan)
        if worth > value:
            chosen, value = plan, worth
        log.reached(value, done)
        if done >= budget.work or log.stop():
            break
    assert chosen is not None
    return log.result(chosen)


def _road_plans(
    problem: Problem, budget: Budget, rng: np.random.Generator, log: SearchLog
) -> Iterator[tuple[Plan, int]]:
    """Yield plans of roads, each with the work that it took, until nothing new can be tried."""
    engine = WhatIf(problem)
    for order, work in _orders(engine, budget, rng, log):
        legs = with_patrol(problem, order, engine=engine)
        yield plan_of_legs(problem, "best", legs), work


def _orders(
    engine: WhatIf, budget: Budget, rng: np.random.Generator, log: SearchLog
) -> Iterator[tuple[Sequence[int], int]]:
    problem = engine.problem
    if len(problem.network.road_ids) <= FEW_ROADS:
        yield best_order(problem, len(problem.network.road_ids))[0], 0
    order: Sequence[int] = rate_order(engine)
    yield order, 0
    yield random_order(problem, budget, rng), 0
    growth, before, spent, left = 1, 0, 1, LAST * budget.work
    # A wider beam that flies no more than the one before has little left to try.
    while spent > before:
        reward_to_go, before, spent = RewardToGo.of(problem, order), spent, 0
        near = beam_of(problem, NEAR * growth, near_m(problem))
        for beam in (near, beam_of(problem, NARROW * growth)):
            order, work = beam_order(engine, beam, reward_to_go, stop=log.stop, most=left)
            spent += work
            left -= work
            yield order, work
        share = max(1, int(POLISH * spent))
        yield polished(engine, order, share, rng, stop=log.stop), share
        growth *= WIDER
