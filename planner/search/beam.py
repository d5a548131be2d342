"""Beam search over road orders: many orders grow side by side, those of about the same time compete.

An order ends where and when its last road ends, so orders of the same length are far apart in
time and cannot be compared; orders of about the same time can. Of each stretch of time only the
most promising go on: those whose reward so far, with what particles still unseen at that time
usually bring, is greatest.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.first_detection import columns
from planner.search.problem import Problem
from planner.search.state import SearchState, candidate_legs
from planner.search.what_if import WhatIf


@dataclass(frozen=True)
class Beam:
    """How a beam searches."""

    width: int  # orders that go on from each stretch of time
    reach_m: float = 0.0  # farthest flight to the start of the next road; 0: it starts here
    bucket_s: float = 50.0  # length of a stretch of time


@dataclass(frozen=True, eq=False)
class Outlook:
    """What an unseen particle usually brings from a time on: reward per unit of weight."""

    brings: Floats  # (B,)
    first_s: float  # seconds
    step_s: float  # seconds

    @classmethod
    def of(cls, problem: Problem, seen_at: Floats, *, step_s: float = 25.0) -> "Outlook":
        """Return what a plan with these sightings, (N,) seconds, brings from each time on."""
        first_s = problem.uavs[0].take_off_s
        times = np.arange(first_s, problem.objective.ends_s + 2 * step_s, step_s)
        order = np.argsort(seen_at, kind="stable")
        weight = problem.futures.weight[order]
        reward = weight * problem.objective.reward(seen_at[order])
        after = np.searchsorted(seen_at[order], times, side="right")
        left = np.append(np.cumsum(weight[::-1])[::-1], 0.0)[after]
        brings = np.append(np.cumsum(reward[::-1])[::-1], 0.0)[after]
        per_weight = np.divide(brings, left, out=np.zeros(len(times)), where=left > 1e-12)
        return cls(per_weight, first_s, step_s)


def beam_order(
    problem: Problem, beam: Beam, outlook: Outlook, *, stop: Callable[[], bool] = bool
) -> list[int]:
    """Return the legs of the best order that a beam finds, those that see nothing at the end left out.

    Parameters
    ----------
    stop
        Asked between stretches of time; the best order so far is returned once it says so.
    """
    from planner.search.kernels_beam import END, LEG, PARENT, PROMISE, REWARD, UNSEEN, grow, promise

    engine, objective = WhatIf(problem), problem.objective
    first_legs = candidate_legs(problem, SearchState.at_start(problem))
    flights = engine.fly(SearchState.at_start(problem), first_legs)
    many, known = len(first_legs), problem.legs
    if many == 0:
        return []
    weight = problem.futures.weight
    earned = flights.per_flight(weight[flights.particle] * objective.reward(flights.seen_at))
    unseen = weight.sum() - flights.per_flight(weight[flights.particle])
    tree, worth = np.full((4, 4096), -1, dtype=np.int32), np.zeros((4, 4096))
    if many > 4096:
        tree, worth = np.full((4, many), -1, dtype=np.int32), np.zeros((4, many))
    tree[LEG, :many] = first_legs
    worth[END, :many], worth[REWARD, :many], worth[UNSEEN, :many] = flights.end_s, earned, unseen
    looks = (outlook.brings, float(outlook.first_s), float(outlook.step_s))
    for i in range(many):
        worth[PROMISE, i] = promise(*worth[[END, REWARD, UNSEEN], i].tolist(), looks)
    begin_s = problem.uavs[0].take_off_s
    buckets = int((objective.ends_s - begin_s) / beam.bucket_s) + 2
    heads = np.full(buckets, -1, dtype=np.int32)
    for i in range(many):
        bucket = int((flights.end_s[i] - begin_s) / beam.bucket_s)
        if bucket < buckets:
            tree[2, i], heads[bucket] = heads[bucket], i
    counts = np.array([many, 0, int(np.argmax(earned))])
    masks = np.empty((256, (len(weight) + 7) // 8), dtype=np.uint8)
    setting = _setting(problem, engine, beam.reach_m)
    by_s = np.inf if objective.by_s is None else float(objective.by_s)
    goal = (float(objective.horizon_s), by_s, float(problem.uavs[0].landing_s))
    flown = (flights.first.astype(np.int64), flights.particle)
    for number in range(buckets):
        if heads[number] < 0:
            continue
        if stop():
            break
        bucket = (number, beam.width, float(begin_s), float(beam.bucket_s))
        tree, worth, masks, counts = grow(
            bucket, (tree, worth, masks, heads, counts), setting, goal, looks, flown
        )
    order, i = [], int(counts[2])
    while i >= 0:
        order.append(int(tree[LEG, i]))
        i = int(tree[PARENT, i])
    return order[::-1]


def _setting(problem: Problem, engine: WhatIf, reach_m: float):
    from planner.search.kernels import bearings_of

    legs = problem.legs
    xy = legs.node_xy_m
    count = len(xy)
    leaving = [np.flatnonzero(legs.from_node == node) for node in range(count)]
    ways = ([0], [], [])
    hops = ([0], [], [], [], [])
    for node in range(count):
        offset = xy - xy[node]
        away = np.hypot(offset[:, 0], offset[:, 1])
        near = np.flatnonzero((away <= reach_m) & (away > 0))
        near = np.array([n for n in near if len(leaving[n])], dtype=int)
        bearing = bearings_of(offset[near])
        near = near[np.argsort(bearing)]
        hops[1].extend(near); hops[2].extend(np.sort(bearing)); hops[3].extend(offset[near] / away[near, None]); hops[4].extend(away[near] / legs.speed_mps)
        hops[0].append(len(hops[1]))
        here = np.flatnonzero(away == 0)
        for n in here:
            ways[1].extend(leaving[n]); ways[2].extend([-1] * len(leaving[n]))
        for j, n in enumerate(near):
            ways[1].extend(leaving[n]); ways[2].extend([j] * len(leaving[n]))
        ways[0].append(len(ways[1]))
    W = (np.array(ways[0]), np.array(ways[1], dtype=np.int32), np.array(ways[2], dtype=np.int32))
    H = (np.array(hops[0]), np.array(hops[1], dtype=np.int32), np.array(hops[2], dtype=float), np.array(hops[3], dtype=float).reshape(-1, 2), np.array(hops[4], dtype=float))
    R = (legs.to_node, legs.duration_s, legs.node_xy_m, engine._legs, problem.home_s)
    world = (engine._futures, engine._passages, engine._sensing, problem.futures.weight, problem.sensor.detects_in_transit)
    return W, H, R, world
