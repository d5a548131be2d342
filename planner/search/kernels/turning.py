"""What corners cost a real aircraft, compiled; `planner.flight.law` has the same in NumPy."""

from typing import NamedTuple

import numpy as np

from planner.detection.kernels.closest_approach import Vector
from planner.flight.law import STRAIGHT
from planner.jit import compiled

REST = (0.0, 0.0)  # the direction of an aircraft that hovers


class Turning(NamedTuple):
    """How an aircraft takes corners, in which wind."""

    speed_mps: float  # through the air
    acceleration_mps2: float  # infinity: that of the ideal aircraft
    corner_m: float  # how far from a corner it may pass
    east_mps: float  # where the air moves to
    north_mps: float


@compiled
def direction(dx: float, dy: float) -> Vector:
    """Return the unit vector of an offset; 0, 0 of none."""
    length = np.sqrt(dx * dx + dy * dy)
    return (dx / length, dy / length) if length > 0.0 else (0.0, 0.0)


@compiled
def ground_speed(way: Vector, turning: Turning) -> float:
    """Return how fast it is over ground in a direction; 0 at rest."""
    x, y = way
    along = turning.east_mps * x + turning.north_mps * y
    across = turning.north_mps * x - turning.east_mps * y
    if (x == 0.0 and y == 0.0) or abs(across) >= turning.speed_mps:
        return 0.0
    speed: float = along + np.sqrt(turning.speed_mps * turning.speed_mps - across * across)
    return max(0.0, speed)


@compiled
def corner_loss(before: Vector, after: Vector, turning: Turning) -> float:
    """Return by how much a corner between two directions delays it, seconds; 0, 0 is rest."""
    rate = turning.acceleration_mps2
    if not rate < np.inf:
        return 0.0
    first, second = ground_speed(before, turning), ground_speed(after, turning)
    cosine = before[0] * after[0] + before[1] * after[1]
    half, passes = np.sqrt(max(0.0, (1.0 + cosine) / 2.0)), min(first, second)
    if half <= STRAIGHT:
        passes = min(passes, np.sqrt(rate * turning.corner_m * half / (1.0 - half)))
    lost = 0.0
    for top in (first, second):
        if top > 0.0:
            lost += (top - passes) * (top - passes) / top
    return float(lost / (2.0 * rate))


@compiled
def loss_on_way(heading: Vector, transit: Vector, leg: Vector, turning: Turning) -> float:
    """Return the seconds lost from a heading through a transit, 0, 0 if there is none, to a leg."""
    way = heading if transit[0] == 0.0 and transit[1] == 0.0 else transit
    return corner_loss(heading, way, turning) + corner_loss(way, leg, turning)
