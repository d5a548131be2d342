"""Flights that keep to no roads, and a toy on which many of them can be tried."""

import numpy as np

from planner.arrays import Floats
from planner.detection.chase import chased_alone
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.search.problem import Problem
from support.instances import grid

PITCH_M, SPEED_MPS = 1000.0, 100.0
SIDE, MOVES = 4, 5  # of the toy: places along a side, moves of a flight
STEPS_TO = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))


def reward_of(problem: Problem, time_s: Floats, x_m: Floats, y_m: Floats) -> float:
    track = Track(time_s, x_m, y_m, np.array([[time_s[0], time_s[-1]]]))
    seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
    return float(problem.futures.weight @ problem.objective.reward(seen_at))


def toy(seed: int, *, radius_m: float, by_s: float | None = None, still: bool = False) -> Problem:
    """Targets that walk about a square of 4 x 4 places, or stand on them."""
    rng, count = np.random.default_rng(seed), 6
    places = rng.permutation(SIDE * SIDE)[:count]
    first = np.stack(np.divmod(places, SIDE), axis=1) * PITCH_M
    knots = first[:, None] + np.cumsum(rng.uniform(-300, 300, (count, 4, 2)), axis=1) * (not still)
    time_s = np.tile(np.array([0.0, 20.0, 40.0, 60.0]), count)
    futures = Futures(
        time_s=time_s,
        x_m=knots[..., 0].ravel(),
        y_m=knots[..., 1].ravel(),
        first_knot=4 * np.arange(count + 1),
        weight=rng.dirichlet(np.ones(count)),
        gone=np.zeros(count, dtype=bool) if still else rng.random(count) < 0.3,
    )
    uav = Uav(*(rng.integers(SIDE, size=2) * PITCH_M), 0.0, SPEED_MPS)
    objective = Objective(300.0 if still else 80.0, by_s)
    return Problem(grid(2, 2), futures, uav, Sensor(radius_m), objective)


def lattice_flights(start: tuple[int, int]) -> list[list[tuple[int, int]]]:
    """All flights of some moves from a place of the toy to places beside it, or none."""
    flights = [[start]]
    for _ in range(MOVES):
        flights = [
            [*flight, (x, y)]
            for flight in flights
            for x, y in [(flight[-1][0] + dx, flight[-1][1] + dy) for dx, dy in STEPS_TO]
            if 0 <= x < SIDE and 0 <= y < SIDE
        ]
    return flights


def toy_flights(problem: Problem) -> list[tuple[Floats, Floats, Floats]]:
    """The flights of `lattice_flights` from where the toy's UAV takes off: time, x, y."""
    start = (round(problem.uav.x_m / PITCH_M), round(problem.uav.y_m / PITCH_M))
    time_s = np.arange(MOVES + 1) * PITCH_M / SPEED_MPS
    ways = [np.array(flight, dtype=float).T * PITCH_M for flight in lattice_flights(start)]
    return [(time_s, x_m, y_m) for x_m, y_m in ways]


def random_flight(problem: Problem, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Straight to where particles will be, as fast as can be, with some other places between."""
    uav, futures = problem.uav, problem.futures
    time_s, way = [uav.take_off_s], [(uav.x_m, uav.y_m)]
    for _ in range(12):
        k = int(rng.integers(len(futures)))
        x, y = futures.xy(k, time_s[-1] + rng.exponential(60.0))
        if not np.isfinite(x + y) or rng.random() < 0.2:
            x, y = rng.uniform(-3000, 15000, 2)
        time_s.append(time_s[-1] + float(np.hypot(x - way[-1][0], y - way[-1][1])) / uav.speed_mps)
        way.append((float(x), float(y)))
    x_m, y_m = np.array(way).T
    return np.array(time_s), x_m, y_m


def earliest(problem: Problem) -> Floats:
    """When each particle could be seen if it were the only one, (N,) seconds."""
    return chased_alone(problem.futures, problem.uav, problem.sensor)
