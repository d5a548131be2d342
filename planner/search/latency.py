"""The order of legs with the least weighted waiting, where targets rest or hardly move.

What a leg sees of targets that rest does not depend on when it is flown. So an order is one of
stops with weights, and the sum of weight times waiting is all that counts: the minimum latency
problem.
It is solved by 2-opt, or-opt and exchanges, begun again and again from changed orders, as in Silva,
Subramanian, Vidal and Ochi (2012).
"""

from collections.abc import Sequence

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.evaluate import evaluate
from planner.search.kernels.latency import Stops, least_waiting
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.sightings import earned
from planner.search.stepwise import TIE

SLOW = 0.02  # of the UAV's speed: targets that are slower on the whole hardly move
KICK = 0.013  # units of work that a changed order takes, for each pair of stops: measured


def is_latency(problem: Problem) -> bool:
    """Tell whether what a leg sees hardly depends on when it is flown, and the sum of times counts.

    Only an ideal UAV flies straight from leg to leg as fast as it can, and a sensor that may miss
    sees a target more than once.
    """
    futures = problem.futures
    if problem.airspace is not None or problem.uav.aircraft is not None:
        return False
    if problem.objective.by_s is not None or not problem.sensor.is_perfect or not len(futures):
        return False
    same = np.diff(futures.particle) == 0
    ways_m = np.hypot(np.diff(futures.x_m), np.diff(futures.y_m))[same]
    ends_s = np.where(futures.gone, futures.end_s, np.maximum(futures.end_s, problem.horizon_s))
    some = np.diff(futures.first_knot) > 0  # the others are never there
    there_s = (ends_s[some] - futures.time_s[futures.first_knot[:-1][some]]).sum()
    return bool(ways_m.sum() <= SLOW * problem.uav.speed_mps * there_s)


def with_less_waiting(
    problem: Problem, order: Sequence[int], work: int, rng: np.random.Generator
) -> tuple[list[int], int]:
    """Return an order that sees sooner what legs see, if nobody moves, and the work it took.

    Legs that see nobody for the first time are left out. The same order is returned where the
    first descent does not help when it is flown: where legs see much of each other's targets, or
    the horizon comes too soon, the sum of waiting says little.

    Parameters
    ----------
    work
        At most so many units, but for the first descent.
    """
    flown, waited_s, weight = _first_seen(problem, order)
    ways = np.stack([flown, flown ^ 1], axis=1).ravel()  # each stop, and the other way round
    if len(flown) < 2:
        return list(order), 0
    legs, speed_mps = problem.legs, problem.legs.speed_mps
    begins, ends = (legs.node_xy_m[of[ways]] for of in (legs.from_node, legs.to_node))
    state = problem.first_state
    ends = np.vstack([ends, [(state.x_m, state.y_m)]])
    lasts_s = legs.duration_s[ways]
    # Seen on the way to a leg: as long before it if it is flown the other way round.
    turned_s = np.where(waited_s > 0.0, legs.duration_s[flown] - waited_s, waited_s)
    stops = Stops(
        between_s=np.linalg.norm(ends[:, None] - begins[None], axis=2) / speed_mps,
        lasts_s=lasts_s,
        waiting=np.stack([waited_s, turned_s], axis=1).ravel() * np.repeat(weight, 2),
        weight=np.repeat(weight, 2),
    )
    kick = max(1, int(KICK * len(flown) ** 2))
    descended = least_waiting(2 * np.arange(len(flown)), stops, np.empty((0, 3)))
    if (
        _earned(problem, ways[descended].tolist())
        < _earned(problem, order) - TIE * problem.objective.most
    ):
        return list(order), kick
    kicks = rng.random((work // kick if len(flown) > 2 else 0, 3))
    found = least_waiting(descended, stops, kicks)
    return ways[found].tolist(), kick * (1 + len(kicks))


def _earned(problem: Problem, order: Sequence[int]) -> float:
    """Return the expected reward of an order on the particles planned with."""
    plan = plan_of_legs(problem, "", order)
    return earned(problem, plan, problem.futures, problem.futures.weight)


def _first_seen(problem: Problem, order: Sequence[int]) -> tuple[Ints, Floats, Floats]:
    """Return the legs that see anyone first, how long after their start, s, and their weight."""
    plan = plan_of_legs(problem, "", order)
    (legs,), futures, objective = plan.legs, problem.futures, problem.objective
    seen_at = evaluate(plan.tracks, futures, problem.sensor, objective).seen_at
    counts = seen_at <= problem.horizon_s
    leg = np.array([one.leg for one in legs], dtype=np.int64)
    starts_s, ends_s = np.array([(one.start_s, one.end_s) for one in legs]).reshape(-1, 2).T
    which = np.minimum(np.searchsorted(ends_s, seen_at[counts]), len(legs) - 1)
    weight = np.bincount(which, futures.weight[counts], len(legs)).astype(np.float64)
    after_s = futures.weight[counts] * (seen_at[counts] - starts_s[which])
    some = weight > 0.0
    waited_s = np.bincount(which, after_s, len(legs))[some] / weight[some]
    return leg[some], waited_s, weight[some]
