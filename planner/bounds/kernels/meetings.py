"""When a straight flight has a target in reach that may begin at any time within a span; compiled.

A flight begun at t is at x + u (s - t) at the moment s. So all flights with starts in the span are
at that moment on a segment of their line. It comes within reach of a target first with one of its
ends, which is a flight from an end of the span, or one at an end of the way; or right abreast of
the target.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import Vector, first_within, while_within
from planner.jit import compiled

PARALLEL = 1e-9  # sine of the angle between two ways, below which they never cross


class Motion(NamedTuple):
    """Straight motions at constant velocity; one column each, (M,)."""

    from_s: Floats
    to_s: Floats  # infinity: without end
    x_m: Floats  # place at ``from_s``
    y_m: Floats
    vx_mps: Floats
    vy_mps: Floats


class Pieces(NamedTuple):
    """The straight motions of all particles, in the order of time for each of them."""

    motion: Motion  # (P,)
    particle: Ints  # (P,) which one moves


class Straight(NamedTuple):
    """One straight motion: a target's, or a part of a flight by seconds after its start."""

    from_s: float
    to_s: float
    x_m: float  # place at ``from_s``
    y_m: float
    vx_mps: float
    vy_mps: float


class Span(NamedTuple):
    """A span of time, both ends included; empty if it ends before it begins."""

    from_s: float
    to_s: float


@compiled
def straight_of(motion: Motion, i: int) -> Straight:
    """Return one of some motions."""
    return Straight(
        motion.from_s[i],
        motion.to_s[i],
        motion.x_m[i],
        motion.y_m[i],
        motion.vx_mps[i],
        motion.vy_mps[i],
    )


@compiled
def meeting(part: Straight, target: Straight, start_s: float, reach_m: float) -> float:
    """Return the first second at which a part of a flight, begun then, has a target in reach."""
    both = both_on(part, target, start_s)
    if both.from_s > both.to_s:
        return np.inf
    offset, drift = seen_from(part, target, start_s, both.from_s)
    return float(both.from_s + first_within(offset, drift, both.to_s - both.from_s, reach_m))


@compiled
def contact(part: Straight, target: Straight, start_s: float, reach_m: float) -> Span:
    """Return while a part of a flight, begun then, has a target in reach; empty if never."""
    both = both_on(part, target, start_s)
    if both.from_s > both.to_s:
        return both
    offset, drift = seen_from(part, target, start_s, both.from_s)
    within = while_within(offset, drift, both.to_s - both.from_s, reach_m)
    return Span(both.from_s + within.from_s, both.from_s + within.to_s)


@compiled
def both_on(part: Straight, target: Straight, start_s: float) -> Span:
    """Return while a part of a flight, begun then, and a target are both on their ways."""
    return Span(max(start_s + part.from_s, target.from_s), min(start_s + part.to_s, target.to_s))


@compiled
def seen_from(
    part: Straight, target: Straight, start_s: float, moment_s: float
) -> tuple[Vector, Vector]:
    """Return place and velocity of a target at a moment, from a flight begun at ``start_s``."""
    flown_s, moved_s = moment_s - start_s - part.from_s, moment_s - target.from_s
    offset = (
        target.x_m + target.vx_mps * moved_s - part.x_m - part.vx_mps * flown_s,
        target.y_m + target.vy_mps * moved_s - part.y_m - part.vy_mps * flown_s,
    )
    return offset, (target.vx_mps - part.vx_mps, target.vy_mps - part.vy_mps)


@compiled
def starts_to_meet(part: Straight, target: Straight, reach_m: float) -> Span:
    """Return a span that holds all starts from which a part of a flight has a target in reach."""
    from_s, to_s = target.from_s - part.to_s, target.to_s - part.from_s
    wx, wy = target.vx_mps - part.vx_mps, target.vy_mps - part.vy_mps
    # From the start t on, the target passes the UAV at a distance that changes evenly with t.
    crossing = part.vx_mps * wy - part.vy_mps * wx
    drift_mps = np.sqrt(wx * wx + wy * wy)
    if abs(crossing) <= PARALLEL * drift_mps * np.sqrt(part.vx_mps**2 + part.vy_mps**2):
        return Span(from_s, to_s)
    # As if both had been on their ways at the time zero, and the flight had begun then.
    x_m = target.x_m - target.vx_mps * target.from_s - part.x_m + part.vx_mps * part.from_s
    y_m = target.y_m - target.vy_mps * target.from_s - part.y_m + part.vy_mps * part.from_s
    middle_s = (y_m * wx - x_m * wy) / crossing
    half_s = reach_m * drift_mps / abs(crossing)
    return Span(max(from_s, middle_s - half_s), min(to_s, middle_s + half_s))


@compiled
def stay_in_reach(place_m: tuple[float, float], target: Straight, reach_m: float) -> Span:
    """Return when a target is within reach of a place."""
    dx, dy, vx, vy = target.x_m - place_m[0], target.y_m - place_m[1], target.vx_mps, target.vy_mps
    squared = vx * vx + vy * vy
    if squared == 0.0:
        inside = dx * dx + dy * dy <= reach_m * reach_m
        return Span(target.from_s, target.to_s) if inside else Span(np.inf, -np.inf)
    across = dx * vy - dy * vx
    discriminant = squared * reach_m * reach_m - across * across
    if discriminant < 0.0:
        return Span(np.inf, -np.inf)
    nearest_s, half_s = -(dx * vx + dy * vy) / squared, np.sqrt(discriminant) / squared
    from_s, to_s = target.from_s + nearest_s - half_s, target.from_s + nearest_s + half_s
    return Span(max(target.from_s, from_s), min(target.to_s, to_s))


@compiled
def between(span: Span, value: float, slope: float, limits: tuple[float, float]) -> Span:
    """Return the part of a span in which value + slope (s - from) is within two limits.

    ``value`` is meant at the span's beginning.
    """
    low, high = limits
    if slope == 0.0:
        return span if low <= value <= high else Span(np.inf, -np.inf)
    one, other = (low - value) / slope, (high - value) / slope
    from_s, to_s = span.from_s + min(one, other), span.from_s + max(one, other)
    return Span(max(span.from_s, from_s), min(span.to_s, to_s))


class Abreast(NamedTuple):
    """When a target is abreast of a flight's way and in reach of it."""

    span: Span
    start_s: float  # of the flight that is abreast of it at the span's beginning
    slope: float  # by how much later a flight starts that is abreast of it a second later


@compiled
def abreast(part: Straight, target: Straight, reach_m: float) -> Abreast:
    """Return when a target is in reach of the UAV right beside it, and which start that takes."""
    speed_mps = np.sqrt(part.vx_mps**2 + part.vy_mps**2)
    ux, uy = part.vx_mps / speed_mps, part.vy_mps / speed_mps
    dx, dy = target.x_m - part.x_m, target.y_m - part.y_m
    along_m, along_mps = dx * ux + dy * uy, target.vx_mps * ux + target.vy_mps * uy
    aside_m, aside_mps = dx * uy - dy * ux, target.vx_mps * uy - target.vy_mps * ux
    whole = Span(target.from_s, target.to_s)
    length_m = speed_mps * (part.to_s - part.from_s)
    first = between(whole, along_m, along_mps, (0.0, length_m))
    second = between(whole, aside_m, aside_mps, (-reach_m, reach_m))
    span = Span(max(first.from_s, second.from_s), min(first.to_s, second.to_s))
    flown_s = part.from_s + (along_m + along_mps * (span.from_s - target.from_s)) / speed_mps
    return Abreast(span, span.from_s - flown_s, 1.0 - along_mps / speed_mps)


@compiled
def first_abreast(where: Abreast, starts: Span) -> float:
    """Return the first second at which a flight with a start within a span is abreast."""
    span = between(where.span, where.start_s, where.slope, (starts.from_s, starts.to_s))
    return span.from_s if span.from_s <= span.to_s else np.inf


@compiled
def first_common(one: Span, from_s: float, to_s: float) -> float:
    """Return the first second of what two spans have in common; infinity if nothing."""
    first_s = max(one.from_s, from_s)
    return first_s if first_s <= min(one.to_s, to_s) else np.inf
