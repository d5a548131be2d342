"""What hops may see and surely see from each of many start times on, compiled."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.bounds.kernels.exposure import flown_in_reach, longest_contact
from planner.bounds.kernels.meetings import (
    Motion,
    Pieces,
    Span,
    Straight,
    abreast,
    first_abreast,
    first_common,
    meeting,
    starts_to_meet,
    stay_in_reach,
    straight_of,
)
from planner.jit import compiled

ROUNDING = 1e-9  # of a bin, by which a hop may seem to end in the next one


class Lasting(NamedTuple):
    """How many bins after their start flights may end; ``most`` is ``least`` or one more."""

    least: Ints  # (...)
    most: Ints  # (...)


class Bins(NamedTuple):
    """Equal spans of time, each known by its middle."""

    first_s: float  # middle of the first one
    step_s: float
    total: int

    def at(self, time_s: float) -> int:
        """Return the bin that holds a time; it may lie beyond the last one."""
        return round((time_s - self.first_s) / self.step_s)

    def lasting(self, duration_s: Floats) -> Lasting:
        """Return how many bins after their start flights of some durations, (...), may end."""
        bins = np.asarray(duration_s) / self.step_s
        least, most = np.floor(bins + ROUNDING), np.ceil(bins - ROUNDING)
        return Lasting(least.astype(np.int64), most.astype(np.int64))


class Segment(NamedTuple):
    """A straight line from one point to another, metres."""

    x_m: float
    y_m: float
    to_x_m: float
    to_y_m: float


class Encounter(NamedTuple):
    """Which particle a hop may meet, and from which bins on."""

    particle: int
    low: int  # the first bin
    high: int  # the last one


class Reached(NamedTuple):
    """For how long a hop that begins in each bin has particles in reach, (bins, N) seconds each.

    Where the sensor misses nothing, nobody asks, and there are no bins.
    """

    total_s: Floats  # at most, of all its parts together
    from_s: Floats  # after the hop's start, at the earliest
    to_s: Floats  # at the latest


class Sight(NamedTuple):
    """What a hop that begins in each bin may see."""

    at_s: Floats  # (bins, N) at the earliest, seconds; infinity: never
    found: Ints  # (bins * N,) which of these, row by row, are finite, in any order
    many: Ints  # (1,) how many
    reached: Reached


class Seen(NamedTuple):
    """Sightings, sorted by start."""

    counts: Offsets  # (starts,) how many sightings each start has
    particle: Ints  # (M,)
    at_s: Floats  # (M,) seconds
    lasts_s: Floats  # (M,) for how long, at most; (0,) where nobody asks


def blank(bins: int, particles: int, *, lasting: bool = False) -> Sight:
    """Return a sight of nobody, which notes for how long if that is asked for."""
    at_s, shape = np.full((bins, particles), np.inf), (bins if lasting else 0, particles)
    reached = Reached(np.zeros(shape), np.full(shape, np.inf), np.full(shape, -np.inf))
    return Sight(at_s, np.empty(bins * particles, np.int64), np.zeros(1, np.int64), reached)


@compiled
def apart(part: Straight, target: Straight, until_s: float, reach_m: float) -> bool:
    """Return True only if a part of a flight is nowhere within reach of a target's way.

    The target's way ends at ``until_s``.
    """
    one, other = _way(part, part.to_s), _way(target, min(target.to_s, until_s))
    return bool(
        _spans_apart((one.x_m, one.to_x_m), (other.x_m, other.to_x_m), reach_m)
        or _spans_apart((one.y_m, one.to_y_m), (other.y_m, other.to_y_m), reach_m)
        or _on_one_side(one, other, reach_m)
        or _on_one_side(other, one, reach_m)
    )


@compiled
def _way(straight: Straight, until_s: float) -> Segment:
    x_m, y_m, lasts_s = straight.x_m, straight.y_m, until_s - straight.from_s
    return Segment(x_m, y_m, x_m + straight.vx_mps * lasts_s, y_m + straight.vy_mps * lasts_s)


@compiled
def _spans_apart(one: tuple[float, float], other: tuple[float, float], reach_m: float) -> bool:
    """Return whether two spans, given by their ends in any order, are farther apart than reach."""
    (a, b), (c, d) = one, other
    return bool(max(a, b) + reach_m < min(c, d) or max(c, d) + reach_m < min(a, b))


@compiled
def _on_one_side(line: Segment, other: Segment, reach_m: float) -> bool:
    """Return whether a way lies on one side of another one's line, farther off than reach."""
    ux, uy = line.to_x_m - line.x_m, line.to_y_m - line.y_m
    length_m = np.sqrt(ux * ux + uy * uy)
    if length_m == 0.0:
        return False
    begin_m = ((other.y_m - line.y_m) * ux - (other.x_m - line.x_m) * uy) / length_m
    end_m = ((other.to_y_m - line.y_m) * ux - (other.to_x_m - line.x_m) * uy) / length_m
    return bool(min(begin_m, end_m) > reach_m or max(begin_m, end_m) < -reach_m)


@compiled
def sweep(hop: Motion, pieces: Pieces, bins: Bins, reach_m: float, out: Sight) -> None:
    """Add to a sight what a hop sees, at the earliest from any start in each bin.

    Parameters
    ----------
    hop
        By seconds after its start.
    """
    ends_s = bins.first_s + (bins.total - 0.5) * bins.step_s
    for s in range(len(hop.from_s)):
        part = straight_of(hop, s)
        for p in range(len(pieces.particle)):
            target = straight_of(pieces.motion, p)
            starts = starts_to_meet(part, target, reach_m)
            low, high = bins_with(bins, starts)
            if low > high or apart(part, target, ends_s + part.to_s, reach_m):
                continue
            pass_by(part, target, bins, Encounter(pieces.particle[p], low, high), reach_m, out)


@compiled
def pass_by(
    part: Straight,
    target: Straight,
    bins: Bins,
    who: Encounter,
    reach_m: float,
    out: Sight,
) -> None:
    """Do what ``sweep`` does for one part of a hop and one motion of a particle."""
    k, way = who.particle, _way(part, part.to_s)
    at_begin = stay_in_reach((way.x_m, way.y_m), target, reach_m)
    at_end = stay_in_reach((way.to_x_m, way.to_y_m), target, reach_m)
    beside = abreast(part, target, reach_m)
    from_s = bins.first_s + (who.low - 0.5) * bins.step_s
    before_s = meeting(part, target, from_s, reach_m)
    for i in range(who.low, who.high + 1):
        to_s = bins.first_s + (i + 0.5) * bins.step_s
        after_s = meeting(part, target, to_s, reach_m)
        first_s = min(before_s, after_s, first_abreast(beside, Span(from_s, to_s)))
        first_s = min(
            first_s,
            first_common(at_begin, from_s + part.from_s, to_s + part.from_s),
            first_common(at_end, from_s + part.to_s, to_s + part.to_s),
        )
        if first_s < out.at_s[i, k]:
            if out.at_s[i, k] == np.inf:
                out.found[out.many[0]] = i * out.at_s.shape[1] + k
                out.many[0] += 1
            out.at_s[i, k] = first_s
        if first_s < np.inf and len(out.reached.total_s) > 0:
            note_reached(part, target, Span(from_s, to_s), reach_m, out.reached, (i, k))
        from_s, before_s = to_s, after_s


@compiled
def note_reached(
    part: Straight,
    target: Straight,
    starts: Span,
    reach_m: float,
    out: Reached,
    at: tuple[int, int],
) -> None:
    """Note for how long flights that begin within a span have a target in reach."""
    flown = flown_in_reach(part, target, starts, reach_m)
    if flown.to_s > flown.from_s:
        longest_s = longest_contact(part, target, starts, reach_m)
        out.total_s[at] += min(longest_s, flown.to_s - flown.from_s)
        out.from_s[at] = min(out.from_s[at], flown.from_s)
        out.to_s[at] = max(out.to_s[at], flown.to_s)


@compiled
def bins_with(bins: Bins, starts: Span) -> tuple[int, int]:
    """Return the first and the last bin that hold starts within a span."""
    low = np.ceil((starts.from_s - bins.first_s) / bins.step_s - 0.5 - ROUNDING)
    high = np.floor((starts.to_s - bins.first_s) / bins.step_s + 0.5 + ROUNDING)
    return max(0, int(max(low, -1.0))), min(bins.total - 1, int(min(high, float(bins.total))))


@compiled
def stay_through(
    place_m: tuple[float, float], pieces: Pieces, bins: Bins, reach_m: float, out: Flags
) -> None:
    """Set ``out`` (bins, N) where a particle is within reach of a place throughout a bin."""
    since_s = np.full(out.shape[1], np.inf)  # in reach without a break
    until_s = np.full(out.shape[1], -np.inf)
    for p in range(len(pieces.particle)):
        stay = stay_in_reach(place_m, straight_of(pieces.motion, p), reach_m)
        if stay.from_s > stay.to_s:
            continue
        k = pieces.particle[p]
        since_s[k] = since_s[k] if stay.from_s <= until_s[k] else stay.from_s
        until_s[k] = stay.to_s
        low = np.ceil((since_s[k] - bins.first_s) / bins.step_s + 0.5)
        high = np.floor((until_s[k] - bins.first_s) / bins.step_s - 0.5)
        for i in range(int(max(low, 0.0)), int(min(high, bins.total - 1.0)) + 1):
            out[i, k] = True


@compiled
def listed(sight: Sight, until_s: float, seen_before: Flags) -> Seen:
    """Return sightings up to a time but for those ``seen_before`` (bins, N); clear the sight."""
    found, particles = sight.found[: sight.many[0]], sight.at_s.shape[1]
    counts, kept = np.zeros(len(sight.at_s), np.int64), np.zeros(len(found), np.bool_)
    for n in range(len(found)):
        i, k = found[n] // particles, found[n] % particles
        kept[n] = sight.at_s[i, k] <= until_s and not seen_before[i, k]
        counts[i] += kept[n]
    row = np.cumsum(counts) - counts
    particle, at_s = np.empty(counts.sum(), np.int32), np.empty(counts.sum())
    reached, asked = sight.reached, len(sight.reached.total_s) > 0
    lasts_s = np.empty(len(at_s) if asked else 0)
    for n in range(len(found)):
        i, k = found[n] // particles, found[n] % particles
        if kept[n]:
            particle[row[i]], at_s[row[i]] = k, sight.at_s[i, k]
            if asked:
                whole_s = max(0.0, reached.to_s[i, k] - reached.from_s[i, k])
                lasts_s[row[i]] = min(reached.total_s[i, k], whole_s)
            row[i] += 1
        sight.at_s[i, k] = np.inf
        if asked:
            reached.total_s[i, k], reached.from_s[i, k] = 0.0, np.inf
            reached.to_s[i, k] = -np.inf
    sight.many[0] = 0
    return Seen(counts, particle, at_s, lasts_s)
