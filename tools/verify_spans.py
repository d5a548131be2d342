"""What a flight sees that may begin at any time within a span, for verify.py.

At any moment all flights along a straight line that begin within the span are on one segment of it.
This comes in reach of a target first with one of its ends, which is a flight from an end of the
span, or one at an end of the line; or right abreast of the target.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from verify_files import Array
from verify_sight import Motion, Route, Segment, first_in_reach, near_pairs, segments

JOINED_S = 1e-6  # pieces of motion this near in time belong together,
JOINED_M = 1e-5  # if they are as near in space


class Interval(NamedTuple):
    """Spans of time; empty, or not a number, where nothing is within them."""

    from_s: Array
    to_s: Array

    def common(self, from_s: Array, to_s: Array) -> "Interval":
        """Return what they have in common with others."""
        return Interval(np.maximum(self.from_s, from_s), np.minimum(self.to_s, to_s))

    @property
    def first_s(self) -> Array:
        """The first second; infinity if there is none."""
        return np.where(self.from_s <= self.to_s, self.from_s, np.inf)


def seen_within(
    route: Route, motion: Motion, particles: int, edges_s: Array, radius_m: float
) -> Array:
    """Return when a flight that begins between an edge and the next sees whom, at the earliest.

    Infinity if from none of these starts; (spans, N).
    """
    seen_at = np.full((len(edges_s) - 1, particles), np.inf)
    for met in _meetings(route, motion, edges_s, radius_m):
        np.minimum.at(seen_at, (met.span, met.at.particle), met.first_s)
    return seen_at


def joined(motion: Motion) -> Motion:
    """Return motion in which no piece goes on from the one before at the same velocity.

    Pieces that each begin near the end of the one before, but together leave the line of the
    first, stay as they are: of that line something else would be said than of them.
    """
    some = len(motion.particle)
    goes_on = np.diff(motion.particle) == 0
    goes_on &= np.diff(motion.velocity) == 0
    goes_on &= abs(motion.from_s[1:] - motion.to_s[:-1]) <= JOINED_S
    begins = np.append(True, ~goes_on)[:some]
    first = np.flatnonzero(begins)[np.cumsum(begins) - 1]  # of what each piece goes on from
    line = motion.place[first] + motion.velocity * (motion.from_s - motion.from_s[first])
    begins |= np.isin(first, first[abs(motion.place - line) > JOINED_M])
    first = np.flatnonzero(begins)
    last = np.append(first[1:], some)[: len(first)] - 1
    return Motion(*(column[first] for column in motion))._replace(to_s=motion.to_s[last])


def reached_within(
    route: Route, motion: Motion, particles: int, edges_s: Array, radius_m: float
) -> Array:
    """Return for how long, at most, a flight that begins between edges has whom in reach.

    Each piece of motion counts with each part of the line for as long as both may be in reach, but
    all of them for no longer than from the first to the last of them, seconds flown; (spans, N).
    """
    shape = len(edges_s) - 1, particles
    total_s, first_s, last_s = np.zeros(shape), np.full(shape, np.inf), np.full(shape, -np.inf)
    for met in _meetings(route, motion, edges_s, radius_m):
        starts_s = edges_s[met.span], edges_s[met.span + 1]
        lasts_s, flown = _reached(met.segment, met.at, starts_s, radius_m)
        long = (met.first_s < np.inf) & (flown.to_s > flown.from_s)
        where = met.span[long], met.at.particle[long]
        np.add.at(total_s, where, lasts_s[long])
        np.minimum.at(first_s, where, flown.from_s[long])
        np.maximum.at(last_s, where, flown.to_s[long])
    return np.maximum(0.0, np.minimum(total_s, last_s - first_s))


class Meetings(NamedTuple):
    """Pairs of a piece of motion and a span of starts; (pairs,) each."""

    segment: Segment  # a part of the line, the same for all
    at: Motion
    span: Array
    first_s: Array  # when they meet at the earliest; infinity: never


def _meetings(route: Route, motion: Motion, edges_s: Array, radius_m: float) -> Iterator[Meetings]:
    late_s = edges_s[1] - edges_s[0]
    for segment in segments(route, (0.0, route.time_s[-1])):
        for pieces, span in near_pairs(segment, motion, edges_s[:-1], radius_m, late_s):
            at = Motion(*(column[pieces] for column in motion))
            starts_s = edges_s[span], edges_s[span + 1]
            found = [_met_s(segment, at, start_s, radius_m) for start_s in starts_s]
            found += _between(segment, at, starts_s, radius_m)
            yield Meetings(segment, at, span, np.min(found, axis=0))


def _reached(
    segment: Segment, at: Motion, starts_s: tuple[Array, Array], radius_m: float
) -> tuple[Array, Interval]:
    """Return for how long pieces are in reach at most, and when, by seconds flown; (pairs,) each.

    Seen from a flight, a piece is at an offset that changes evenly with how late it begins, and
    with the time flown on the segment.
    """
    first, last = starts_s
    begin_s, velocity = segment.begin_s, at.velocity
    offset = at.place + velocity * (first + begin_s - at.from_s) - segment.place
    drift = velocity - segment.velocity
    squared, wide = abs(drift) ** 2, radius_m * abs(drift)
    aside, slope = _cross(offset, drift), _cross(velocity, drift)
    other = aside + slope * (last - first)
    nearest = np.fmax(0.0, np.fmax(np.minimum(aside, other), -np.maximum(aside, other)))
    chord_s = 2.0 * np.sqrt(np.maximum(0.0, wide**2 - nearest**2)) / squared
    chord_s = np.minimum(np.where(squared == 0.0, np.inf, chord_s), at.to_s - at.from_s)

    limits = (-wide - aside) / slope, (wide - aside) / slope
    level, inside = slope == 0.0, abs(aside) <= wide
    low = np.where(level, np.where(inside, 0.0, np.inf), np.fmax(0.0, np.minimum(*limits)))
    high = np.where(level, last - first, np.minimum(last - first, np.maximum(*limits)))
    turn, speed = _cross(drift, velocity), abs(velocity)
    straight = abs(turn) <= 1e-9 * abs(drift) * speed

    def passing_s(late_s: Array, sign: int) -> Array:
        there = offset + velocity * late_s
        half = np.sqrt(np.maximum(0.0, wide**2 - _cross(there, drift) ** 2))
        return (sign * half - (np.conj(there) * drift).real) / squared

    ends = []
    for sign, farther in ((-1, np.minimum), (1, np.maximum)):
        flown_s = -_cross(offset, velocity) / turn + sign * radius_m * speed / abs(turn)
        along = (np.conj(offset + drift * flown_s) * velocity).real
        turns_s = passing_s(np.minimum(np.maximum(-along / speed**2, low), high), sign)
        ends.append(
            np.where(straight, farther(passing_s(low, sign), passing_s(high, sign)), turns_s)
        )
    enters_s, leaves_s = (
        np.where(squared == 0.0, sign * np.inf, end)
        for sign, end in zip((-1, 1), ends, strict=True)
    )
    from_s = np.maximum(np.maximum(begin_s, at.from_s - last), begin_s + enters_s)
    to_s = np.minimum(np.minimum(segment.end_s, at.to_s - first), begin_s + leaves_s)
    flown = Interval(from_s, np.where((low <= high) | (squared == 0.0), to_s, -np.inf))
    return np.minimum(chord_s, flown.to_s - flown.from_s), flown


def _cross(one: Array, other: Array) -> Array:
    return (np.conj(one) * other).imag


def _met_s(segment: Segment, at: Motion, start_s: Array, radius_m: float) -> Array:
    """Return when flights begun at some times meet some pieces of motion, (pairs,); or infinity.

    With starts at an end of each span: when one end of the segment of flights comes in reach.

    Parameters
    ----------
    at
        One piece for each pair.
    start_s
        (pairs,).
    """
    on_s = np.maximum(start_s + segment.begin_s, at.from_s)
    off_s = np.minimum(start_s + segment.end_s, at.to_s)
    flown = segment.place + segment.velocity * (on_s - start_s - segment.begin_s)
    offset = at.place + at.velocity * (on_s - at.from_s) - flown
    after_s = first_in_reach(offset, at.velocity - segment.velocity, radius_m, 0.0)
    return np.where((after_s >= 0.0) & (after_s <= off_s - on_s), on_s + after_s, np.inf)


def _between(
    segment: Segment, at: Motion, starts_s: tuple[Array, Array], radius_m: float
) -> list[Array]:
    """Return when flights from within spans meet some pieces, as above; three times (pairs,).

    The first two are when a piece is in reach of the begin or the end of the line, and a flight
    from the span just there; the third is when it is right abreast of one. Infinity: never.

    Parameters
    ----------
    starts_s
        The first and the last start of each pair's span.
    """
    first, last = starts_s
    lasts_s, speed_mps = segment.end_s - segment.begin_s, abs(segment.velocity)
    ends = (
        (segment.begin_s, segment.place),
        (
            segment.end_s,
            segment.place + segment.velocity * lasts_s,
        ),
    )
    found = [
        stays(at, place, radius_m).common(first + after_s, last + after_s).first_s
        for after_s, place in ends
    ]
    turned = np.conj(segment.velocity) / speed_mps  # so that the line is the real axis
    offset, drift = (at.place - segment.place) * turned, at.velocity * turned
    flown_s, pace = offset.real / speed_mps, drift.real / speed_mps
    beside = _while(at, offset.imag, drift.imag, (-radius_m, radius_m))
    beside = beside.common(*_while(at, flown_s, pace, (0.0, lasts_s)))
    start_s = at.from_s - segment.begin_s - flown_s  # of the flight abreast of it at from
    beside = beside.common(*_while(at, start_s, 1.0 - pace, starts_s))
    return [*found, beside.first_s]


def _while(at: Motion, value: Array, slope: Array, limits: tuple[Array, Array]) -> Interval:
    """Return while value + slope (s - from) is within limits, no longer than pieces last, (pairs,).

    Parameters
    ----------
    value
        Where each piece begins, at ``from``; like ``slope`` and limits, (pairs,) or one for all.
    """
    low, high = ((limit - value) / slope for limit in limits)
    level = slope == 0.0
    inside = level & (value >= limits[0]) & (value <= limits[1])
    from_s = np.where(level, np.where(inside, -np.inf, np.inf), np.minimum(low, high))
    to_s = np.where(level, -from_s, np.maximum(low, high))
    return Interval(at.from_s, at.to_s).common(at.from_s + from_s, at.from_s + to_s)


def stays(at: Motion, place: complex, radius_m: float) -> Interval:
    """Return when pieces are within the radius of a place."""
    offset, squared = at.place - place, abs(at.velocity) ** 2
    nearest_s = -(offset * np.conj(at.velocity)).real / squared
    across = (np.conj(at.velocity) * offset).imag
    half_s = np.sqrt(squared * radius_m**2 - across**2) / squared  # not a number: never
    rests = squared == 0.0
    half_s = np.where(rests, np.where(abs(offset) <= radius_m, np.inf, np.nan), half_s)
    nearest_s = np.where(rests, 0.0, nearest_s)
    middle_s = at.from_s + nearest_s
    return Interval(at.from_s, at.to_s).common(middle_s - half_s, middle_s + half_s)


def stays_through(
    motion: Motion, particles: int, edges_s: Array, place: complex, radius_m: float
) -> Array:
    """Return whether particles are within the radius of a place throughout spans, (spans, N)."""
    stay = stays(motion, place, radius_m)
    some = np.flatnonzero(stay.from_s <= stay.to_s)
    if len(some) == 0:
        return np.zeros((len(edges_s) - 1, particles), dtype=bool)
    some = some[np.lexsort((stay.from_s[some], motion.particle[some]))]
    whose, from_s, to_s = motion.particle[some], stay.from_s[some], stay.to_s[some]
    breaks = (np.diff(whose) != 0) | (from_s[1:] - to_s[:-1] > JOINED_S)
    begins = np.flatnonzero(np.append(True, breaks))
    ends = np.append(begins[1:], len(some)) - 1
    low = np.searchsorted(edges_s, from_s[begins] - JOINED_S)
    high = np.searchsorted(edges_s, to_s[ends] + JOINED_S, side="right") - 1
    counts = np.zeros((len(edges_s) + 1, particles), dtype=np.int64)
    lasts = low < high
    np.add.at(counts, (low[lasts], whose[begins][lasts]), 1)
    np.add.at(counts, (high[lasts], whose[begins][lasts]), -1)
    return np.cumsum(counts, axis=0)[: len(edges_s) - 1] > 0
