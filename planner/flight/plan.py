"""A plan: which roads the UAV flies in which order, and the track that this makes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from planner.arrays import Floats
from planner.flight.legs import Legs
from planner.flight.track import Track
from planner.flight.uav import Uav

Timed: TypeAlias = tuple[float, float, float]  # time in seconds, x and y in metres

ROUNDING_S = 1e-6  # by which a flight planned to end with the landing may seem to end later


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
        return Legs.road(self.leg)

    def after(self, time_s: float) -> "FlownLeg":
        """Return what is left of it from a time on."""
        times_s = (max(time_s, one) for one in (self.depart_s, self.start_s, self.end_s))
        return FlownLeg(self.leg, *times_s)

    def later(self, by_s: float) -> "FlownLeg":
        """Return the same so many seconds later."""
        return FlownLeg(self.leg, self.depart_s + by_s, self.start_s + by_s, self.end_s + by_s)


class Sortie(NamedTuple):
    """Which flight of which UAV."""

    uav: int  # from 0
    number: int = 0  # of its flights, from 0


@dataclass(frozen=True, eq=False)
class Plan:
    """What is flown, from each take-off to its landing: one flight per UAV, or several."""

    method: str
    tracks: tuple[Track, ...]
    legs: tuple[tuple[FlownLeg, ...], ...]
    sorties: tuple[Sortie, ...] = ()  # whose flights they are; empty: one of each UAV

    @property
    def flights(self) -> tuple[Sortie, ...]:
        """Whose flights they are."""
        return self.sorties or tuple(map(Sortie, range(len(self.tracks))))

    @property
    def names(self) -> tuple[str, ...]:
        """What flights are called where there are several: "UAV 2", "UAV 2, flight 1"."""
        again = any(flight.number for flight in self.flights)
        return tuple(
            f"UAV {flight.uav + 1}" + (f", flight {flight.number + 1}" if again else "")
            for flight in self.flights
        )

    @property
    def follows_roads(self) -> bool:
        """Whether it names roads to fly, in order."""
        return any(self.legs)

    @property
    def roads(self) -> int:
        """How many roads are flown, each as often as it is."""
        return sum(map(len, self.legs))

    @property
    def take_off_s(self) -> float:
        """When the first UAV takes off, seconds on the target's clock."""
        return min(float(track.time_s[0]) for track in self.tracks)

    @property
    def end_s(self) -> float:
        """When the last flight ends, seconds on the target's clock."""
        return max(track.end_s for track in self.tracks)

    def after(self, time_s: float) -> "Plan":
        """Return what is left to be flown from a time on; roads begun are left from there on."""
        tracks = tuple(track.after(time_s) for track in self.tracks)
        legs = tuple(
            tuple(leg.after(time_s) for leg in flown if leg.end_s > time_s) for flown in self.legs
        )
        return replace(self, tracks=tracks, legs=legs)

    def later(self, by_s: float) -> "Plan":
        """Return the same flights so many seconds later."""
        tracks = tuple(track.later(by_s) for track in self.tracks)
        legs = tuple(tuple(leg.later(by_s) for leg in flown) for flown in self.legs)
        return replace(self, tracks=tracks, legs=legs)


def legs_flown(
    uav: Uav, legs: Legs, order: Sequence[int], *, method: str, in_transit: bool
) -> Plan:
    """Return the plan in which the UAV flies legs in the given order, straight in between.

    Parameters
    ----------
    legs
        Those that this UAV can fly.
    order
        Leg indices. The first leg from whose end the UAV could not come home within its time in
        the air, and all after it, are left out. If it has to land at a certain place, the track
        ends with the flight there.
    in_transit
        Whether the sensor is on between roads as well.
    """
    flight = [(uav.take_off_s, uav.x_m, uav.y_m)]
    flown: list[FlownLeg] = []
    for leg in order:
        depart_s, x_m, y_m = flight[-1]
        points = slice(legs.first_point[leg], legs.first_point[leg + 1])
        start_s = depart_s + float(legs.transit_s(x_m, y_m)[leg])
        home_s = legs.home_s[legs.to_node[leg]]
        if start_s + legs.duration_s[leg] + home_s > uav.landing_s:
            break
        on_road = zip(
            start_s + legs.after_s[points], legs.x_m[points], legs.y_m[points], strict=True
        )
        waypoints = [(float(t), float(x), float(y)) for t, x, y in on_road]
        flight += waypoints[1:] if start_s == depart_s else waypoints
        flown.append(FlownLeg(int(leg), depart_s, start_s, waypoints[-1][0]))
    flight += _way_home(uav, *flight[-1])
    return Plan(method, (track_of_legs(flight, flown, in_transit),), (tuple(flown),))


def wait_flown(
    uav: Uav, place_m: tuple[float, float], until_s: float, *, method: str, in_transit: bool
) -> Plan:
    """Return the plan that flies to a point and waits there until a time or the landing.

    If the point is too far, the UAV goes as far as it can: it lands on the way, or turns in time
    to come home.
    """
    x_m, y_m = place_m
    transit_s = float(np.hypot(x_m - uav.x_m, y_m - uav.y_m)) / uav.speed_mps
    flight = [(uav.take_off_s, uav.x_m, uav.y_m)]
    on = [uav.take_off_s] if in_transit else []
    home_s = uav.home_s(x_m, y_m)
    if transit_s + home_s > uav.max_flight_time_s:
        out_s = _farthest_s(uav, x_m, y_m)
        share = out_s / transit_s if transit_s > 0.0 else 0.0
        x_m, y_m = uav.x_m + share * (x_m - uav.x_m), uav.y_m + share * (y_m - uav.y_m)
        flight += [(uav.take_off_s + out_s, x_m, y_m)]
    else:
        arrive_s = uav.take_off_s + transit_s
        leave_s = max(arrive_s, min(until_s, uav.landing_s - home_s))
        flight += [(arrive_s, x_m, y_m), (leave_s, x_m, y_m)]
        on = on or [arrive_s]
    there_s = flight[-1][0]
    flight += _way_home(uav, *flight[-1])
    sensor_on = [(from_s, flight[-1][0] if in_transit else there_s) for from_s in on]
    return Plan(method, (track_of(flight, sensor_on),), ((),))


def waypoints_flown(uav: Uav, waypoints: Floats, until_s: float, *, method: str) -> Plan:
    """Return the plan that flies straight from waypoint to waypoint at full speed.

    It names no roads, and its sensor is on all the time. It ends at a time, or as soon as the
    UAV has to land or to turn for home.

    Parameters
    ----------
    waypoints
        Where to go after take-off, x and y in metres, and how long to hover there in seconds,
        (W, 3).
    """
    flight = [(uav.take_off_s, uav.x_m, uav.y_m)]
    for x_m, y_m, wait_s in np.asarray(waypoints, dtype=np.float64).tolist():
        time_s, *here = flight[-1]
        if time_s >= until_s:
            break
        flies_s = float(np.hypot(*np.subtract((x_m, y_m), here))) / uav.speed_mps
        can_s = max(0.0, _farthest_s(uav.resumed(*flight[-1]), x_m, y_m))
        if can_s < flies_s:
            x, y = here + can_s / flies_s * np.subtract((x_m, y_m), here)
            flight += [(time_s + can_s, float(x), float(y))]
            break
        flight += [(time_s + flies_s, x_m, y_m)] if flies_s > 0.0 else []
        arrive_s = flight[-1][0]
        leave_s = min(arrive_s + wait_s, until_s, uav.landing_s - uav.home_s(x_m, y_m))
        flight += [(leave_s, x_m, y_m)] if leave_s > arrive_s else []
        if leave_s < arrive_s + wait_s:
            break
    flight += _way_home(uav, *flight[-1])
    return Plan(method, (track_of(flight, [(flight[0][0], flight[-1][0])]),), ((),))


def _way_home(uav: Uav, time_s: float, x_m: float, y_m: float) -> list[tuple[float, float, float]]:
    """Return where and when the UAV lands if it flies home from a place; nothing if it is there."""
    home_s = uav.home_s(x_m, y_m)
    if uav.return_to_m is None or not 0.0 < home_s <= uav.landing_s - time_s + ROUNDING_S:
        return []
    return [(time_s + home_s, *uav.return_to_m)]


def _farthest_s(uav: Uav, x_m: float, y_m: float) -> float:
    """Return how long the UAV can fly towards a place too far for it, and still land in time.

    With a place to land, it turns where the ray to the place meets the ellipse of all points
    that are as far from start and landing together as the UAV can fly.
    """
    most_m = uav.max_flight_time_s * uav.speed_mps
    if uav.return_to_m is None or most_m == np.inf:
        return uav.max_flight_time_s
    aside = np.subtract((uav.x_m, uav.y_m), uav.return_to_m)
    there = np.subtract((x_m, y_m), (uav.x_m, uav.y_m))
    away_m = float(np.hypot(*there))
    spare_m2 = most_m**2 - float(aside @ aside)
    if away_m == 0.0 or spare_m2 <= 0.0:
        return 0.0
    return spare_m2 / (2.0 * (most_m + float(aside @ there) / away_m)) / uav.speed_mps


def track_of_legs(flight: Sequence[Timed], flown: Sequence[FlownLeg], in_transit: bool) -> Track:
    """Return the track of a flight over legs; unless in transit, the sensor is on along them."""
    if in_transit:
        return track_of(flight, [(flight[0][0], flight[-1][0])])
    on: list[tuple[float, float]] = []
    for leg in flown:
        if on and on[-1][1] == leg.start_s:
            on[-1] = (on[-1][0], leg.end_s)
        else:
            on.append((leg.start_s, leg.end_s))
    return track_of(flight, on)


def track_of(flight: Sequence[Timed], sensor_on: Sequence[tuple[float, float]]) -> Track:
    """Return the track of a flight whose sensor is on from and to these times."""
    time_s, x_m, y_m = np.array(flight, dtype=np.float64).T
    return Track(time_s, x_m, y_m, np.array(sensor_on, dtype=np.float64).reshape(-1, 2))
