"""From a recording to the flight that detection sees: on the target's clock, and no better.

What a recording does not say is not counted in its favour: across a break, along a leap that no
aircraft flies, and below the height from which the sensor counts, nothing is seen.
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Literal, NamedTuple

import numpy as np

from planner.arrays import Flags, Floats
from planner.clock import clock
from planner.errors import InputError
from planner.flight.law import FlightLaw
from planner.flight.track import Track
from planner.network.road_network import RoadNetwork
from planner.telemetry.log import TrackLog
from planner.telemetry.places import xy_of_log
from planner.telemetry.waypoints import between

BREAK_S = 10.0  # between two points; beyond, where it has been is taken as unknown
LIFTED_M = 0.3  # above the ground it is in the air
LEAP_MPS, LEAP = 50.0, 2.0  # what is faster, and faster than so many times its speed, is no flight

Clock = Literal["utc", "takes-off-at", "seconds"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """How a recording is understood."""

    around_m: Floats  # (k, 2) metres, where the search takes place
    horizon_s: float  # when the search ends
    law: FlightLaw  # how the aircraft flies where the recording does not tell
    lands: bool = False  # whether it comes down at its end
    sensor_from_m: float = 0.0  # above the ground, from which height on the sensor counts
    break_s: float = BREAK_S
    take_off_s: float | None = None  # seconds on the target's clock; None: as the recording says
    sighted_at: datetime | None = None  # which moment time 0 is; None: nobody said

    @property
    def descend_s(self) -> float:
        """For how long it comes down at its end, seconds."""
        return self.law.descend_s if self.lands else 0.0


@dataclass(frozen=True, eq=False)
class Flown:
    """A recorded flight on the target's clock, and how it came onto it."""

    reading: Reading
    track: Track
    clock: Clock
    heights: Literal["told", "never down", "none"]
    lift_off_s: float
    points: int
    breaks: int
    unknown_s: float  # how long the breaks are together

    @property
    def sensor_s(self) -> float:
        """How long its sensor counts, seconds."""
        return float(np.diff(self.track.sensor_on, axis=1).sum())


class _Points(NamedTuple):
    """Points at times that rise."""

    time_s: Floats  # (W,)
    xy_m: Floats  # (W, 2)
    height_m: Floats  # (W,) above the lowest one; NaN: it tells none
    unknown: Flags  # (W - 1,) whether nothing is known from one to the next


def flown(log: TrackLog, network: RoadNetwork, reading: Reading) -> Flown:
    """Return the flight that was recorded, as far as it is known.

    Raises
    ------
    InputError
        If it lacks times or places, times fall, or it has nothing to do with the search; the
        message names the point.
    """
    own_s, _ = log.times(of_day=reading.sighted_at is not None or reading.take_off_s is not None)
    points = _points(log, xy_of_log(log, network, reading.around_m), own_s, reading.law)
    heights: Literal["told", "never down", "none"] = "told"
    if np.isnan(points.height_m).any():
        heights = "none"
    elif points.height_m.max() < reading.sensor_from_m / 2:
        heights = "never down"
    if heights == "told":
        from_s, to_s = _at_height(log, points, reading.sensor_from_m)
    else:
        climb_s, descend_s = reading.law.climb_s, reading.descend_s
        if heights == "never down":
            climb_s = descend_s = 0.0
        up_s, down_s = points.time_s[0] + climb_s, points.time_s[-1] - descend_s
        from_s, to_s = np.maximum(points.time_s[:-1], up_s), np.minimum(points.time_s[1:], down_s)
    lift_off_s = _lift_off_s(points, heights, reading)
    used, shift_s = _clock(log, reading, lift_off_s)
    is_break = _breaks(points, log.is_sampled, reading)
    counted = ~is_break & (from_s <= to_s)
    track = Track(
        points.time_s + shift_s,
        points.xy_m[:, 0],
        points.xy_m[:, 1],
        _joined(from_s[counted], to_s[counted]) + shift_s,
    )
    _refuse_elsewhen(log, track, reading)
    return Flown(
        reading=reading,
        track=track,
        clock=used,
        heights=heights,
        lift_off_s=lift_off_s + shift_s,
        points=len(log),
        breaks=int(is_break.sum()),
        unknown_s=float(np.diff(points.time_s)[is_break].sum()),
    )


def _points(log: TrackLog, xy_m: Floats, own_s: Floats, law: FlightLaw) -> _Points:
    """Return points at times that rise: of those at one time the first."""
    falls = np.diff(own_s) < 0.0
    if falls.any():
        k = int(np.argmax(falls))
        raise InputError(
            f"{log.at(k + 1)}: is {own_s[k] - own_s[k + 1]:g} s earlier than the one before; "
            "times should rise: leave it out, or give each flight in a file of its own"
        )
    time_s, parts = own_s, np.cumsum(log.begins)
    if not log.is_sampled:
        time_s, xy_m = between(own_s, log.hold_s, xy_m, law)
        parts = np.zeros(len(time_s), dtype=np.int64)
    told = np.isfinite(log.height_m)
    height_m = np.full(len(time_s), np.nan)
    if told.any():
        height_m = np.interp(time_s, own_s[told], log.height_m[told])
        height_m -= height_m.min()
    kept = np.append(True, np.diff(time_s) > 0.0)
    if kept.sum() < 2:
        raise InputError(f"{log.path}: all its points are at one time; give the whole flight")
    return _Points(time_s[kept], xy_m[kept], height_m[kept], np.diff(parts[kept]) > 0)


def _at_height(log: TrackLog, points: _Points, least_m: float) -> tuple[Floats, Floats]:
    """Return from when to when it is at the sensor's height from each point to the next, (W - 1,).

    Where it is not, it is from later to earlier.
    """
    if points.height_m.max() < least_m:
        raise InputError(
            f"{log.path}: its highest point is {points.height_m.max():.1f} m above its lowest, and "
            f"the sensor counts from {least_m:g} m on; give --sensor-from METRES"
        )
    (a_s, b_s), (a_m, b_m) = (
        (column[:-1], column[1:]) for column in (points.time_s, points.height_m)
    )
    rise_m = np.where(a_m == b_m, 1.0, b_m - a_m)
    crosses_s = a_s + np.clip((least_m - a_m) / rise_m, 0.0, 1.0) * (b_s - a_s)
    up, down = a_m >= least_m, b_m >= least_m
    from_s = np.where(up, a_s, np.where(down, crosses_s, b_s))
    return from_s, np.where(down, b_s, np.where(up, crosses_s, a_s))


def _lift_off_s(points: _Points, heights: str, reading: Reading) -> float:
    """Return when it takes off, on the recording's clock.

    It is the first time in the air before the sensor counts. Without heights the recording begins
    with it; one that is never down begins at its height.
    """
    if heights == "none":
        return float(points.time_s[0])
    if heights == "never down":
        return float(points.time_s[0]) - reading.law.climb_s
    up = int(np.argmax(points.height_m >= reading.sensor_from_m))
    down = np.flatnonzero(points.height_m[:up] <= LIFTED_M)
    return float(points.time_s[min(down[-1] + 1, up) if len(down) else 0])


def _clock(log: TrackLog, reading: Reading, lift_off_s: float) -> tuple[Clock, float]:
    """Return which clock is used, and what its seconds are behind the target's."""
    if reading.take_off_s is not None:
        return "takes-off-at", reading.take_off_s - lift_off_s
    if not np.isfinite(log.utc_s).all():
        return "seconds", 0.0
    if reading.sighted_at is not None:
        return "utc", -reading.sighted_at.timestamp()
    if np.isfinite(log.time_s).all():
        return "seconds", 0.0
    raise InputError(
        f"{log.path}: has times of day, and the scenario does not say at which the target was last "
        "seen (target.sighted_at); give --takes-off-at TIME, seconds or H:M:S after that"
    )


def _breaks(points: _Points, is_sampled: bool, reading: Reading) -> Flags:
    """Return from which points to the next it is unknown where the aircraft was, (W - 1,)."""
    lasts_s = np.diff(points.time_s)
    length_m = np.hypot(*np.diff(points.xy_m, axis=0).T)
    leaps = length_m > lasts_s * max(LEAP_MPS, LEAP * reading.law.speed_mps)
    longer = lasts_s > reading.break_s if is_sampled else np.zeros(len(lasts_s), dtype=bool)
    return np.asarray(points.unknown | leaps | longer)


def _joined(from_s: Floats, to_s: Floats) -> Floats:
    """Return spans, (S, 2), of which those that follow without a break are one."""
    first = np.append(True, from_s[1:] > to_s[:-1])[: len(from_s)]
    last = np.append(first[1:], True)[: len(from_s)]
    return np.stack([from_s[first], to_s[last]], axis=1)


def _refuse_elsewhen(log: TrackLog, track: Track, reading: Reading) -> None:
    first_s, last_s = float(track.time_s[0]), track.end_s
    if last_s > 0.0 and first_s < reading.horizon_s:
        return
    raise InputError(
        f"{log.path}: is from {clock(first_s)} to {clock(last_s)} after the target was last seen, "
        f"and the search is from 0:00:00 to {clock(reading.horizon_s)}; give the lift-off: "
        "--takes-off-at TIME"
    )
