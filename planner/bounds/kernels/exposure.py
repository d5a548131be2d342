"""For how long a flight that may begin at any time within a span has a target in reach; compiled.

Seen from a flight, a target that moves straight is at an offset that changes evenly both with the
start and with the time flown. So the pairs of a start and a moment of the flight at which it is in
reach are a convex set, between two curves: one, when it leaves, that bends down as the starts
go on, and one, when it enters, that bends up. Each is farthest where its slope is zero, or at an
end of the span.
"""

import numpy as np

from planner.bounds.kernels.meetings import (
    PARALLEL,
    Span,
    Straight,
    between,
    seen_from,
)
from planner.detection.kernels.closest_approach import Vector
from planner.jit import compiled


@compiled
def longest_contact(part: Straight, target: Straight, starts: Span, reach_m: float) -> float:
    """Return how long any flight has a target in reach at most, seconds.

    As if both were on their lines for ever, but no longer than the target is on its way.
    """
    (dx, dy), (wx, wy) = _from_first(part, target, starts)
    squared = wx * wx + wy * wy
    if squared == 0.0:
        return np.inf
    aside = dx * wy - dy * wx  # by the speed at which they pass each other, as is what follows
    more = (target.vx_mps * wy - target.vy_mps * wx) * (starts.to_s - starts.from_s)
    nearest = max(0.0, min(aside, aside + more), -max(aside, aside + more))
    chord_s = 2.0 * np.sqrt(max(0.0, squared * reach_m * reach_m - nearest * nearest)) / squared
    return float(min(chord_s, target.to_s - target.from_s))


@compiled
def flown_in_reach(part: Straight, target: Straight, starts: Span, reach_m: float) -> Span:
    """Return the times flown, seconds after the start, within which a target can be in reach."""
    offset, drift = _from_first(part, target, starts)
    flown = Span(
        max(part.from_s, target.from_s - starts.to_s), min(part.to_s, target.to_s - starts.from_s)
    )
    (dx, dy), (wx, wy) = offset, drift
    vx, vy = target.vx_mps, target.vy_mps
    speed_mps, drift_mps = np.sqrt(vx * vx + vy * vy), np.sqrt(wx * wx + wy * wy)
    if drift_mps == 0.0:
        return flown
    wide = reach_m * drift_mps
    aside, more = dx * wy - dy * wx, vx * wy - vy * wx
    late = between(Span(0.0, starts.to_s - starts.from_s), aside, more, (-wide, wide))
    if late.from_s > late.to_s:
        return Span(np.inf, -np.inf)
    turn = wx * vy - wy * vx
    if abs(turn) <= PARALLEL * drift_mps * speed_mps:
        one = _in_reach(offset, drift, (vx, vy), late.from_s, reach_m)
        other = _in_reach(offset, drift, (vx, vy), late.to_s, reach_m)
        enters_s, leaves_s = min(one.from_s, other.from_s), max(one.to_s, other.to_s)
    else:
        middle_s = -(dx * vy - dy * vx) / turn
        half_s = reach_m * speed_mps / abs(turn)
        enters_s = leaves_s = 0.0
        for sign in (-1.0, 1.0):
            after_s = middle_s + sign * half_s
            along = (dx + wx * after_s) * vx + (dy + wy * after_s) * vy
            at_s = min(max(-along / (speed_mps * speed_mps), late.from_s), late.to_s)
            stay = _in_reach(offset, drift, (vx, vy), at_s, reach_m)
            if sign < 0.0:
                enters_s = stay.from_s
            else:
                leaves_s = stay.to_s
    return Span(max(flown.from_s, part.from_s + enters_s), min(flown.to_s, part.from_s + leaves_s))


@compiled
def _from_first(part: Straight, target: Straight, starts: Span) -> tuple[Vector, Vector]:
    """Return place and velocity of a target from the first of the flights as its part begins."""
    return seen_from(part, target, starts.from_s, starts.from_s + part.from_s)


@compiled
def _in_reach(
    offset: Vector, drift: Vector, velocity: Vector, late_s: float, reach_m: float
) -> Span:
    """Return while a target on its line is in reach of a flight that begins so much later.

    That is, by seconds after the part begins.
    """
    (dx, dy), (wx, wy), (vx, vy) = offset, drift, velocity
    dx, dy = dx + vx * late_s, dy + vy * late_s
    squared, across = wx * wx + wy * wy, dx * wy - dy * wx
    middle_s = -(dx * wx + dy * wy) / squared
    half_s = np.sqrt(max(0.0, squared * reach_m * reach_m - across * across)) / squared
    return Span(middle_s - half_s, middle_s + half_s)
