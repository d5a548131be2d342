"""Beam search: many road orders grow side by side; those of about the same time compete.

Orders with equally many roads end at very different times and cannot be compared; orders that end
at about the same time can. From each stretch of time only the most promising go on: those whose
reward so far, with what the particles still unseen at that time usually bring, is greatest.
"""

import math
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Ints
from planner.flight.track import Track
from planner.search.fastest import FEW
from planner.search.kernels.beam import (
    BEST,
    END,
    FLIGHTS,
    LEG,
    NEXT,
    PARENT,
    PROMISE,
    REWARD,
    UNSEEN,
    BeamSetting,
    BeamStates,
    Bucket,
    FirstSeen,
    LegEnds,
    Limits,
    ToGo,
    grow_on,
    promise,
)
from planner.search.patrol import with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem, candidate_legs
from planner.search.random_order import random
from planner.search.rate import rate_order
from planner.search.result import SearchLog, SearchResult
from planner.search.sightings import holdout_value, seen_by
from planner.search.state import SearchState
from planner.search.stepwise import rate_of
from planner.search.stop import never
from planner.search.ways import ways_within
from planner.search.what_if import WhatIf, turning_of

# Tuned on grid5x5 alone, whose roads take 150 s to fly.
NEAR_ROADS = 2.1
BUCKET_S, ROADS_PER_BUCKET = 50.0, 0.5  # a bucket's length, and the most of it in usual roads
STEPS_PER_BUCKET = 2  # of the reward to go
BUCKETS = 200  # in which a beam keeps the width it is given; it is narrower where there are more
FLIGHTS_PER_WIDTH = 700  # of both beams together, per unit of width, about

# In nets with more than a few legs, held by `tools/benchmark.py --search-towns`.
NEAR_RADII = 6.7  # a near flight in detection radii: streets lie side by side
FLIGHTS_PER_UNIT = 4  # of work: short legs see few
ALONG = 0.25  # share of the work for the beam along roads only
FIRST_LEGS = 128  # of more than a few, the most promising ones that orders begin with
RANDOM_ORDERS = 8  # that a beam has to beat
BETWEEN_STOPS = 2000  # flights, some ten milliseconds: so often a beam is asked to stop


ANY = 2**31  # orders from one node: as many as there are


@dataclass(frozen=True)
class Beam:
    """How a beam searches."""

    width: int  # orders that go on from each stretch of time
    reach_m: float = 0.0  # longest flight to the start of the next road; 0: it starts here
    bucket_s: float = BUCKET_S  # length of a stretch of time
    per_node: int = ANY  # of those that go on, at most so many from the same node


@dataclass(frozen=True, eq=False)
class RewardToGo:
    """What unseen particles usually bring from a time on, learned from a plan's sightings."""

    brings: Floats  # (B,) reward per unit of weight
    first_s: float  # seconds, the first entry's time
    step_s: float  # seconds from entry to entry

    @classmethod
    def of(cls, problem: Problem, order: Sequence[int]) -> "RewardToGo":
        """Return what the sightings of a road order have brought after each time."""
        return cls.of_flights(problem, plan_of_legs(problem, "", order).tracks)

    @classmethod
    def of_flights(cls, problem: Problem, tracks: Sequence[Track]) -> "RewardToGo":
        """Return what the sightings of flights together have brought after each time."""
        step_s = bucket_s(problem) / STEPS_PER_BUCKET
        seen = seen_by(problem, tracks, problem.futures, problem.weight_at_start)
        first_s = problem.first_state.time_s
        times = np.arange(first_s, problem.objective.ends_s + 2 * step_s, step_s)
        return cls(seen.brings(times), float(first_s), step_s)


def beam(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the plan of the best of two beams, one along roads only, one with flights between.

    The budget's work sets their width. The order of `rate` and some random ones compete with them;
    which is best, the problem's holdout says. A patrol goes on after its end.
    """
    engine, log = WhatIf(problem), SearchLog(problem, budget)
    by_rate = rate_order(engine)
    reward_to_go, width = RewardToGo.of(problem, by_rate), budget.work // FLIGHTS_PER_WIDTH
    beams = (beam_of(problem, width), beam_of(problem, width // 10, near_m(problem)))
    orders: list[Sequence[int]] = []
    done = 0
    for number, one in enumerate(beams):
        left = budget.work - done
        most = left if is_small(problem) or number else int(ALONG * left)
        order, work = beam_order(engine, one, reward_to_go, stop=log.stop, most=most)
        orders.append(order)
        done += work
    orders += [by_rate, random_order(problem, budget, rng)]
    plans = [
        plan_of_legs(problem, "beam", with_patrol(problem, order, engine=engine))
        for order in orders
    ]
    chosen = max(plans, key=lambda plan: holdout_value(problem, plan))
    log.reached(holdout_value(problem, chosen), done)
    return log.result(chosen)


def bucket_s(problem: Problem) -> float:
    """Return the length of a beam's stretch of time, seconds: it fits the roads, if they are short.

    Orders that end within a stretch never go on to one another, so it must not hold many roads.
    """
    return min(BUCKET_S, ROADS_PER_BUCKET * float(np.median(problem.legs.duration_s)))


def beam_of(problem: Problem, width: int, reach_m: float = 0.0) -> Beam:
    """Return a beam of that width; of a smaller one where short roads make for many buckets."""
    lasts_s = bucket_s(problem)
    buckets = (problem.objective.ends_s - problem.first_state.time_s) / lasts_s
    return Beam(max(1, int(width / max(1.0, buckets / BUCKETS))), reach_m, lasts_s)


def random_order(problem: Problem, budget: Budget, rng: np.random.Generator) -> tuple[int, ...]:
    """Return the best of some random road orders; the first is what `random` would fly.

    They are drawn by a copy of the stream, so that they shift no other draws.
    """
    own = deepcopy(rng)
    plans = [random(problem, budget=budget, rng=own).plan for _ in range(RANDOM_ORDERS)]
    (legs,) = max(plans, key=lambda plan: holdout_value(problem, plan)).legs
    return tuple(leg.leg for leg in legs)


def near_m(problem: Problem) -> float:
    """Return how far a beam may fly to the start of a next road, metres.

    That is two roads of usual length, or what is near for the sensor where roads are short.
    """
    roads_m = NEAR_ROADS * float(np.median(problem.network.road_length_m))
    return max(roads_m, NEAR_RADII * float(problem.sensor.radius_m))


def beam_order(
    engine: WhatIf,
    beam: Beam,
    reward_to_go: RewardToGo,
    *,
    start: SearchState | None = None,
    stop: Callable[[], bool] = never,
    most: float = math.inf,
) -> tuple[list[int], int]:
    """Return the order with the greatest reward that a beam finds, and the work it took.

    The order is one of leg indices.

    Parameters
    ----------
    start
        Where the orders start; before take-off if not given.
    stop
        Asked often, between stretches of time; once it says so, the best order so far is returned.
    most
        After how many units of work that is returned too: what-if flights, or four of the short
        ones of a large net.
    """
    problem = engine.problem
    start = start or problem.first_state
    to_go = ToGo(reward_to_go.brings, reward_to_go.first_s, reward_to_go.step_s)
    states, flown = _first_states(engine, beam, start, to_go)
    setting, small = beam_setting(engine, beam.reach_m), is_small(problem)
    per_unit = 1 if small else FLIGHTS_PER_UNIT
    narrow = math.inf if small else most * per_unit
    bucket = Bucket(0, beam.width, beam.per_node, start.time_s, beam.bucket_s)
    while bucket.number < len(states.heads):
        flights = int(states.counts[FLIGHTS])
        if flights >= most * per_unit or stop():
            break
        limits = Limits(narrow, min(most * per_unit, flights + BETWEEN_STOPS))
        bucket, states = grow_on(bucket, limits, states, setting, to_go, flown)
    order, state = [], int(states.counts[BEST])
    while state >= 0:
        order.append(int(states.links[LEG, state]))
        state = int(states.links[PARENT, state])
    return order[::-1], int(states.counts[FLIGHTS]) // per_unit


def is_small(problem: Problem) -> bool:
    """Tell whether all legs are tried wherever legs are chosen, and beams end by themselves.

    In a town targets get away, and nothing tells a beam that it cannot get better any more.
    """
    return len(problem.legs) <= FEW


def _first_states(
    engine: WhatIf, beam: Beam, start: SearchState, to_go: ToGo
) -> tuple[BeamStates, FirstSeen]:
    """Return an order of one leg for each that can be flown first, and what they see."""
    problem, unseen = engine.problem, start.miss > 0.0
    flights = engine.fly(start, _first_legs(engine, beam, start))
    known = len(flights.leg)
    weight = problem.futures.weight * start.miss
    looked_for = weight[flights.particle]
    links = np.full((4, known), -1, dtype=np.int32)
    figures = np.zeros((4, known))
    links[LEG], figures[END] = flights.leg, flights.end_s
    figures[REWARD] = flights.per_flight(looked_for * flights.worth)
    figures[UNSEEN] = weight[unseen].sum() - flights.per_flight(looked_for * flights.share)
    for state in figures.T:
        state[PROMISE] = promise(state[END], state[REWARD], state[UNSEEN], to_go)
    heads = _buckets(problem, beam, start.time_s, links, figures)
    masks: Ints = np.empty((64, bytes_of(problem, start.miss)), dtype=np.uint8)
    best = int(np.argmax(figures[REWARD])) if known else -1
    counts = np.array([known, 0, best, known])  # KNOWN, SLOTS, BEST, FLIGHTS
    first = flights.first.astype(np.int64)
    flown = FirstSeen(first, flights.particle, flights.share, start.miss)
    return BeamStates(links, figures, masks, heads, counts), flown


def bytes_of(problem: Problem, miss: Floats) -> int:
    """Return how many bytes it takes to note who is unseen: one bit each, or two bytes if in part.

    Parameters
    ----------
    miss
        Probability that each particle is unseen when a search begins, (N,).
    """
    is_sharp = problem.sensor.is_perfect and bool(np.all((miss == 0.0) | (miss == 1.0)))
    return (len(miss) + 7) // 8 if is_sharp else 2 * len(miss)


def _first_legs(engine: WhatIf, beam: Beam, start: SearchState) -> Ints:
    """Return the legs that orders begin with, (C,): of many those near, and the most promising."""
    problem = engine.problem
    legs = candidate_legs(problem, start)
    if is_small(problem):
        return legs
    transit_s = problem.legs.transit_s(start.x_m, start.y_m)[legs]
    most = engine.ceilings(start, legs, problem.futures.weight * start.miss)
    rates = rate_of(most, start.to_legs_s(problem.legs)[legs] + problem.legs.duration_s[legs])
    chosen = transit_s * problem.uav.speed_mps <= beam.reach_m
    chosen[np.argsort(-rates, kind="stable")[:FIRST_LEGS]] = True
    return legs[chosen]


def _buckets(problem: Problem, beam: Beam, begin_s: float, links: Ints, figures: Floats) -> Ints:
    """Return the head of each stretch of time's chain of states, and link the chains."""
    stretches = max(0, int((problem.objective.ends_s - begin_s) / beam.bucket_s)) + 1
    heads = np.full(stretches, -1, dtype=np.int32)
    numbers = ((figures[END] - begin_s) / beam.bucket_s).astype(int).tolist()
    for state, number in enumerate(numbers):
        if number < stretches:
            links[NEXT, state], heads[number] = heads[number], state
    return heads


def beam_setting(engine: WhatIf, reach_m: float) -> BeamSetting:
    """Return what a beam moves in, as its kernel takes it."""
    problem = engine.problem
    legs = problem.legs
    ways, hops = ways_within(legs, reach_m)
    ends = LegEnds(
        legs.to_node,
        legs.duration_s,
        legs.node_xy_m,
        legs.home_s,
        legs.first_way,
        legs.last_way,
        turning_of(legs.law),
    )
    return BeamSetting(ways, hops, ends, float(problem.uav.at_height.landing_s), engine.index)
