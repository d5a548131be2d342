"""The best plan that the work buys: exact where that is possible, else ever wider beams, polished.

Orders are made on the problem's particles and chosen between on its judges, other particles that
had no part in making them. What the plan is worth is for a third, fresh set to say.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner.search.beam import Beam, Outlook, beam_order, judged, near_m
from planner.search.exact import best_order
from planner.search.lns import polished
from planner.search.plan import Plan, plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.rate import rate_order
from planner.search.tail import with_tail
from planner.search.what_if import WhatIf

FEW_ROADS = 7  # of which the best order is found for certain
NARROW, NEAR, WIDER = 10, 2, 2  # widths of the first beams, along roads and between; growth
POLISH = 0.25  # share of a round's work that goes into polishing


def best(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> Plan:
    """Return the best plan found within the budget's work; an interrupt ends the search with it.

    Raises
    ------
    KeyboardInterrupt
        If there is no plan yet.
    """
    engine = WhatIf(problem)
    chosen, value, done = None, -np.inf, 0
    try:
        for order, work in _proposals(engine, budget, rng):
            plan = plan_of_legs(problem, "best", with_tail(problem, order, engine=engine))
            done += work
            worth = judged(problem, plan)
            if worth > value:
                chosen, value = plan, worth
            if budget.told:
                budget.told(problem.objective.value(value), done)
            if done >= budget.work or budget.stop():
                break
    except KeyboardInterrupt:
        if chosen is None:
            raise
    assert chosen is not None
    return chosen


def _proposals(
    engine: WhatIf, budget: Budget, rng: np.random.Generator
) -> Iterator[tuple[Sequence[int], int]]:
    """Yield road orders without end, each with the work that it took."""
    problem = engine.problem
    if len(problem.network.road_ids) <= FEW_ROADS:
        yield best_order(problem, len(problem.network.road_ids))[0], 0
    order: Sequence[int] = rate_order(engine)
    yield order, 0
    growth, before = 1, 0
    while True:
        outlook, spent = Outlook.of(problem, order), 0
        if growth:
            for beam in (Beam(NEAR * growth, near_m(problem)), Beam(NARROW * growth)):
                order, work = beam_order(engine, beam, outlook, stop=budget.stop)
                spent += work
                yield order, work
        # A wider beam that grows no more orders has grown them all.
        growth, before = (growth * WIDER, spent) if spent > before else (0, before)
        share = max(1, int(POLISH * before))
        order = polished(engine, order, replace(budget, work=share, told=None), rng)
        yield order, share
