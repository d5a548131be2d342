"""Flying to where most targets end, and waiting there: the baseline that anyone would think of."""

import numpy as np

from planner.arrays import Floats
from planner.errors import NotApplicableError
from planner.futures.futures import Futures
from planner.search.plan import plan_of_wait
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult


def wait(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan that flies to where most targets end and waits there until the horizon.

    Neither budget nor chance changes it. Targets that vanish at their end are seen there as they
    arrive. If the target has to be found by a deadline, the UAV waits where most are then, of
    the places that it can reach by then.

    Raises
    ------
    NotApplicableError
        If no particle ever sets out.
    """
    if problem.objective.by_s is None:
        x_m, y_m = busiest_end(problem.futures, problem.weight_at_start, problem.sensor.radius_m)
    else:
        x_m, y_m = busiest_by(problem, problem.objective.by_s)
    return SearchResult(plan_of_wait(problem, "wait", x_m, y_m))


def busiest_end(futures: Futures, weight: Floats, radius_m: float) -> tuple[float, float]:
    """Return the end of a particle that has the greatest weight of ends within the radius, metres.

    Among equals it is that of the first particle.
    """
    some = np.diff(futures.first_knot) > 0
    if not some.any():
        raise NotApplicableError("no particle ever sets out, so there is no end to wait at")
    last = futures.first_knot[1:][some] - 1
    ends = np.stack([futures.x_m[last], futures.y_m[last]], axis=1)
    return _busiest(ends, weight[some], radius_m)


def busiest_by(problem: Problem, time_s: float) -> tuple[float, float]:
    """Return the same for where particles are at a time, or ended before, and the UAV can be.

    If the UAV can reach none of these places by then, all of them count.
    """
    futures, uav = problem.futures, problem.uav_at_start
    places = futures.positions(np.minimum(futures.end_s, time_s))
    there = np.isfinite(places[:, 0])
    if not there.any():
        raise NotApplicableError(f"no particle sets out by {time_s:g} s, so nothing to wait for")
    away_m = np.hypot(places[:, 0] - uav.x_m, places[:, 1] - uav.y_m)
    in_reach = away_m <= uav.speed_mps * (time_s - uav.take_off_s)  # False for NaN
    chosen = in_reach if in_reach.any() else there
    return _busiest(places[chosen], problem.weight_at_start[chosen], problem.sensor.radius_m)


def _busiest(places: Floats, weight_of: Floats, radius_m: float) -> tuple[float, float]:
    ends, first, which = np.unique(places, axis=0, return_index=True, return_inverse=True)
    weight = np.zeros(len(ends))
    np.add.at(weight, which.ravel(), weight_of)
    near = np.array([_weight_near(end, ends, weight, radius_m) for end in ends])
    best = min(np.flatnonzero(near >= near.max() * (1.0 - 1e-12)), key=lambda i: int(first[i]))
    return float(ends[best, 0]), float(ends[best, 1])


def _weight_near(point: Floats, ends: Floats, weight: Floats, radius_m: float) -> float:
    offset = ends - point
    return float(weight[np.hypot(offset[:, 0], offset[:, 1]) <= radius_m].sum())
