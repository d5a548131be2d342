"""The straight pieces of which a flight over free waypoints consists, compiled."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.detection.kernels.closest_approach import Vector
from planner.jit import compiled
from planner.search.kernels.turning import REST, Turning, corner_loss, direction

X, Y, WAIT = 0, 1, 2


class FlightPiece(NamedTuple):
    """A straight piece of flight; none if it ends before it begins."""

    from_s: float  # seconds on the target's clock
    x_m: float  # where it begins
    y_m: float
    vx_mps: float
    vy_mps: float
    to_s: float


class FlightLimits(NamedTuple):
    """What bounds a flight."""

    home_x_m: float  # where the UAV has to land; infinity: anywhere
    home_y_m: float
    landing_s: float  # by when it has to land
    ends_s: float  # when sightings cease to count
    speed_mps: float  # of the UAV
    turning: Turning


class Visit(NamedTuple):
    """How a waypoint is visited."""

    flight: FlightPiece  # to the waypoint
    wait: FlightPiece  # there
    home: FlightPiece  # if it is due
    leaves_s: float  # when the waypoint is left; infinity if the flight is over by then


NOWHERE = FlightPiece(0.0, 0.0, 0.0, 0.0, 0.0, -np.inf)  # a piece that is not flown


@compiled
def must_turn(piece: FlightPiece, limits: FlightLimits) -> float:
    """Return until when a piece of flight can go on so that the way home is still in time.

    The piece is flown at the UAV's full speed, or hovers.
    """
    from_s, x, y, vx, vy, to_s = piece
    home_x, home_y, landing_s, _, speed_mps, _ = limits
    left_m = (landing_s - from_s) * speed_mps
    if not landing_s < np.inf or not home_x < np.inf:
        return min(to_s, landing_s)
    dx, dy = x - home_x, y - home_y
    if vx == 0.0 and vy == 0.0:
        spare_s = (left_m - np.sqrt(dx * dx + dy * dy)) / speed_mps
    else:
        spare_m2 = left_m * left_m - dx * dx - dy * dy
        away = (dx * vx + dy * vy) / speed_mps + left_m
        spare_s = 0.5 * spare_m2 / away / speed_mps if spare_m2 > 0.0 else 0.0
    return float(from_s + min(to_s - from_s, max(0.0, spare_s)))


@compiled
def way_to(way: Floats, i: int) -> Vector:
    """Return the direction to a waypoint from the one before; 0, 0 from rest, or none."""
    if i < 1:
        return REST
    return direction(way[X, i] - way[X, i - 1], way[Y, i] - way[Y, i - 1])


@compiled
def lost_before(way: Floats, i: int, turning: Turning) -> float:
    """Return the seconds lost at the corner from which the flight to a waypoint begins."""
    before, after = way_to(way, i - 1), way_to(way, i)
    if way[WAIT, i - 1] > 0.0:
        return corner_loss(before, REST, turning) + corner_loss(REST, after, turning)
    return corner_loss(before, after, turning)


@compiled
def flight_to(way: Floats, i: int, now_s: float, limits: FlightLimits) -> FlightPiece:
    """Return the flight to a waypoint from the one before, which is left now.

    A corner delays the flight after it. Who is near meanwhile will be seen as it sets out.
    """
    dx, dy = way[X, i] - way[X, i - 1], way[Y, i] - way[Y, i - 1]
    begin_s = now_s + lost_before(way, i, limits.turning)
    lasts_s = np.sqrt(dx * dx + dy * dy) / limits.speed_mps
    vx, vy = (dx / lasts_s, dy / lasts_s) if lasts_s > 0.0 else (0.0, 0.0)
    return FlightPiece(begin_s, way[X, i - 1], way[Y, i - 1], vx, vy, begin_s + lasts_s)


@compiled
def wait_at(way: Floats, i: int, now_s: float) -> FlightPiece:
    """Return the wait at a waypoint, from now on."""
    return FlightPiece(now_s, way[X, i], way[Y, i], 0.0, 0.0, now_s + way[WAIT, i])


@compiled
def cut(piece: FlightPiece, until_s: float, limits: FlightLimits) -> FlightPiece:
    """Return a piece of flight up to a time, or to when sightings cease to count."""
    from_s, x, y, vx, vy, _ = piece
    return FlightPiece(from_s, x, y, vx, vy, min(until_s, limits.ends_s))


@compiled
def way_home(piece: FlightPiece, until_s: float, limits: FlightLimits) -> FlightPiece:
    """Return the flight home from where a piece of flight is at a time; none without a home."""
    from_s, x, y, vx, vy, _ = piece
    x, y = x + vx * (until_s - from_s), y + vy * (until_s - from_s)
    dx, dy = limits.home_x_m - x, limits.home_y_m - y
    lasts_s = np.sqrt(dx * dx + dy * dy) / limits.speed_mps
    if not 0.0 < lasts_s < np.inf:
        return NOWHERE
    home = FlightPiece(until_s, x, y, dx / lasts_s, dy / lasts_s, 0.0)
    return cut(home, until_s + lasts_s, limits)


@compiled
def visit(way: Floats, many: int, i: int, now_s: float, limits: FlightLimits) -> Visit:
    """Return how a waypoint, of ``many``, is visited from now on."""
    if not now_s < limits.ends_s:
        return Visit(NOWHERE, NOWHERE, NOWHERE, np.inf)
    flight = flight_to(way, i, now_s, limits)
    until_s = must_turn(flight, limits)
    if until_s < flight.to_s:
        home = way_home(flight, until_s, limits)
        return Visit(cut(flight, until_s, limits), NOWHERE, home, np.inf)
    wait = wait_at(way, i, until_s)
    leaves_s = must_turn(wait, limits)
    due = leaves_s < wait.to_s or i + 1 == many
    home = way_home(wait, leaves_s, limits) if due else NOWHERE
    left_s = leaves_s if leaves_s == wait.to_s else np.inf
    return Visit(cut(flight, until_s, limits), cut(wait, leaves_s, limits), home, left_s)
