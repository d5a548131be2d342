"""A plan's flight cut into what it is for: flying to a road, and flying along it."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planner.arrays import Floats
from planner.flight.plan import FlownLeg, Plan
from planner.flight.track import Track


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of one UAV's flight that has a length."""

    uav: int
    order: int  # of the road flown, from 1; 0 where none is flown
    road: int | None  # index of the road flown
    xy_m: Floats  # (k, 2) metres, k at least 2
    start_s: float
    end_s: float


def pieces(plan: Plan) -> list[Piece]:
    """Return the parts of all flights in the order in which they are flown."""
    return [
        piece
        for uav, (track, legs) in enumerate(zip(plan.tracks, plan.legs, strict=True))
        for piece in _pieces(uav, track, legs)
        if np.any(piece.xy_m != piece.xy_m[0])
    ]


def segments(plan: Plan) -> list[Piece]:
    """Return all flights from waypoint to waypoint, in the order in which they are flown."""
    return [
        Piece(uav, 0, None, np.stack([track.x_m, track.y_m], axis=1)[k : k + 2], *times_s)
        for uav, track in enumerate(plan.tracks)
        for k, times_s in enumerate(pairwise(track.time_s.tolist()))
        if track.x_m[k] != track.x_m[k + 1] or track.y_m[k] != track.y_m[k + 1]
    ]


def flight_span(plan: Plan, take_off_s: float, until_s: float = np.inf) -> tuple[float, float]:
    """Return when the first UAV takes off and the last flight ends, seconds.

    Parameters
    ----------
    take_off_s
        Of a plan that flies nowhere.
    until_s
        What is flown later is of no interest.
    """
    flown = [track for track in plan.tracks if len(track.time_s)]
    first_s = min([float(track.time_s[0]) for track in flown], default=take_off_s)
    last_s = max([track.end_s for track in flown], default=first_s)
    return first_s, max(first_s, min(last_s, until_s))


def along(xy_m: Floats, share: float) -> tuple[Floats, Floats]:
    """Return the point at a share of a polyline's length and the direction there, both (2,)."""
    steps = np.diff(xy_m, axis=0)
    steps = steps[np.any(steps != 0.0, axis=1)]
    lengths = np.linalg.norm(steps, axis=1)
    before = np.cumsum(lengths) - lengths
    reach = share * float(lengths.sum())
    step = int(np.searchsorted(before, reach, side="right")) - 1
    direction = steps[step] / lengths[step]
    return xy_m[0] + steps[:step].sum(axis=0) + (reach - before[step]) * direction, direction


def _pieces(uav: int, track: Track, legs: tuple[FlownLeg, ...]) -> Iterator[Piece]:
    if len(track.time_s) == 0:
        return
    ended_s = float(track.time_s[0])
    for order, leg in enumerate(legs, 1):
        yield Piece(uav, 0, None, _part(track, ended_s, leg.start_s), ended_s, leg.start_s)
        on_road = _part(track, leg.start_s, leg.end_s)
        yield Piece(uav, order, leg.road, on_road, leg.start_s, leg.end_s)
        ended_s = leg.end_s
    yield Piece(uav, 0, None, _part(track, ended_s, track.end_s), ended_s, track.end_s)


def _part(track: Track, start_s: float, end_s: float) -> Floats:
    between = (track.time_s > start_s) & (track.time_s < end_s)
    inner = np.stack([track.x_m[between], track.y_m[between]], axis=1)
    ends = track.xy(np.array([start_s, end_s]))
    return np.concatenate([ends[:1], inner, ends[1:]])
