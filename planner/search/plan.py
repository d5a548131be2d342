"""The plans that a problem's UAV can fly, from where its search begins.

Those of a real aircraft are as it flies them: timed by the flight law, and home in time.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.checked import indices, whole
from planner.errors import NotApplicableError
from planner.flight.airspace import Airspace
from planner.flight.around import legs_around, stops_around
from planner.flight.as_flown import as_flown, battery_of
from planner.flight.hovering import hovering, with_hovering
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
    if problem.uav.aircraft is None:
        return _even_plan_of_legs(problem, method, order)
    hovered = hovering(problem.legs, order, float(problem.sensor.radius_m))
    plan = _even_plan_of_legs(problem, method, [one.leg for one in hovered])
    return _flown(problem, with_hovering(plan, [one.hover_s for one in hovered]))


def _even_plan_of_legs(problem: Problem, method: str, order: Sequence[int]) -> Plan:
    """Return the plan that flies legs in order at full speed."""
    in_transit, airspace = problem.sensor.detects_in_transit, problem.airspace
    how: Any = {"method": method, "in_transit": in_transit}
    uav = problem.uav_at_start
    if airspace is not None:
        return legs_around(uav, problem.legs, order, airspace=airspace, **how)
    return legs_flown(uav, problem.legs, order, **how)


def plan_of_wait(problem: Problem, method: str, x_m: float, y_m: float) -> Plan:
    """Return the plan that flies to a point and waits there to the horizon or the landing."""
    if problem.airspace is not None:
        return _plan_of_stops(problem, problem.airspace, method, np.array([[x_m, y_m, np.inf]]))
    waits = wait_flown(
        problem.uav_at_start,
        (x_m, y_m),
        problem.objective.horizon_s,
        method=method,
        in_transit=problem.sensor.detects_in_transit,
    )
    return _flown(problem, waits)


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
    plan = waypoints_flown(problem.uav_at_start, waypoints, horizon_s, method=method)
    return _flown(problem, plan)


def _plan_of_stops(problem: Problem, airspace: Airspace, method: str, stops: Floats) -> Plan:
    """Return the plan that flies to the nearest places to the given ones that are searched."""
    uav = problem.uav_at_start
    places = airspace.nearest_searched(stops[:, :2], (uav.x_m, uav.y_m))
    stops_m = [(x_m, y_m, wait_s) for (x_m, y_m), wait_s in zip(places, stops[:, 2], strict=True)]
    plan = stops_around(
        uav,
        stops_m,
        problem.objective.horizon_s,
        airspace=airspace,
        method=method,
        in_transit=problem.sensor.detects_in_transit,
    )
    return _flown(problem, plan)


def _flown(problem: Problem, plan: Plan) -> Plan:
    """Return a plan at even speed as the problem's aircraft flies it; that of the ideal one."""
    uav = problem.uav_at_start
    if uav.aircraft is None:
        return plan
    battery = battery_of(uav, problem.airspace)
    return as_flown(plan, uav.aircraft.law, battery, climbs=problem.start is None)


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
