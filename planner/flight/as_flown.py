"""The flight that a real aircraft makes of a line of waypoints: timed, and home before it is empty.

Wherever it is, it could still turn for home: the time used, the way home against the wind, the
landing and the reserve together never exceed what the battery lasts.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.flight.airspace import Airspace
from planner.flight.law import FlightLaw, TimedFlight, timed
from planner.flight.plan import ROUNDING_S, FlownLeg, Plan
from planner.flight.track import Track
from planner.flight.turning import LONGEST_TURN, Turned, merged, turned
from planner.flight.ways import Point

OFF_M = 0.25  # by which a track of straight, even pieces may be ahead or behind
TURNS = 1.5  # stops to turn for home: braking there, and accelerating and braking on the way


@dataclass(frozen=True)
class Battery:
    """How long an aircraft may be in the air, and where it has to be then."""

    lasts_s: float = math.inf  # from lift-off to touch-down, with the reserve
    reserve_s: float = 0.0
    home_m: tuple[float, float] | None = None  # where it lands, metres; None: where it is
    headwind_mps: float = 0.0  # on the way home
    airspace: Airspace | None = None  # that the way home keeps to; None: it is straight

    def way_home(self, place: Point) -> Floats:
        """Return the way home from a place, (k, 2) metres, without the place; none from home."""
        if self.home_m is None or place == self.home_m:
            return np.zeros((0, 2))
        if self.airspace is None:
            return np.array([self.home_m])
        return np.array(self.airspace.way_from_flight(place, self.home_m)[1:])

    def home_s(self, xy_m: Floats, law: FlightLaw, *, turns: bool = False) -> Floats:
        """Return the seconds from places, (..., 2) metres, to the ground at home.

        Parameters
        ----------
        turns
            Whether it turns for home even above it, as it has to a moment after it has left.
        """
        if self.home_m is None:
            return np.full(np.shape(xy_m)[:-1], law.descend_s)
        away_m, corners = self._away(xy_m)
        speed = law.speed_mps - self.headwind_mps
        flies_s = away_m / speed if speed > 0.0 else np.where(away_m > 0.0, math.inf, 0.0)
        stop_s = law.speed_mps / law.acceleration_mps2
        turns_s, corner_s = TURNS * stop_s, stop_s
        if not law.can_hover and speed > 0.0:
            corner_s += LONGEST_TURN * law.turn_radius_m / speed
            turns_s = corner_s
        away_s = np.where((away_m > 0.0) | turns, turns_s, 0.0) + corners * corner_s
        return np.asarray(flies_s + away_s + law.descend_s)

    def _away(self, xy_m: Floats) -> tuple[Floats, Floats]:
        """Return how far places are from home, metres, and the corners on the way."""
        assert self.home_m is not None
        if self.airspace is None:
            away_m = np.hypot(xy_m[..., 0] - self.home_m[0], xy_m[..., 1] - self.home_m[1])
            return away_m, np.zeros_like(away_m)
        rows = []
        for x_m, y_m in np.reshape(xy_m, (-1, 2)).tolist():
            way = self.way_home((x_m, y_m))
            steps_m = np.diff(np.vstack([[x_m, y_m], way]), axis=0)
            rows.append((float(np.hypot(*steps_m.T).sum()), max(0, len(way) - 1)))
        away_m, corners = np.array(rows, dtype=np.float64).reshape(*np.shape(xy_m)[:-1], 2).T
        return away_m.T, corners.T


def track_points(xy_m: Floats, flight: TimedFlight, law: FlightLaw) -> tuple[Floats, Floats]:
    """Return points of a timed flight, (T,) seconds after its first waypoint, and (T, 2) metres.

    Between them it moves evenly but for `OFF_M`: where it accelerates they are close enough.
    """
    times, places = [np.array([0.0])], [xy_m[:1]]
    for leg, cruise in enumerate(flight.cruises_mps.tolist()):
        if flight.leaves_s[leg] > flight.arrives_s[leg]:
            times.append(flight.leaves_s[leg : leg + 1])
            places.append(xy_m[leg : leg + 1])
        first, second = flight.passes_mps[leg : leg + 2].tolist()
        after_s, along_m = _motion(first, cruise, second, law, float(_length(xy_m, leg)))
        share = (along_m / along_m[-1])[:, None]
        times.append(flight.leaves_s[leg] + after_s)
        on_way = xy_m[leg] + share[:-1] * (xy_m[leg + 1] - xy_m[leg])
        places += [on_way, xy_m[leg + 1 : leg + 2]]
    if flight.leaves_s[-1] > flight.arrives_s[-1]:
        times.append(flight.leaves_s[-1:])
        places.append(xy_m[-1:])
    return np.concatenate(times), np.concatenate(places)


def home_in_time(
    xy_m: Floats, hold_s: Floats, law: FlightLaw, battery: Battery
) -> tuple[Floats, Floats]:
    """Return the line and its hovering up to where the aircraft has to turn, and the way home.

    Parameters
    ----------
    xy_m, hold_s
        As `planner.flight.law.timed` takes them, from where it takes off.
    """
    flight = timed(xy_m, hold_s, law)
    after_s, places = track_points(xy_m, flight, law)
    left_s = battery.lasts_s - battery.reserve_s - law.climb_s - after_s
    short = np.flatnonzero(left_s < battery.home_s(places, law))
    if len(short):
        spare_s = left_s - battery.home_s(places, law, turns=True)
        turn_s = _turn(after_s, spare_s, int(short[0]))
        xy_m, hold_s = _cut(xy_m, hold_s, flight, (after_s, places), turn_s)
    way = battery.way_home((float(xy_m[-1, 0]), float(xy_m[-1, 1])))
    if law.can_hover or len(way) == 0:
        return np.vstack([xy_m, way]), np.append(hold_s, np.zeros(len(way)))
    last = max(0, len(xy_m) - 2)
    home = turned(np.vstack([xy_m[last:], way]), np.zeros(len(xy_m) - last + len(way)), law)
    return np.vstack([xy_m[:last], home.xy_m]), np.append(hold_s[:last], home.hold_s)


def _length(xy_m: Floats, leg: int) -> float:
    return float(np.hypot(*(xy_m[leg + 1] - xy_m[leg])))


def _motion(
    first: float, cruise: float, second: float, law: FlightLaw, length_m: float
) -> tuple[Floats, Floats]:
    """Return seconds and metres along a leg at points of its trapezoid, without its beginning."""
    rate = law.acceleration_mps2
    if math.isinf(rate):
        return np.array([length_m / cruise]), np.array([length_m])
    after_s, along_m = [np.zeros(1)], [np.zeros(1)]

    def change(before: float, after: float) -> None:
        lasts_s = abs(after - before) / rate
        many = math.ceil(math.sqrt(rate * lasts_s**2 / 8.0 / OFF_M))
        steps_s = np.linspace(0.0, lasts_s, many + 1)[1:]
        signed = rate if after > before else -rate
        after_s.append(after_s[-1][-1] + steps_s)
        along_m.append(along_m[-1][-1] + before * steps_s + signed * steps_s**2 / 2.0)

    if cruise > first:
        change(first, cruise)
    braking_m = (cruise**2 - second**2) / (2.0 * rate)
    even_m = length_m - float(along_m[-1][-1]) - braking_m
    if even_m > 1e-9 * length_m:
        after_s.append(after_s[-1][-1:] + even_m / cruise)
        along_m.append(along_m[-1][-1:] + even_m)
    if cruise > second:
        change(cruise, second)
    return np.concatenate(after_s)[1:], np.concatenate(along_m)[1:]


def _turn(after_s: Floats, spare_s: Floats, first_short: int) -> float:
    """Return when the spare time is used up, between two points of a track; at the latest."""
    if first_short == 0:
        return 0.0
    before, after = float(spare_s[first_short - 1]), float(spare_s[first_short])
    share = max(0.0, before / (before - after))
    from_s, to_s = after_s[first_short - 1 : first_short + 1].tolist()
    return float(from_s + share * (to_s - from_s))


def _cut(
    xy_m: Floats,
    hold_s: Floats,
    flight: TimedFlight,
    track: tuple[Floats, Floats],
    turn_s: float,
) -> tuple[Floats, Floats]:
    """Return the line and its hovering as far as they are flown by a time."""
    passed = int(np.searchsorted(flight.arrives_s, turn_s, side="right"))
    kept, holds = xy_m[:passed], hold_s[:passed].copy()
    holds[-1] = min(holds[-1], turn_s - flight.arrives_s[passed - 1])
    if turn_s <= flight.leaves_s[passed - 1]:
        return kept, holds
    times_s, places = track
    here = [np.interp(turn_s, times_s, column) for column in places.T]
    return np.vstack([kept, here]), np.append(holds, 0.0)


def as_flown(plan: Plan, law: FlightLaw, battery: Battery, *, planned_mps: float) -> Plan:
    """Return a plan as a real aircraft flies it: timed by the law, and home in time.

    A plan begins when the aircraft is at its height; as flown it begins with lift-off before that,
    and ends on the ground if there is a place to land. The sensor is on at height. Roads that it
    has to leave out are left out.

    Parameters
    ----------
    planned_mps
        The even speed that the plan was made with; what is slower in it is hovering.
    """
    flown = [
        _track_flown(_line(track, planned_mps), legs, law, battery)
        for track, legs in zip(plan.tracks, plan.legs, strict=True)
    ]
    tracks, legs = zip(*flown, strict=True)
    return replace(plan, tracks=tracks, legs=legs)


def _track_flown(
    line: "_Line", legs: tuple[FlownLeg, ...], law: FlightLaw, battery: Battery
) -> tuple[Track, tuple[FlownLeg, ...]]:
    up_s = float(line.time_s[0])
    line = _Line(*(column[merged(line.xy_m, line.hold_s, law)] for column in line))
    way = turned(line.xy_m, line.hold_s, law)
    xy_m, hold_s = way.xy_m, way.hold_s
    if len(xy_m) > 1:
        xy_m, hold_s = home_in_time(xy_m, hold_s, law, battery)
    lands = battery.home_m is not None
    track, flight = line_flown(xy_m, hold_s, law, up_s=up_s, lands=lands)
    return track, _legs_flown(line, way, legs, up_s, (xy_m, flight))


def line_flown(
    xy_m: Floats, hold_s: Floats, law: FlightLaw, *, up_s: float, lands: bool
) -> tuple[Track, TimedFlight]:
    """Return the track of an aircraft that climbs, flies a line and perhaps lands, and its times.

    Parameters
    ----------
    xy_m, hold_s
        As `planner.flight.law.timed` takes them.
    up_s
        When it is at its height above the first place, and the sensor goes on.
    lands
        Whether it comes down at the last place.
    """
    flight = timed(xy_m, hold_s, law)
    after_s, places = track_points(xy_m, flight, law)
    times_s = up_s + after_s
    sensor_on = np.array([[up_s, times_s[-1]]])
    if law.climb_s > 0.0:
        times_s = np.append(up_s - law.climb_s, times_s)
        places = np.vstack([places[:1], places])
    if lands and law.descend_s > 0.0:
        times_s = np.append(times_s, times_s[-1] + law.descend_s)
        places = np.vstack([places, places[-1:]])
    return Track(times_s, places[:, 0], places[:, 1], sensor_on), flight


def _legs_flown(
    line: "_Line",
    way: Turned,
    legs: tuple[FlownLeg, ...],
    up_s: float,
    flown: tuple[Floats, TimedFlight],
) -> tuple[FlownLeg, ...]:
    """Return the legs that are flown to their ends: what was planned at a place is done there."""
    xy_m, flight = flown
    many = min(len(xy_m), len(way.xy_m))
    same = np.all(xy_m[:many] == way.xy_m[:many], axis=1)
    kept = int(np.searchsorted(way.leaves, np.argmin(np.append(same, False))))
    planned_s = np.stack([line.time_s, line.time_s + line.hold_s], axis=1)[:kept].ravel()
    there = flight.arrives_s[way.arrives[:kept]], flight.leaves_s[way.leaves[:kept]]
    flown_s = up_s + np.stack(there, axis=1).ravel()

    def at(*times_s: float) -> list[float]:
        return [float(one) for one in np.interp(times_s, planned_s, flown_s)]

    return tuple(
        FlownLeg(leg.leg, *at(leg.depart_s, leg.start_s, leg.end_s))
        for leg in legs
        if len(planned_s) and leg.end_s <= planned_s[-1] + ROUNDING_S
    )


class _Line(NamedTuple):
    """The waypoints of a planned track."""

    time_s: Floats  # (W,) seconds, when it was planned to arrive
    xy_m: Floats  # (W, 2) metres
    hold_s: Floats  # (W,) seconds of hovering there


def _line(track: Track, planned_mps: float) -> _Line:
    xy_m = np.stack([track.x_m, track.y_m], axis=1)
    moved_m = np.hypot(*np.diff(xy_m, axis=0).T)
    moves = np.append(True, moved_m > 0.0)
    waits_s = np.append(0.0, np.diff(track.time_s) - moved_m / planned_mps)
    waits_s[waits_s < ROUNDING_S] = 0.0
    hold_s = np.zeros(int(moves.sum()))
    np.add.at(hold_s, np.cumsum(moves) - 1, waits_s)
    return _Line(track.time_s[moves], xy_m[moves], hold_s)
