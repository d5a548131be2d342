"""The plans that a problem's UAV can fly, from where its search begins."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.checked import indices, whole
from planner.errors import NotApplicableError
from planner.flight.airspace import Airspace
from planner.flight.around import legs_around, stops_around
from planner.flight.plan import Plan, legs_flown, wait_flown, waypoints_flown
from planner.search.problem import Problem


def plan_of_legs(problem: Problem, method: str, order: Sequence[int]) -> Plan:
    """Return the plan in which the UAV flies legs in the given order, straight in between.

    Within an airspace, it flies around no-fly areas in between. Legs after which it could not
    come home are left out, with all that follow.

    Raises
    ------
    InputError
        If the order holds anything but legs of the problem.
    """
    order = [whole("order", leg) for leg in order]
    indices(len(problem.legs), order=np.array(order, dtype=np.int64))
    in_transit, airspace = problem.sensor.detects_in_transit, problem.airspace
    how: Any = {"method": method, "in_transit": in_transit}
    if airspace is not None:
        return legs_around(problem.uav_at_start, problem.legs, order, airspace=airspace, **how)
    return legs_flown(problem.uav_at_start, problem.legs, order, **how)


def plan_of_wait(problem: Problem, method: str, x_m: float, y_m: float) -> Plan:
    """Return the plan that flies to a point and waits there to the horizon or the landing."""
    if problem.airspace is not None:
        return _plan_of_stops(problem, problem.airspace, method, np.array([[x_m, y_m, np.inf]]))
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
    if problem.airspace is not None:
        return _plan_of_stops(problem, problem.airspace, method, waypoints)
    horizon_s = problem.objective.horizon_s
    return waypoints_flown(problem.uav_at_start, waypoints, horizon_s, method=method)


def _plan_of_stops(problem: Problem, airspace: Airspace, method: str, stops: Floats) -> Plan:
    """Return the plan that flies to the nearest places to the given ones that are searched."""
    uav = problem.uav_at_start
    places = airspace.nearest_searched(stops[:, :2], (uav.x_m, uav.y_m))
    return stops_around(
        uav,
        [(x_m, y_m, wait_s) for (x_m, y_m), wait_s in zip(places, stops[:, 2], strict=True)],
        problem.objective.horizon_s,
        airspace=airspace,
        method=method,
        in_transit=problem.sensor.detects_in_transit,
    )


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
