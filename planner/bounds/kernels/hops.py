"""What hops may see and surely see from each of many start times on, compiled."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import first_within
from planner.jit import compiled

ROUNDING = 1e-9  # of a bin, by which a hop may seem to end in the next one


class Lasting(NamedTuple):
    """How many bins after their start flights may end."""

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


class Motion(NamedTuple):
    """Straight motions at constant velocity; one column each, (M,)."""

    from_s: Floats
    to_s: Floats  # infinity: without end
    x_m: Floats  # place at ``from_s``
    y_m: Floats
    vx_mps: Floats
    vy_mps: Floats


class Pieces(NamedTuple):
    """The straight motions of all particles."""

    motion: Motion  # (P,)
    particle: Ints  # (P,) which one moves


class Segment(NamedTuple):
    """A straight line from one point to another, metres."""

    x_m: float
    y_m: float
    to_x_m: float
    to_y_m: float


class Seen(NamedTuple):
    """Sightings, sorted by start and particle."""

    counts: Offsets  # (starts,) how many sightings each start has
    particle: Ints  # (M,)
    at_s: Floats  # (M,) seconds


class LegsBefore(NamedTuple):
    """The legs that may be flown just before a hop, (b,) each."""

    leg: Ints
    ago: Lasting  # how many bins before the hop they begin


@compiled
def segment_of(motion: Motion, i: int, until_s: float) -> Segment:
    """Return what one of some motions covers until a time."""
    lasts_s = until_s - motion.from_s[i]
    x_m, y_m = motion.x_m[i], motion.y_m[i]
    return Segment(x_m, y_m, x_m + motion.vx_mps[i] * lasts_s, y_m + motion.vy_mps[i] * lasts_s)


@compiled
def apart(one: Segment, other: Segment, reach_m: float) -> bool:
    """Return True only if two segments are nowhere within reach of each other."""
    return bool(
        spans_apart((one.x_m, one.to_x_m), (other.x_m, other.to_x_m), reach_m)
        or spans_apart((one.y_m, one.to_y_m), (other.y_m, other.to_y_m), reach_m)
        or on_one_side(one, other, reach_m)
        or on_one_side(other, one, reach_m)
    )


@compiled
def spans_apart(one: tuple[float, float], other: tuple[float, float], reach_m: float) -> bool:
    """Return whether two spans, given by their ends in any order, are farther apart than reach."""
    (a, b), (c, d) = one, other
    return bool(max(a, b) + reach_m < min(c, d) or max(c, d) + reach_m < min(a, b))


@compiled
def on_one_side(line: Segment, other: Segment, reach_m: float) -> bool:
    """Return whether a segment lies on one side of another one's line, farther off than reach."""
    ux, uy = line.to_x_m - line.x_m, line.to_y_m - line.y_m
    length_m = np.sqrt(ux * ux + uy * uy)
    if length_m == 0.0:
        return False
    begin_m = ((other.y_m - line.y_m) * ux - (other.x_m - line.x_m) * uy) / length_m
    end_m = ((other.to_y_m - line.y_m) * ux - (other.to_x_m - line.x_m) * uy) / length_m
    return bool(min(begin_m, end_m) > reach_m or max(begin_m, end_m) < -reach_m)


@compiled
def sweep(hop: Motion, pieces: Pieces, starts: Bins, reach_m: float, out: Floats) -> None:
    """Lower ``out`` (starts, N) to the first second at which a hop has each particle within reach.

    Parameters
    ----------
    hop
        By seconds after its start.
    starts
        When the hop begins: at the middle of each bin.
    """
    motion, last_start_s = pieces.motion, starts.first_s + (starts.total - 1) * starts.step_s
    for s in range(len(hop.from_s)):
        begin_s, end_s = hop.from_s[s], hop.to_s[s]
        x, y, ux, uy = hop.x_m[s], hop.y_m[s], hop.vx_mps[s], hop.vy_mps[s]
        way, latest_s = segment_of(hop, s, end_s), last_start_s + end_s
        for p in range(len(pieces.particle)):
            from_s, to_s = motion.from_s[p], motion.to_s[p]
            if from_s > latest_s or to_s < starts.first_s + begin_s:
                continue
            low, high = starts_to_meet(starts, (begin_s, end_s), (from_s, min(to_s, latest_s)))
            if low > high or apart(way, segment_of(motion, p, min(to_s, latest_s)), reach_m):
                continue
            k, vx, vy = pieces.particle[p], motion.vx_mps[p], motion.vy_mps[p]
            for i in range(low, high + 1):
                start_s = starts.first_s + i * starts.step_s
                on_s, off_s = max(start_s + begin_s, from_s), min(start_s + end_s, to_s)
                if on_s > off_s or out[i, k] <= on_s:
                    continue
                flown_s, moved_s = on_s - start_s - begin_s, on_s - from_s
                offset = (
                    motion.x_m[p] + vx * moved_s - x - ux * flown_s,
                    motion.y_m[p] + vy * moved_s - y - uy * flown_s,
                )
                after_s = first_within(offset, (vx - ux, vy - uy), off_s - on_s, reach_m)
                out[i, k] = min(out[i, k], on_s + after_s)


@compiled
def starts_to_meet(
    starts: Bins, flown: tuple[float, float], moved: tuple[float, float]
) -> tuple[int, int]:
    """Return the first and the last start from which a flight and a motion overlap in time.

    Parameters
    ----------
    flown
        From and to, seconds after the start.
    moved
        From and to, seconds.
    """
    (begin_s, end_s), (from_s, until_s) = flown, moved
    low = np.ceil((from_s - end_s - starts.first_s) / starts.step_s - ROUNDING)
    high = np.floor((until_s - begin_s - starts.first_s) / starts.step_s + ROUNDING)
    return max(0, int(low)), min(starts.total - 1, int(high))


@compiled
def listed(seen_at: Floats, until_s: float) -> Seen:
    """Return the sightings up to a time out of when each start sees each particle, (starts, N)."""
    counts = np.zeros(len(seen_at), dtype=np.int64)
    for i in range(len(seen_at)):
        for k in range(seen_at.shape[1]):
            counts[i] += seen_at[i, k] <= until_s
    particle, at_s, n = np.empty(counts.sum(), np.int32), np.empty(counts.sum()), 0
    for i in range(len(seen_at)):
        for k in range(seen_at.shape[1]):
            if seen_at[i, k] <= until_s:
                particle[n], at_s[n] = k, seen_at[i, k]
                n += 1
    return Seen(counts, particle, at_s)


@compiled
def known_after(first: Offsets, particle: Ints, sure: Ints, before: LegsBefore) -> Ints:
    """Return, for each sighting of a leg, after which legs its particle is surely seen, (M,).

    Bit ``b`` stands for the b-th of the legs before.

    Parameters
    ----------
    first
        Where the leg's sightings from each bin start, (bins + 1,).
    sure
        Bit ``k`` (highest first) is set where a leg begun in a bin surely sees particle ``k``,
        (legs, bins, N / 8).
    """
    known = np.zeros(len(particle), dtype=np.uint8)
    for i in range(len(first) - 1):
        for b in range(len(before.leg)):
            late, early = i - before.ago.least[b], i - before.ago.most[b]
            if early >= 0:
                for e in range(first[i], first[i + 1]):
                    byte, bit = particle[e] >> 3, 7 - (particle[e] & 7)
                    both = sure[before.leg[b], early, byte] & sure[before.leg[b], late, byte]
                    known[e] |= ((both >> bit) & 1) << b
    return known
