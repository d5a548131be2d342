"""The ways on from each node: the legs that start there, and those after a near flight."""

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from planner.arrays import Floats, Ints, first_of_parts, first_rows
from planner.flight.legs import Legs
from planner.search.kernels.beam import BeamHops, BeamWays
from planner.search.kernels.transits import bearings_of


@lru_cache(maxsize=16)  # see the comment on caches in `what_if`
def ways_within(legs: Legs, reach_m: float) -> tuple[BeamWays, BeamHops]:
    """Return the ways and hops of a beam with transits of limited length."""
    hops = [_hops(legs.node_xy_m, node, reach_m) for node in range(len(legs.node_xy_m))]
    leaving = [np.flatnonzero(legs.from_node == node) for node in range(len(legs.node_xy_m))]
    ways = [list(_ways(node, near, leaving)) for node, (near, _, _) in enumerate(hops)]
    first_hop = first_rows([len(near) for near, _, _ in hops])
    first_way = first_of_parts(ways)
    leg, hop = np.array([way for some in ways for way in some], dtype=np.int32).reshape(-1, 2).T
    bearing, offset = (np.concatenate(part) for part in list(zip(*hops, strict=True))[1:])
    away_m = np.hypot(offset[:, 0], offset[:, 1])
    return (
        BeamWays(first_way, np.ascontiguousarray(leg), np.ascontiguousarray(hop)),
        BeamHops(first_hop, bearing, offset / away_m[:, None], away_m / legs.speed_mps),
    )


def _hops(node_xy_m: Floats, node: int, reach_m: float) -> tuple[Ints, Floats, Floats]:
    """Return the other places within reach of a node by bearing: node, bearing, offset."""
    offset = node_xy_m - node_xy_m[node]
    away_m = np.hypot(offset[:, 0], offset[:, 1])
    near = np.flatnonzero((away_m > 0.0) & (away_m <= reach_m))
    bearing = bearings_of(offset[near])
    order = np.argsort(bearing, kind="stable")
    return near[order], bearing[order], offset[near[order]]


def _ways(node: int, near: Ints, leaving: Sequence[Ints]) -> Iterator[tuple[int, int]]:
    """Yield each leg that can follow at a node, with the number of the hop to it, -1: none."""
    for hop, start in [(-1, node), *enumerate(near.tolist())]:
        for leg in leaving[start].tolist():
            yield leg, hop
