"""Stretches of streets that a pilot can follow by eye: from one crossing to another."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats
from planner.network.road_network import RoadNetwork
from planner.network.street_names import street_names

SHORTEST_M = 100.0  # a leg of a pilot
STRAIGHT_ON = (
    0.5  # cosine of how far a street may turn at a crossing and be followed without a word
)
MOST_CROSSINGS = 40  # that a street is followed past


class Stretch(NamedTuple):
    """A part of one street, flown from one crossing to another."""

    street: str
    xy_m: Floats  # (k, 2) metres, k at least 2
    from_node: int
    to_node: int


def stretches(network: RoadNetwork, nodes: Flags) -> list[Stretch]:
    """Return all stretches between two crossings of named streets.

    Parameters
    ----------
    nodes
        (V,) which crossings, by their nodes, may begin or end one.
    """
    names = street_names(network)
    ends = [node for node in np.flatnonzero(nodes).tolist() if len(names.node[node]) > 1]
    known = set(ends)
    found: dict[tuple[str, int, int], Stretch] = {}
    for node in ends:
        for road in names.roads_at[node]:
            if names.road[road]:
                for one in _followed(network, node, road):
                    if one.to_node in known and one.to_node != node:
                        found.setdefault((one.street, one.from_node, one.to_node), one)
    return [one for one in found.values() if _length_m(one.xy_m) >= SHORTEST_M]


def _followed(network: RoadNetwork, node: int, road: int) -> Iterator[Stretch]:
    """Yield a street from a crossing to each one after it, as long as it leads straight on."""
    names, start, driven = street_names(network), node, set[int]()
    way = np.zeros((0, 2))
    for _ in range(MOST_CROSSINGS):
        driven.add(road)
        shape, begins, ends = network.shape(road), network.road_from[road], network.road_to[road]
        if begins != node:
            shape, ends = shape[::-1], begins
        way, node = np.vstack([way, shape[len(way) > 0 :]]), int(ends)
        yield Stretch(names.road[road], way, start, node)
        onward = [
            (_cosine(way, network, node, other), -other)
            for other in names.roads_at[node]
            if other not in driven and names.road[other] == names.road[road]
        ]
        if not onward or max(onward)[0] < STRAIGHT_ON:
            return
        road = -max(onward)[1]


def _cosine(way: Floats, network: RoadNetwork, node: int, road: int) -> float:
    """Return the cosine of the angle by which one turns from a way onto a road."""
    shape = network.shape(road)
    if network.road_from[road] != node:
        shape = shape[::-1]
    before, after = way[-1] - way[-2], shape[1] - shape[0]
    return float(before @ after / max(np.hypot(*before) * np.hypot(*after), 1e-9))


def _length_m(xy_m: Floats) -> float:
    return float(np.hypot(*np.diff(xy_m, axis=0).T).sum())
