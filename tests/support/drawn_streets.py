"""Nets drawn by hand: edges along given points, lanes beside them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.arrays import Floats, first_of_parts
from planner.network.links import Lane, NetFile
from planner.network.road_network import RoadNetwork
from planner.network.roads import merged_fields

Point = tuple[float, float]
Edge = tuple[str, str, Sequence[Point]]  # from, to, and points in between
BESIDE_M = 2.0  # from an edge's line to its only lane, to the right


def drawn(nodes: Mapping[str, Point], edges: Mapping[str, Edge]) -> tuple[RoadNetwork, NetFile]:
    """A net of streets, and what its file would say of their lanes."""
    place = {name: k for k, name in enumerate(nodes)}
    lines = [np.array([nodes[a], *inner, nodes[b]], float) for a, b, inner in edges.values()]
    lengths_m = [float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in lines]
    start = np.array([place[a] for a, _, _ in edges.values()])
    end = np.array([place[b] for _, b, _ in edges.values()])
    turns = [np.flatnonzero(start == node) for node in end]
    network = RoadNetwork(
        node_ids=tuple(nodes),
        node_xy_m=np.array(list(nodes.values()), float),
        road_ids=tuple(edges),
        road_from=start,
        road_to=end,
        first_point=first_of_parts(lines),
        shape_xy_m=np.concatenate(lines),
        edge_ids=tuple(edges),
        edge_road=np.arange(len(edges)),
        edge_length_m=np.array(lengths_m),
        edge_limit_mps=np.full(len(edges), 14.0),
        edge_lanes=np.ones(len(edges)),
        first_turn=first_of_parts(turns),
        turn_edge=np.concatenate(turns),
        path=Path("drawn.net.xml"),
        sha256="0" * 64,
    )
    lanes = {
        name: [Lane(length_m, 14.0, True, _beside(line))]
        for name, line, length_m in zip(edges, lines, lengths_m, strict=True)
    }
    every = {f"{name}_0": lane for name, (lane,) in lanes.items()}
    return network, NetFile(every, lanes, {}, [], {}, {})


def _beside(line: Floats) -> Floats:
    step = np.diff(line, axis=0)
    right = np.stack([step[:, 1], -step[:, 0]], axis=1) / np.hypot(*step.T)[:, None]
    return line + BESIDE_M * np.vstack([right[:1], right])


def merged(
    nodes: Mapping[str, Point], edges: Mapping[str, Edge], tolerance_m: float = 20.0
) -> RoadNetwork:
    """The same net with its edges merged to roads."""
    network, file = drawn(nodes, edges)
    return replace(network, **merged_fields(network, file, tolerance_m))


def both(*names: str) -> dict[str, Edge]:
    """Streets with an edge each way, named after the two letters of their nodes."""
    ways = [way for name in names for way in (name, name[::-1])]
    return {way: (way[0], way[1], ()) for way in ways}
