"""A plan: which roads the UAV flies in which order, and the track that this makes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.detection.track import Track
from planner.search.problem import Problem


@dataclass(frozen=True)
class FlownLeg:
    """One road of a plan, with the times of its flight on the target's clock."""

    leg: int  # 2 * road in the road's own direction, one more against it
    depart_s: float  # leaves the place where the last leg ended
    start_s: float  # begins the road
    end_s: float  # ends the road

    @property
    def road(self) -> int:
        """Index of the road."""
        return self.leg // 2


@dataclass(frozen=True, eq=False)
class Plan:
    """What each UAV flies; one entry per UAV."""

    method: str
    tracks: tuple[Track, ...]
    legs: tuple[tuple[FlownLeg, ...], ...]


def plan_of_legs(problem: Problem, method: str, order: Sequence[int]) -> Plan:
    """Return the plan in which the UAV flies legs in the given order, straight in between.

    Parameters
    ----------
    order
        Leg indices (``2 * road`` or ``2 * road + 1``). The first leg that would end after the
        UAV's last minute in the air, and all after it, are left out.
    """
    uav, legs = problem.uavs[0], problem.legs
    flight = [(uav.take_off_s, uav.x_m, uav.y_m)]
    flown: list[FlownLeg] = []
    for leg in order:
        depart_s, x_m, y_m = flight[-1]
        points = slice(legs.first_point[leg], legs.first_point[leg + 1])
        start_s = depart_s + float(legs.transit_s(x_m, y_m)[leg])
        if start_s + legs.duration_s[leg] > uav.landing_s:
            break
        on_road = zip(
            start_s + legs.after_s[points], legs.x_m[points], legs.y_m[points], strict=True
        )
        waypoints = [(float(t), float(x), float(y)) for t, x, y in on_road]
        flight += waypoints[1:] if start_s == depart_s else waypoints
        flown.append(FlownLeg(int(leg), depart_s, start_s, waypoints[-1][0]))
    return Plan(method, (_track(problem, flight, flown),), (tuple(flown),))


def plan_of_wait(problem: Problem, method: str, x_m: float, y_m: float) -> Plan:
    """Return the plan that flies to a point and waits there to the horizon or the landing.

    If the point is too far, the UAV lands on the way.
    """
    uav = problem.uavs[0]
    transit_s = float(np.hypot(x_m - uav.x_m, y_m - uav.y_m)) / uav.speed_mps
    flight = [(uav.take_off_s, uav.x_m, uav.y_m)]
    on = [uav.take_off_s] if problem.sensor.detects_in_transit else []
    if transit_s > uav.max_flight_time_s:
        share = uav.max_flight_time_s / transit_s
        x_m, y_m = uav.x_m + share * (x_m - uav.x_m), uav.y_m + share * (y_m - uav.y_m)
        flight += [(uav.landing_s, x_m, y_m)]
    else:
        arrive_s = uav.take_off_s + transit_s
        leave_s = max(arrive_s, min(problem.horizon_s, uav.landing_s))
        flight += [(arrive_s, x_m, y_m), (leave_s, x_m, y_m)]
        on = on or [arrive_s]
    sensor_on = [(from_s, flight[-1][0]) for from_s in on]
    return Plan(method, (_flight_track(flight, sensor_on),), ((),))


def _track(
    problem: Problem, flight: list[tuple[float, float, float]], flown: list[FlownLeg]
) -> Track:
    if problem.sensor.detects_in_transit:
        return _flight_track(flight, [(flight[0][0], flight[-1][0])])
    on: list[tuple[float, float]] = []
    for leg in flown:
        if on and on[-1][1] == leg.start_s:
            on[-1] = (on[-1][0], leg.end_s)
        else:
            on.append((leg.start_s, leg.end_s))
    return _flight_track(flight, on)


def _flight_track(
    flight: list[tuple[float, float, float]], sensor_on: list[tuple[float, float]]
) -> Track:
    time_s, x_m, y_m = np.array(flight, dtype=np.float64).T
    return Track(time_s, x_m, y_m, np.array(sensor_on, dtype=np.float64).reshape(-1, 2))
