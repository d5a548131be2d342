"""Six small problems, made from physics in no time, that every planner is held against."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.even_speed import Drive, at_even_speed
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.network.straight_roads import by_two_letters, figure3, grid
from planner.search.problem import Problem

MakeProblem = Callable[[], Problem]


def _driven(
    network: RoadNetwork,
    routes: Sequence[Sequence[str]],
    start_m: Floats | float,
    speed_mps: Floats,
    **how: Any,
) -> Futures:
    drives = [Drive(*pair) for pair in np.broadcast(start_m, speed_mps)]
    return at_even_speed(network, routes, drives, **how)


def paper_figure3() -> Problem:
    """Return four equally probable ways through the paper's Figure 3, at 6 to 30 m/s."""
    network = figure3()
    paths = [path.split() for path in ("AB BC CE", "AB BC CF", "AB BD DF", "AB BD DG")]
    speeds = np.tile(np.arange(6.0, 31.0), 4)
    futures = _driven(network, [p for p in paths for _ in range(25)], 0.0, speeds)
    return Problem(network, futures, Uav(-30e3, 0.0, 0.0, 100.0), Sensor(200.0), Objective(3600.0))


def short_flight() -> Problem:
    """Return the same roads; targets vanish, the sensor is off in transit, the UAV lands soon."""
    network = figure3()
    paths = [path.split() for path in ("AB BC CE", "AB BC CF", "BD DF", "BD DG")]
    futures = _driven(
        network, paths * 5, 100.0, np.linspace(10, 25, 20), gone=True, weight=np.full(20, 0.04)
    )
    uav = Uav(-5e3, 2e3, 50.0, 80.0, max_flight_time_s=500.0)
    sensor = Sensor(150.0, detects_in_transit=False)
    return Problem(network, futures, uav, sensor, Objective(1500.0))


def two_way() -> Problem:
    """Return a triangle driven both ways; the UAV starts above a node."""
    nodes = {"A": (0.0, 0.0), "B": (4000.0, 0.0), "C": (1000.0, 3000.0)}
    network = by_two_letters(nodes, "AB BA BC CB CA")
    routes = [path.split() for path in ("AB BC CB BA", "BA AB BC", "CA AB BC", "CB BC")]
    futures = _driven(network, routes * 4, 0.0, np.linspace(8, 20, 16))
    return Problem(network, futures, Uav(0.0, 0.0, 0.0, 60.0), Sensor(100.0), Objective(1200.0))


def far_grid() -> Problem:
    """Return 3 x 3 nodes, 15 km apart and driven east and south; the UAV comes from 212 km away."""
    network, rng = grid(3, 3), np.random.default_rng(5)
    routes = [_east_and_south(rng.permutation(list("eess")).tolist()) for _ in range(60)]
    starts_m, speeds = rng.uniform(0.0, 7500.0, 60), rng.uniform(15.0, 25.0, 60)
    futures = _driven(network, routes, starts_m, speeds)
    uav = Uav(-150e3, 150e3, 0.0, 100.0)
    return Problem(network, futures, uav, Sensor(500.0), Objective(10000.0))


def _east_and_south(ways: Sequence[str]) -> list[str]:
    """Return the roads of a grid that are driven from its upper left node."""
    row, column, roads = 0, 0, []
    for way in ways:
        to = (row, column + 1) if way == "e" else (row + 1, column)
        roads.append(f"r{row}c{column}-r{to[0]}c{to[1]}")
        row, column = to
    return roads


def short_return() -> Problem:
    """Return Figure 3 with a UAV that has to be back within minutes, and sees on the way home."""
    problem = paper_figure3()
    uav = Uav(0.0, 3e3, 120.0, 100.0, max_flight_time_s=420.0, return_to_m=(5e3, -6e3))
    return problem.replace(uav=uav)


def by_deadline() -> Problem:
    """Return the short flight with seven minutes to find the target, and home where it starts."""
    problem = short_flight()
    uav = Uav(-5e3, 2e3, 50.0, 80.0, max_flight_time_s=550.0, return_to_m=(-5e3, 2e3))
    return problem.replace(uav=uav, objective=Objective(problem.horizon_s, 450.0))


PROBLEMS: Mapping[str, MakeProblem] = {
    make.__name__: make
    for make in (paper_figure3, short_flight, two_way, far_grid, short_return, by_deadline)
}
