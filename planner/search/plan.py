"""The plans that a problem's UAV can fly, from where its search begins."""

from collections.abc import Sequence

import numpy as np

from planner.arrays import Floats
from planner.checked import indices, whole
from planner.errors import NotApplicableError
from planner.flight.plan import Plan, legs_flown, wait_flown, waypoints_flown
from planner.search.problem import Problem


def plan_of_legs(problem: Problem, method: str, order: Sequence[int]) -> Plan:
    """Return the plan in which the UAV flies legs in the given order, straight in between.

    Legs after which it could not come home are left out, with all that follow.

    Raises
    ------
    InputError
        If the order holds anything but legs of the problem.
    """
    order = [whole("order", leg) for leg in order]
    indices(len(problem.legs), order=np.array(order, dtype=np.int64))
    in_transit = problem.sensor.detects_in_transit
    return legs_flown(
        problem.uav_at_start, problem.legs, order, method=method, in_transit=in_transit
    )


def plan_of_wait(problem: Problem, method: str, x_m: float, y_m: float) -> Plan:
    """Return the plan that flies to a point and waits there to the horizon or the landing."""
    return wait_flown(
        problem.uav_at_start,
        (x_m, y_m),
        problem.objective.horizon_s,
        method=method,
        in_transit=problem.sensor.detects_in_transit,
    )


def plan_of_waypoints(problem: Problem, method: str, waypoints: Floats) -> Plan:
    """Return the plan that flies to points and hovers there, (W, 3) x and y in metres, seconds.

    Raises
    ------
    NotApplicableError
        If the sensor only looks along roads.
    """
    needs_open_country(problem, method)
    horizon_s = problem.objective.horizon_s
    return waypoints_flown(problem.uav_at_start, waypoints, horizon_s, method=method)


def needs_open_country(problem: Problem, method: str) -> None:
    """Do nothing if the sensor also looks between roads.

    Raises
    ------
    NotApplicableError
        If it does not.
    """
    if not problem.sensor.detects_in_transit:
        raise NotApplicableError(
            f"{method} flies across country, and the sensor only looks along roads; "
            "set sensor.detects_in_transit or choose a method that plans over roads"
        )
