"""Hovering in place of flying to and fro on one short road, which a real aircraft is slow at."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

import numpy as np

from planner.flight.legs import Legs
from planner.flight.plan import FlownLeg, Plan
from planner.flight.track import Track

FEW = 2  # legs of one road in a row: out and back is no flying to and fro


class Hovered(NamedTuple):
    """A leg that is flown with a stop over the middle of its road."""

    leg: int
    hover_s: float


def hovering(legs: Legs, order: Sequence[int], radius_m: float) -> list[Hovered]:
    """Return the legs to fly, and how long to hover over each, in place of an order.

    A road is short if the sensor sees all of it from its middle, or if the aircraft cannot get to
    full speed on it and stop again.
    """
    law = legs.law
    least_m = max(2.0 * radius_m, law.speed_mps**2 / law.acceleration_mps2)
    found: list[Hovered] = []
    for run in _runs(order):
        many, leg = len(run), run[0]
        lasts_s = float(legs.duration_s[leg])
        if many <= FEW or lasts_s * law.speed_mps > least_m:
            found += [Hovered(one, 0.0) for one in run]
            continue
        kept = run[: 2 - many % 2]  # so that it ends where the run does
        turn_s = law.speed_mps / law.acceleration_mps2
        found.append(Hovered(leg, (many - len(kept)) * (lasts_s + turn_s)))
        found += [Hovered(one, 0.0) for one in kept[1:]]
    return found


def _runs(order: Sequence[int]) -> Iterator[list[int]]:
    """Yield the parts of an order that fly one road to and fro, and single legs."""
    for _, group in groupby(order, Legs.road):
        run: list[int] = []
        for leg in group:
            if run and leg == run[-1]:  # it flies back on another way in between
                yield run
                run = []
            run.append(leg)
        yield run


def with_hovering(plan: Plan, hover_s: Sequence[float]) -> Plan:
    """Return a plan of one UAV that hovers over the middle of each of its legs for so long."""
    (track,), (legs,) = plan.tracks, plan.legs
    before_s, moved = 0.0, []
    for leg, lasts_s in zip(legs, hover_s, strict=False):
        depart_s, start_s, end_s = (t + before_s for t in (leg.depart_s, leg.start_s, leg.end_s))
        if lasts_s > 0.0:
            track = _stopped(track, 0.5 * (start_s + end_s), lasts_s)
        moved.append(FlownLeg(leg.leg, depart_s, start_s, end_s + lasts_s))
        before_s += lasts_s
    return replace(plan, tracks=(track,), legs=(tuple(moved),))


def _stopped(track: Track, from_s: float, lasts_s: float) -> Track:
    """Return a track that stays where it is at a time for so long, and then goes on."""
    x_m, y_m = track.xy(from_s)
    at = int(np.searchsorted(track.time_s, from_s, side="right"))
    return Track(
        np.concatenate(
            [track.time_s[:at], [from_s, from_s + lasts_s], track.time_s[at:] + lasts_s]
        ),
        np.insert(track.x_m, at, [x_m, x_m]),
        np.insert(track.y_m, at, [y_m, y_m]),
        track.sensor_on + np.where(track.sensor_on > from_s, lasts_s, 0.0),
    )
