"""Networks of straight roads, made from nothing but points: without SUMO, in no time."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from planner.arrays import first_of_parts
from planner.network.road_network import RoadNetwork


def network_of_roads(
    nodes: Mapping[str, tuple[float, float]],
    roads: Sequence[tuple[str, str, str]],
    *,
    limit_mps: float = 50.0,
) -> RoadNetwork:
    """Straight roads (name, from, to); a target may turn into every road that leaves the end."""
    place = {name: i for i, name in enumerate(nodes)}
    xy = np.array(list(nodes.values()), dtype=float)
    start = np.array([place[road[1]] for road in roads], dtype=int)
    end = np.array([place[road[2]] for road in roads], dtype=int)
    turns = [np.flatnonzero(start == node) for node in end]
    return RoadNetwork(
        node_ids=tuple(nodes),
        node_xy_m=xy,
        road_ids=tuple(road[0] for road in roads),
        road_from=start,
        road_to=end,
        first_point=np.arange(len(roads) + 1) * 2,
        shape_xy_m=np.stack([xy[start], xy[end]], axis=1).reshape(-1, 2),
        edge_ids=tuple(road[0] for road in roads),
        edge_road=np.arange(len(roads)),
        edge_length_m=np.linalg.norm(xy[end] - xy[start], axis=1),
        edge_limit_mps=np.full(len(roads), limit_mps),
        edge_lanes=np.ones(len(roads), dtype=int),
        first_turn=first_of_parts(turns),
        turn_edge=np.concatenate(turns) if turns else np.zeros(0, dtype=int),
        path=Path("tiny.net.xml"),
        sha256=hashlib.sha256(repr((dict(nodes), list(roads))).encode()).hexdigest(),
    )


def by_two_letters(nodes: Mapping[str, tuple[float, float]], roads: str) -> RoadNetwork:
    """Network whose road names are their two nodes, as ``AB BC``."""
    return network_of_roads(nodes, [(road, road[0], road[1]) for road in roads.split()])


def figure3() -> RoadNetwork:
    """Figure 3 of the paper; as in ``sumo_nets/figure3``."""
    kilometres = {
        "A": (0, 0),
        "B": (5, 0),
        "C": (10, 4),
        "D": (10, -4),
        "E": (15, 8),
        "F": (15, 0),
        "G": (15, -8),
    }
    nodes = {name: (x * 1000.0, y * 1000.0) for name, (x, y) in kilometres.items()}
    return by_two_letters(nodes, "AB BC BD CE CF DF DG")


def grid(rows: int, columns: int, *, road_m: float = 15000.0) -> RoadNetwork:
    """Crossroads ``r<row>c<col>``, rows southward, roads directed east or south."""
    cells = [(row, column) for row in range(rows) for column in range(columns)]
    nodes = {f"r{row}c{col}": (col * road_m, -row * road_m) for row, col in cells}
    roads = [
        (f"{start}-{end}", start, end)
        for row, col in cells
        for start in [f"r{row}c{col}"]
        for end in [f"r{row}c{col + 1}", f"r{row + 1}c{col}"]
        if end in nodes
    ]
    return network_of_roads(nodes, roads)
