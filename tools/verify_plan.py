"""What plan.json says beside the flight since its schema 2: the net, the aircraft, the places.

docs/formats.md has the fields.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from verify_aircraft import flown_as_said
from verify_files import Array, Fields, RefusedError, rows_of

DEGREES = (("lon", 180.0), ("lat", 90.0))


def waypoints(plan: Fields, flight: Fields) -> Array:
    """Return time, x and y of the waypoints, (W, 3); lon and lat may stand beside them."""
    if not _on_earth(plan):
        return flight.rows("waypoints", 3, least=1)
    rows = flight.rows("waypoints", 5, least=1)
    if np.any(np.abs(rows[:, 3:]) > [most for _, most in DEGREES]):
        raise RefusedError(f"{flight.where}: waypoints should end in lon and lat, degrees")
    return rows[:, :3]


def said_again(
    run: Fields, plan: Fields, flight: Fields, uav: Fields, first: Array
) -> Iterator[tuple[str, Any, Any]]:
    """Yield what a plan of schema 2 says that other fields say as well: name, claimed, found.

    Parameters
    ----------
    uav
        What the scenario says of the UAV.
    first
        Time, x and y of the first waypoint.
    """
    yield from flown_as_said(flight, uav)
    if not _is_newer(plan):
        if "aircraft" in flight:
            raise RefusedError(f"{flight.where}: has an aircraft, which its schema has not")
        return
    net = plan.part("network")
    rows_of("plan.json: network: net_offset_m", [net.any("net_offset_m")], 2)
    if net.any("projection") is not None:
        net.text("projection")
    yield "net of the plan", net.text("sha256"), run.part("sha256").text("net")
    altitude_m = flight.number("altitude_m", 0.0)
    yield "altitude of the scenario", altitude_m, uav.number("altitude_m")
    yield "speed of the scenario", flight.above_zero("speed_mps"), uav.number("speed_mps")
    longest_s = uav.maybe("max_flight_time_s") if "max_flight_time_s" in uav else None
    yield "longest flight of the scenario", flight.maybe("max_flight_time_s"), longest_s
    start = _place(plan, flight.part("start"))
    yield "start at the first waypoint", start, first[1:].tolist()
    if flight.any("landing") is not None:
        _place(plan, flight.part("landing"))
    if plan.any("sighted_at") is not None:
        plan.text("sighted_at")


def _is_newer(plan: Fields) -> bool:
    return plan.text("schema") != "planner.plan/1"


def _on_earth(plan: Fields) -> bool:
    return _is_newer(plan) and plan.part("network").any("projection") is not None


def _place(plan: Fields, place: Fields) -> list[float]:
    for key, most in DEGREES:
        if (key in place) != _on_earth(plan):
            raise RefusedError(f"{place.where}: {key} goes with a net that has a projection")
        if key in place and abs(place.number(key)) > most:
            raise RefusedError(f"{place.where}: {key} should be degrees")
    return [place.number("x_m"), place.number("y_m")]
