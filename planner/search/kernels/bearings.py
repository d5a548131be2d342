"""Rays from one place, by their bearings, and which of them pass near others; compiled."""

import numpy as np

from planner.detection.kernels.closest_approach import Vector
from planner.jit import compiled


@compiled
def bearing(x: float, y: float) -> float:
    """Return a number in [-2, 2] that grows with the direction of a vector, like its angle."""
    slope = y / (abs(x) + abs(y))
    if x >= 0.0:
        return slope
    return 2.0 - slope if y >= 0.0 else -2.0 - slope


@compiled
def turn_from(low: float, other: float) -> float:
    """Return how far one bearing lies on from another one, in [0, 4]."""
    return other - low if other >= low else other - low + 4.0


@compiled
def rays_near(x: float, y: float, reach_m: float) -> tuple[float, float]:
    """Return the bearings, lowest and how many on, of all rays from the origin near a place.

    Bearings grow at most as fast as angles in radians, and arcsin(s) <= 1.05 s up to s = 1/2.
    """
    away_m = np.sqrt(x * x + y * y)
    if away_m <= 2.0 * reach_m:
        return -2.0, 4.0
    aside = 1.05 * reach_m / away_m + 1e-9
    low = bearing(x, y) - aside
    return (low if low >= -2.0 else low + 4.0), 2.0 * aside


@compiled
def nearest_and_farthest(near: Vector, far: Vector) -> tuple[float, float]:
    """Return the least and the greatest distance of a straight line's points from the origin."""
    (x, y), (dx, dy) = near, (far[0] - near[0], far[1] - near[1])
    along = dx * dx + dy * dy
    share = min(1.0, max(0.0, -(x * dx + y * dy) / along)) if along > 0.0 else 0.0
    mx, my = x + share * dx, y + share * dy
    farthest = max(x * x + y * y, far[0] * far[0] + far[1] * far[1])
    return np.sqrt(mx * mx + my * my), np.sqrt(farthest)


@compiled
def rays_along(near: Vector, far: Vector, nearest_m: float, reach_m: float) -> tuple[float, float]:
    """Return the bearings, lowest and how many on, of all rays from the origin near a line.

    ``nearest_m`` is how near the line comes to the origin. As arcsin(s) <= pi / 2 s.
    """
    if nearest_m <= reach_m:
        return -2.0, 4.0
    aside = (1.05 if nearest_m > 2.0 * reach_m else 1.5708) * reach_m / nearest_m + 1e-9
    low, high = bearing(near[0], near[1]), bearing(far[0], far[1])
    wide = turn_from(low, high)
    if wide > 2.0:
        low, wide = high, 4.0 - wide
    low -= aside
    return (low if low >= -2.0 else low + 4.0), min(4.0, wide + 2.0 * aside)


@compiled
def both_turns(low: float, wide: float, other: float, more: float) -> tuple[float, float]:
    """Return bearings, lowest and how many on, that hold two such stretches."""
    if wide < 0.0:
        return other, more
    on, back = turn_from(low, other), turn_from(other, low)
    forward, backward = max(wide, on + more), max(more, back + wide)
    if forward <= backward:
        return low, min(4.0, forward)
    return other, min(4.0, backward)
