"""The paper's test case (Section 5) from physics alone: its grid, its targets, its UAV."""

import numpy as np

from planner.arrays import Floats
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.search.problem import Problem
from support.instances import grid

ROAD_M = 15000.0
HORIZON_S = 10000.0


def grid_futures(
    count: int, rng: np.random.Generator, *, size: int = 6, start_m: Floats | float | None = None
) -> Futures:
    """Independent targets on a grid of ``size`` times ``size`` nodes, one knot per node passed.

    Start uniform on the first half of the two roads at the upper left node (or ``start_m``
    along them), speed uniform on [15, 25] m/s, east or south with equal chances where both
    exist; at the lower right node they stay.
    """
    turns = 2 * (size - 1)
    if start_m is None:
        start_m = rng.uniform(0.0, ROAD_M / 2, count)
    start = np.broadcast_to(np.asarray(start_m, dtype=float), count)
    speed = rng.uniform(15.0, 25.0, count)
    node = np.zeros((turns + 1, count, 2))  # column, row
    for step in range(turns):
        east = rng.random(count) < 0.5
        east[node[step, :, 0] == size - 1] = False
        east[node[step, :, 1] == size - 1] = True
        node[step + 1] = node[step] + np.stack([east, ~east], axis=1)
    along = np.arange(turns + 1)[:, None] * ROAD_M - start
    along[0] = 0.0
    node[0] += (node[1] - node[0]) * (start / ROAD_M)[:, None]
    step = np.diff(node, axis=0)
    edge = np.concatenate([_edges(node[:-1].round(9), step, size), np.full((1, count), -1)])
    time_s, first_knot = (along / speed).T.ravel(), np.arange(count + 1) * (turns + 1)
    return Futures(
        time_s=time_s,
        x_m=(node[:, :, 0] * ROAD_M).T.ravel(),
        y_m=(-node[:, :, 1] * ROAD_M).T.ravel(),
        first_knot=first_knot,
        weight=np.full(count, 1 / count),
        gone=np.zeros(count, dtype=bool),
        edges=EdgesDriven.of_knots(edge.T.ravel(), time_s, first_knot),
    )


def _edges(node: Floats, step: Floats, size: int) -> Floats:
    """Edge driven from each knot on, numbered as ``instances.grid`` does."""
    index = {name: i for i, name in enumerate(grid(size, size).road_ids)}
    start = np.floor(node).astype(int)
    end = start + np.ceil(step).astype(int)
    names = np.concatenate([start, end], axis=2).reshape(-1, 4)
    edges = [index[f"r{b}c{a}-r{d}c{c}"] for a, b, c, d in names.tolist()]
    return np.array(edges, dtype=float).reshape(node.shape[:2])


def grid_problem(
    futures: Futures,
    *,
    distance_m: float = 0.0,
    size: int = 6,
    network: RoadNetwork | None = None,
    radius_m: float = 500.0,
    detects_in_transit: bool = True,
    take_off_s: float = 0.0,
) -> Problem:
    """The UAV at 100 m/s from ``distance_m`` north-west of the upper left node."""
    aside = distance_m / np.sqrt(2)
    return Problem(
        network=network or grid(size, size),
        futures=futures,
        uav=Uav(x_m=-aside, y_m=aside, take_off_s=take_off_s, speed_mps=100.0),
        sensor=Sensor(radius_m, detects_in_transit),
        objective=Objective(HORIZON_S),
    )
