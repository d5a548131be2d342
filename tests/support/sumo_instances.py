"""Networks that netconvert builds, and particles on them."""

import os
from functools import cache
from pathlib import Path

import numpy as np

from planner.belief.particles import Driving, Particles
from planner.network.build import build_net
from planner.network.read import read_net
from planner.network.road_network import RoadNetwork

NETS = Path(__file__).parents[1] / "nets"
SHIPPED = Path(__file__).parents[2] / "sumo_nets"


def grid5x5() -> RoadNetwork:
    """The paper's grid, as it is shipped."""
    return _shipped("grid5x5", os.environ["PLANNER_CACHE"])


@cache
def _shipped(name: str, _cache_folder: str) -> RoadNetwork:
    sources = (SHIPPED / name / f"{name}.{kind}.xml" for kind in ("nod", "edg"))
    return read_net(build_net(*sources))


def town() -> RoadNetwork:
    """Two-way, curved and multi-lane streets, with a signal and a dead end that is no exit."""
    return _town(os.environ["PLANNER_CACHE"])


@cache
def _town(_cache_folder: str) -> RoadNetwork:
    sources = (NETS / "town" / f"town.{kind}.xml" for kind in ("nod", "edg"))
    return read_net(build_net(*sources, abstract=False), exits=())


def walkers(
    network: RoadNetwork,
    n: int,
    rng: np.random.Generator,
    *,
    start: str,
    roads: int,
    driving: Driving = "constant",
    speed_per_road: bool = False,
) -> Particles:
    """Particles that start within the first half of an edge and turn at random."""
    routes, speeds = [], []
    for _ in range(n):
        route = [network.edge_index[start]]
        while len(route) < roads and len(network.turns(route[-1])):
            route.append(int(rng.choice(network.turns(route[-1]))))
        routes.append(route)
        speed = rng.uniform(15, 25, len(route))
        speeds.append(speed if speed_per_road else np.full(len(route), speed[0]))
    return Particles(
        weight=np.full(n, 1 / n),
        start_m=rng.uniform(0, network.edge_length_m[network.edge_index[start]] / 2, n),
        depart_s=np.zeros(n),
        first_edge=np.concatenate(([0], np.cumsum([len(route) for route in routes]))),
        route_edge=np.concatenate(routes),
        speed_mps=np.concatenate(speeds),
        seed=rng.integers(1, 2**31 - 1, n),
        gone=np.zeros(n, dtype=bool),
        driving=driving,
    )
