"""Flying to where most targets end, and waiting there: the baseline that anyone would think of."""

import numpy as np

from planner.arrays import Floats
from planner.errors import NotApplicableError
from planner.futures.futures import Futures
from planner.search.plan import Plan, plan_of_wait
from planner.search.problem import Budget, Problem


def wait(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> Plan:  # noqa: ARG001
    """Return the plan that flies to where most targets end and waits there until the horizon.

    Neither budget nor chance changes it. Targets that vanish at their end are seen there as they
    arrive.

    Raises
    ------
    NotApplicableError
        If no particle ever sets out.
    """
    x_m, y_m = busiest_end(problem.futures, problem.sensor.radius_m)
    return plan_of_wait(problem, "wait", x_m, y_m)


def busiest_end(futures: Futures, radius_m: float) -> tuple[float, float]:
    """Return the end of a particle that has the greatest weight of ends within the radius, metres.

    Among equals it is that of the first particle.
    """
    some = np.diff(futures.first_knot) > 0
    if not some.any():
        raise NotApplicableError("no particle ever sets out, so there is no end to wait at")
    last = futures.first_knot[1:][some] - 1
    ends, first, which = np.unique(
        np.stack([futures.x_m[last], futures.y_m[last]], axis=1),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    weight = np.zeros(len(ends))
    np.add.at(weight, which.ravel(), futures.weight[some])
    near = np.array([_weight_near(end, ends, weight, radius_m) for end in ends])
    best = min(np.flatnonzero(near >= near.max() * (1.0 - 1e-12)), key=lambda i: int(first[i]))
    return float(ends[best, 0]), float(ends[best, 1])


def _weight_near(point: Floats, ends: Floats, weight: Floats, radius_m: float) -> float:
    offset = ends - point
    return float(weight[np.hypot(offset[:, 0], offset[:, 1]) <= radius_m].sum())
