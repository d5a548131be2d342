"""The best plan that the work buys: exact where that is possible, else ever wider beams, polished.

With free movement allowed, the best order of roads is where it starts from.

Orders are made on the problem's particles and chosen between on its holdout, other particles that
had no part in making them. What the plan is worth is for a third, fresh set to say.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner.flight.plan import Plan
from planner.search.anneal_waypoints import anneal_waypoints, waypoints_of
from planner.search.beam import Beam, RewardToGo, beam_order, holdout_value, near_m
from planner.search.exact import best_order
from planner.search.lns import polished
from planner.search.patrol import with_patrol
from planner.search.plan import needs_open_country, plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.rate import rate_order
from planner.search.what_if import WhatIf

FEW_ROADS = 7  # of which the best order is found for certain
NARROW, NEAR, WIDER = 40, 4, 2  # widths of the first beams, along roads and between; growth
POLISH = 0.25  # share of a round's work that goes into polishing
ROADS = 0.1  # share of all work that goes into orders of roads before the movement gets free


def best(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> Plan:
    """Return the best plan found within the budget's work, about; or until it says stop.

    Raises
    ------
    NotApplicableError
        If the budget allows free movement, and the sensor only looks along roads.
    """
    if not budget.free:
        return _choice(problem, _road_plans(problem, budget, rng), budget)
    needs_open_country(problem, "free movement")
    roads = replace(budget, work=int(ROADS * budget.work), free=False)
    chosen = best(problem, budget=roads, rng=rng)
    left = replace(budget, work=budget.work - roads.work, told=_after(budget, roads.work))
    start = waypoints_of(problem, chosen)
    freed = anneal_waypoints(problem, budget=left, rng=rng, start=start)
    return max(chosen, replace(freed, method="best"), key=lambda plan: holdout_value(problem, plan))


def _after(budget: Budget, done: int) -> Callable[[float, int], None]:
    """Return what hears of work that comes after some that is done."""

    def told(value: float, more: int) -> None:
        if budget.told:
            budget.told(value, done + more)

    return told


def _choice(problem: Problem, plans: Iterator[tuple[Plan, int]], budget: Budget) -> Plan:
    """Return the plan that does best on the holdout of those that the budget's work buys."""
    chosen, value, done = None, -np.inf, 0
    for plan, work in plans:
        done += work
        worth = holdout_value(problem, plan)
        if worth > value:
            chosen, value = plan, worth
        if budget.told:
            budget.told(problem.objective.value(value), done)
        if done >= budget.work or budget.stop():
            break
    assert chosen is not None
    return chosen


def _road_plans(
    problem: Problem, budget: Budget, rng: np.random.Generator
) -> Iterator[tuple[Plan, int]]:
    """Yield plans of roads, each with the work that it took, until nothing new can be tried."""
    engine = WhatIf(problem)
    for order, work in _orders(engine, budget, rng):
        legs = with_patrol(problem, order, engine=engine)
        yield plan_of_legs(problem, "best", legs), work


def _orders(
    engine: WhatIf, budget: Budget, rng: np.random.Generator
) -> Iterator[tuple[Sequence[int], int]]:
    problem = engine.problem
    if len(problem.network.road_ids) <= FEW_ROADS:
        yield best_order(problem, len(problem.network.road_ids))[0], 0
    order: Sequence[int] = rate_order(engine)
    yield order, 0
    growth, before, spent = 1, 0, 1
    # A wider beam that flies no more than the one before has little left to try.
    while spent > before:
        outlook, before, spent = RewardToGo.of(problem, order), spent, 0
        for beam in (Beam(NEAR * growth, near_m(problem)), Beam(NARROW * growth)):
            order, work = beam_order(engine, beam, outlook, stop=budget.stop)
            spent += work
            yield order, work
        share = max(1, int(POLISH * spent))
        yield polished(engine, order, replace(budget, work=share, told=None), rng), share
        growth *= WIDER
