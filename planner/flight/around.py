"""Flights within an airspace: around no-fly areas and never beyond the fence, timed as flown.

`planner.flight.plan` has the same without an airspace.
"""

from collections.abc import Iterable, Sequence
from typing import TypeAlias

import numpy as np

from planner.flight.airspace import Airspace
from planner.flight.legs import Legs
from planner.flight.plan import ROUNDING_S, FlownLeg, Plan, Timed, track_of, track_of_legs
from planner.flight.uav import Uav
from planner.flight.ways import Point

Stop: TypeAlias = tuple[float, float, float]  # x and y in metres, seconds of hovering there


def legs_around(
    uav: Uav,
    legs: Legs,
    order: Sequence[int],
    *,
    airspace: Airspace,
    method: str,
    in_transit: bool,
) -> Plan:
    """Return the plan in which the UAV flies legs in order, around no-fly areas in between.

    Parameters
    ----------
    legs
        Those that this UAV can fly.
    order
        Legs over the free space. The first one from whose end the UAV could not come home in
        time, and all after it, are left out.
    in_transit
        Whether the sensor is on between roads as well.
    """
    flight: list[Timed] = [(uav.take_off_s, uav.x_m, uav.y_m)]
    flown: list[FlownLeg] = []
    for leg in order:
        points = slice(legs.first_point[leg], legs.first_point[leg + 1])
        x_m, y_m = legs.x_m[points].tolist(), legs.y_m[points].tolist()
        way = _way(uav, airspace, flight[-1], (x_m[0], y_m[0]))
        start_s = way[-1][0]
        home_s = _home_s(uav, airspace, (x_m[-1], y_m[-1]))
        if start_s + legs.duration_s[leg] + home_s > uav.landing_s:
            break
        depart_s = flight[-1][0]
        on_road = zip((start_s + legs.after_s[points]).tolist(), x_m, y_m, strict=True)
        flight += [*way[1:], *list(on_road)[1:]]
        flown.append(FlownLeg(int(leg), depart_s, start_s, flight[-1][0]))
    flight += _way_home(uav, airspace, flight[-1])
    return Plan(method, (track_of_legs(flight, flown, in_transit),), (tuple(flown),))


def stops_around(
    uav: Uav,
    stops: Iterable[Stop],
    until_s: float,
    *,
    airspace: Airspace,
    method: str,
    in_transit: bool,
) -> Plan:
    """Return the plan that flies from stop to stop at full speed and names no roads.

    It ends at a time, or before the first stop from which the UAV could not come home in time.

    Parameters
    ----------
    stops
        Places in the free space.
    in_transit
        Whether the sensor is on all the time; otherwise from the first stop to the last one.
    """
    flight: list[Timed] = [(uav.take_off_s, uav.x_m, uav.y_m)]
    first_s = None
    for x_m, y_m, wait_s in stops:
        home_s = _home_s(uav, airspace, (x_m, y_m))
        way = _way(uav, airspace, flight[-1], (x_m, y_m))
        arrive_s = way[-1][0]
        if way[0][0] >= until_s or arrive_s + home_s > uav.landing_s:
            break
        flight += way[1:]
        first_s = arrive_s if first_s is None else first_s
        leave_s = min(arrive_s + wait_s, until_s, uav.landing_s - home_s)
        flight += [(leave_s, x_m, y_m)] if leave_s > arrive_s else []
        if leave_s < arrive_s + wait_s:
            break
    last_s = flight[-1][0]
    flight += _way_home(uav, airspace, flight[-1])
    there = [] if first_s is None else [(first_s, last_s)]
    on = [(flight[0][0], flight[-1][0])] if in_transit else there
    return Plan(method, (track_of(flight, on),), ((),))


def _way(uav: Uav, airspace: Airspace, at: Timed, to: Point) -> list[Timed]:
    """Return where the UAV is when on its way to a place, from where it is; that alone if there."""
    time_s, *here = at
    if (here[0], here[1]) == to:
        return [at]
    points = airspace.shortest_path((here[0], here[1]), to)
    steps = np.diff(np.array(points), axis=0)
    times_s = time_s + np.cumsum(np.hypot(steps[:, 0], steps[:, 1]) / uav.speed_mps)
    return [at, *((t, *point) for t, point in zip(times_s.tolist(), points[1:], strict=True))]


def _home_s(uav: Uav, airspace: Airspace, place: Point) -> float:
    if uav.return_to_m is None:
        return 0.0
    return _way(uav, airspace, (0.0, *place), uav.return_to_m)[-1][0]


def _way_home(uav: Uav, airspace: Airspace, at: Timed) -> list[Timed]:
    if uav.return_to_m is None:
        return []
    way = _way(uav, airspace, at, uav.return_to_m)[1:]
    return way if way and way[-1][0] <= uav.landing_s + ROUNDING_S else []
