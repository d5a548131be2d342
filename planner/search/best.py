"""The best plan that the work buys: exact where that is possible, else ever wider beams, polished.

With free movement allowed, the best order of roads competes with free flights behind many first
dashes; what is best then turns and hovers wherever that helps, if there is work left for it.

Orders are made on the problem's particles and chosen between on its holdout, other particles that
had no part in making them. What the plan is worth is for a third, fresh set to say.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.flight.plan import Plan
from planner.search.anneal_waypoints import anneal_waypoints, waypoints_of
from planner.search.beam import (
    Beam,
    RewardToGo,
    beam_of,
    beam_order,
    is_small,
    near_m,
    random_order,
)
from planner.search.cell_beam import free_plans
from planner.search.dashes import portfolio
from planner.search.exact import best_order
from planner.search.latency import is_latency, with_less_waiting
from planner.search.lns import polished
from planner.search.patrol import most_with_patrol, with_patrol
from planner.search.plan import needs_open_country, plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.rate import rate_order
from planner.search.result import SearchLog, SearchResult, TracePoint
from planner.search.sightings import holdout_value
from planner.search.what_if import WhatIf

FEW_ROADS = 7  # of which the best order is found for certain, if the sensor is perfect
NARROW, NEAR, WIDER = 40, 4, 2  # widths of the first beams, along roads and between; growth
LAST = 3  # times the budget that beams may take; the last one begins within it, and is the widest
# Of one more beam along roads, and the work from which on there is one. On the particles that it
# plans on its plans are up to 2 % better, on fresh targets by no more than chance: docs/methods.md.
WIDE, WIDE_FROM = 2560, 800_000
TOUR = 0.75  # share of all work that goes into a latency tour, where targets rest
ROUNDING = 1e-12  # of the most that can be earned: a plan better by no more is none
POLISH = 0.25  # share of a round's work that goes into polishing
# In dense nets, where near-twins fill a beam (the same roads in another order), how many orders of
# some beams for a sensor that may miss go on from the same node.
DIVERSE = 2
# Where the movement is free: shares of all work that go into orders of roads, before it, and on
# abstract nets, where roads are long, into the annealing of what is best, after it.
ROADS, POLISH_FREE = 0.1, 0.8


class Division(NamedTuple):
    """How the work is divided where a sensor may miss, between plans as if perfect and others.

    A plan as if it were perfect takes a tenth of the time per unit of work.
    """

    blind: float  # share of the work for plans as if perfect
    own: float  # for plans for the sensor there is
    by_exposure: bool  # whether ``own`` is per exposure of a pass
    first_width: int  # of the first beam, which only teaches the next what comes later
    least_growth: float  # of the next one's width: no less is worth the work
    most_growth: float  # and no more

    def own_work(self, work: int, detects: float) -> int:
        """Return how much of the work goes into plans for a sensor, by what a pass detects."""
        share = self.own
        if self.by_exposure:  # the less a pass sees, the longer a unit takes
            share *= -math.log(1.0 - min(max(detects, LEAST), MOST))
        return max(1, int(share * work))


# What passes detect on which the share of the work depends: beyond, it is as at these ends. At .3
# and .1, from 120 km, E is within .2 % of that behind a full plan as if perfect, in .7 of the time.
LEAST, MOST = 0.5, 0.97
# Tuned on grid5x5 alone, at detects .5, .7 and .9 from 60, 120 and 300 km: in at most three times
# the time of the perfect plan. Wider beams are worth more there than a plan as if perfect by all
# the work there is.
ALONG_ROADS = Division(0.25, 0.24, True, first_width=4, least_growth=2.0, most_growth=20.0)
# In dense nets, and wherever the movement is free.
ELSEWHERE = Division(1.0, 0.2, False, first_width=3, least_growth=8.0, most_growth=8.0)
WITHIN = 0.95  # of the work that is left a beam is to take: cut short, it is worth nothing


class ForMisses(NamedTuple):
    """What plans for a sensor that may miss start from."""

    division: Division
    known: Plan | None  # a plan to be better than


def best(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the best plan found within the budget's work, about; or until it says stop.

    With a sensor that may miss, a plan as if it were perfect competes with those made for it, so
    that these have to be better.

    Raises
    ------
    NotApplicableError
        If the budget allows free movement, and the sensor only looks along roads.
    """
    if problem.sensor.is_perfect:
        return _best(problem, budget, rng)
    division = _division(problem, budget)
    work = max(1, int(division.blind * budget.work))
    part = replace(budget.part(work), free=budget.free)
    blind = _best(problem.replace(sensor=problem.sensor.without_misses), part, rng)
    done = blind.work or 0
    work = division.own_work(budget.work, problem.sensor.detects(problem.uav.speed_mps))
    part = replace(budget.part(work, after=done), free=budget.free)
    own = _best(problem, part, rng, ForMisses(division, blind.plan))
    chosen = max((own, blind), key=lambda found: holdout_value(problem, found.plan))
    trace = tuple(TracePoint(done + point.work, point.value) for point in own.trace)
    return SearchResult(chosen.plan, done + (own.work or 0), blind.stopped or own.stopped, trace)


def _division(problem: Problem, budget: Budget) -> Division:
    return ALONG_ROADS if is_small(problem) and not budget.free else ELSEWHERE


def _best(
    problem: Problem, budget: Budget, rng: np.random.Generator, misses: ForMisses | None = None
) -> SearchResult:
    """Return the best plan found for a sensor, over roads or free; ``misses`` if it may miss."""
    if not budget.free:
        return _best_over_roads(problem, budget, rng, misses)
    needs_open_country(problem, "free movement")
    work = int(ROADS * budget.work)
    anew = misses and misses._replace(known=None)  # what is known may have left the roads
    roads = _best_over_roads(problem, budget.part(work), rng, anew)
    log = SearchLog(problem, budget)
    polish = int(POLISH_FREE * budget.work) if problem.network.is_abstract else 0
    flights, done = portfolio(problem, budget.work - work - polish, stop=log.stop)
    plans = [roads.plan, *free_plans(problem, flights, "best")]
    chosen = max(plans, key=lambda plan: holdout_value(problem, plan))
    done += roads.work or 0
    log.reached(holdout_value(problem, chosen), done)
    found = replace(log.result(chosen), trace=(*roads.trace, *log.trace))
    return _polished(problem, found, budget.part(polish, after=done), rng) if polish else found


def _polished(
    problem: Problem, found: SearchResult, budget: Budget, rng: np.random.Generator
) -> SearchResult:
    """Return the better of a plan and what annealing makes of it, on the holdout particles."""
    start, before = waypoints_of(problem, found.plan), found.work or 0
    made = anneal_waypoints(searched_on(problem), budget=budget, rng=rng, start=start)
    plans = (found.plan, replace(made.plan, method="best"))
    chosen = max(plans, key=lambda plan: holdout_value(problem, plan))
    work = before + (made.work or 0)
    value = problem.objective.value(holdout_value(problem, chosen))
    trace = (*found.trace, TracePoint(work, value))
    return SearchResult(chosen, work, found.stopped or made.stopped, trace)


def searched_on(problem: Problem) -> Problem:
    """Return a problem whose particles are the proposals, if there are any to be searched on."""
    if problem.proposals is None or problem.start is not None:
        return problem
    return problem.replace(futures=problem.proposals, proposals=None)


def _best_over_roads(
    problem: Problem, budget: Budget, rng: np.random.Generator, misses: ForMisses | None = None
) -> SearchResult:
    """Return the plan that does best on the holdout of those that the budget's work buys."""
    engine, log = WhatIf(problem), SearchLog(problem, budget)
    chosen, value, done = None, -np.inf, 0
    for order, work in _road_orders(engine, budget, rng, log, misses):
        done += work
        if most_with_patrol(problem, order) > value + ROUNDING * problem.objective.most:
            legs = with_patrol(problem, order, engine=engine)
            plan = plan_of_legs(problem, "best", legs)
            worth = holdout_value(problem, plan)
            if worth > value:
                chosen, value = plan, worth
        log.reached(value, done)
        if done >= budget.work or log.stop():
            break
    assert chosen is not None
    return log.result(chosen)


def _road_orders(
    engine: WhatIf,
    budget: Budget,
    rng: np.random.Generator,
    log: SearchLog,
    misses: ForMisses | None,
) -> Iterator[tuple[Sequence[int], int]]:
    """Yield orders of legs, each with the work that it took, until nothing new can be tried."""
    if misses is None:
        return _orders(engine, budget, rng, log)
    return _orders_for_misses(engine, budget, misses, log)


def _orders(
    engine: WhatIf, budget: Budget, rng: np.random.Generator, log: SearchLog
) -> Iterator[tuple[Sequence[int], int]]:
    problem = engine.problem
    if len(problem.network.road_ids) <= FEW_ROADS and not problem.flown:
        yield best_order(problem, len(problem.network.road_ids))[0], 0
    order: Sequence[int] = rate_order(engine)
    left, tour = LAST * budget.work, None
    if is_latency(problem):
        better, work = with_less_waiting(problem, order, int(TOUR * budget.work), rng)
        yield better, work
        if better != list(order):
            tour, left = better, budget.work - work
    yield order, 0
    order = tour or order
    yield random_order(problem, budget, rng), 0
    growth, before, spent = 1, 0, 1
    # A wider beam that flies no more than the one before has little left to try.
    while spent > before:
        reward_to_go, before, spent = RewardToGo.of(problem, order), spent, 0
        near = beam_of(problem, NEAR * growth, near_m(problem))
        for beam in (near, beam_of(problem, NARROW * growth)):
            order, work = beam_order(engine, beam, reward_to_go, stop=log.stop, most=left)
            spent += work
            left -= work
            yield tour if tour and left <= 0 else order, work  # cut short, it is no match for one
        share = max(1, int(POLISH * spent))
        yield polished(engine, order, share, rng, stop=log.stop), share
        if growth == 1 and budget.work >= WIDE_FROM:
            wide = beam_of(problem, WIDE)
            yield beam_order(engine, wide, reward_to_go, stop=log.stop, most=left)
        growth *= WIDER


def _orders_for_misses(
    engine: WhatIf, budget: Budget, misses: ForMisses, log: SearchLog
) -> Iterator[tuple[Sequence[int], int]]:
    """Yield orders for a sensor that may miss, by beams that get wider as long as the work lasts.

    Nobody drops out of these beams for having been seen once, so they end with the horizon alone.
    """
    problem, left, before = engine.problem, budget.work, 0
    division, known = misses
    width = division.first_width
    legs = [flown.leg for flown in known.legs[0]] if known is not None else []
    order: Sequence[int] = legs or rate_order(engine)
    yield order, 0
    while not log.stop():
        spent = 0
        for beam in _beams_for_misses(problem, width):
            reward_to_go = RewardToGo.of(problem, order)
            order, work = beam_order(engine, beam, reward_to_go, stop=log.stop, most=left - spent)
            spent += work
            if width > division.first_width:
                yield order, work
        left -= spent
        growth = min(division.most_growth, WITHIN * left / max(1, spent))
        # A wider beam that flies no more than the one before has little left to try.
        if growth < division.least_growth or spent <= before:
            break
        width = int(growth * width)
        before = spent
    if before == 0:
        yield order, budget.work - left


def _beams_for_misses(problem: Problem, width: int) -> list[Beam]:
    """Return beams of a width along roads, and in dense nets near ones, with and without a cap."""
    along = beam_of(problem, width)
    if is_small(problem):
        return [along]
    near = beam_of(problem, max(1, width // 2), near_m(problem))
    return [along, near, replace(near, per_node=DIVERSE)]
