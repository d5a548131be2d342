"""Names that people use: streets and their crossings, in place of the ids of a net."""

import difflib
from collections import defaultdict
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.messages import suggestion
from planner.network.road_network import RoadNetwork

IN_MEMORY = 8  # networks whose names a process keeps
ALONG_M = 400.0  # how far along a street another one is looked for that crosses it
SHOWN = 5  # edges of a street that a message names
NEAR = 0.75  # how alike, from 0 to 1, a street's name is to one that was given


class StreetNames(NamedTuple):
    """What roads and nodes are called."""

    road: tuple[str, ...]  # R names, "" where there is none
    node: tuple[tuple[str, ...], ...]  # V, the names of the streets that meet there, longest first
    roads_at: tuple[tuple[int, ...], ...]  # V, the roads that begin or end there


@lru_cache(IN_MEMORY)
def street_names(network: RoadNetwork) -> StreetNames:
    """Return what the roads and nodes of a network are called.

    A road has the name that most metres of its edges have.
    """
    road = _road_streets(network)
    length_m: dict[str, float] = defaultdict(float)
    for name, metres in zip(road, network.road_length_m.tolist(), strict=True):
        length_m[name] += metres
    roads_at: list[list[int]] = [[] for _ in network.node_ids]
    ends = zip(network.road_from.tolist(), network.road_to.tolist(), strict=True)
    for index, nodes in enumerate(ends):
        for node in dict.fromkeys(nodes):
            roads_at[node].append(index)
    met = [{road[index] for index in roads} - {""} for roads in roads_at]
    node = [sorted(names, key=lambda name: (-length_m[name], name)) for names in met]
    return StreetNames(road, tuple(map(tuple, node)), tuple(map(tuple, roads_at)))


def _road_streets(network: RoadNetwork) -> tuple[str, ...]:
    named: list[dict[str, float]] = [{} for _ in network.road_ids]
    edges = zip(network.edge_road.tolist(), network.edge_street, network.edge_length_m, strict=True)
    for road, name, length_m in edges:
        if name:
            named[road][name] = named[road].get(name, 0.0) + float(length_m)
    return tuple(max(names, key=lambda n: (names[n], n)) if names else "" for names in named)


def has_street_names(network: RoadNetwork) -> bool:
    """Return whether any edge of a network has the name of a street."""
    return any(network.edge_street)


def named_share(network: RoadNetwork) -> float:
    """Return which share of the edges' length lies in streets with a name, 0 to 1."""
    named = np.array([bool(name) for name in network.edge_street])
    return float(network.edge_length_m[named].sum() / network.edge_length_m.sum())


class StreetAt(NamedTuple):
    """What is driven on nearest to a place."""

    name: str  # of the street, "" where it has none
    edge: int
    away_m: float


def street_at(network: RoadNetwork, xy_m: Floats) -> StreetAt:
    """Return the street nearest to a place, (2,) metres."""
    near = network.edge_lines.nearest(xy_m)
    return StreetAt(network.edge_street[near.line], near.line, near.away_m)


def nearest_node(network: RoadNetwork, xy_m: Floats) -> tuple[int, float]:
    """Return the node nearest to a place, (2,) metres, and how far away it is, metres."""
    away_m = np.hypot(*(network.node_xy_m - xy_m).T)
    node = int(np.argmin(away_m))
    return node, float(away_m[node])


def crossed(network: RoadNetwork, xy_m: Floats, street: str, within_m: float) -> str:
    """Return what crosses a street at a place, (2,) metres; of no street, what meets there.

    Parameters
    ----------
    within_m
        Of the place is the crossing, else it is "".
    """
    node, away_m = nearest_node(network, xy_m)
    others = [name for name in street_names(network).node[node] if name != street]
    if away_m > within_m or not others:
        return ""
    return others[0] if street else " / ".join(others[:2])


def crossing(network: RoadNetwork, node: int) -> str:
    """Return what a node is called: "Rudower Chaussee / Wegedornstraße"; its id if need be."""
    names, name = street_names(network).node[node], network.node_ids[node]
    return " / ".join(names[:2]) if len(names) > 1 else ", ".join((*names, name))


def road_phrase(network: RoadNetwork, leg: int) -> str:
    """Return what a road flown in one direction is called.

    As in "Rudower Chaussee, from Wegedornstraße towards Groß-Berliner Damm"; a road without a name
    is called by its id, and an end without another street is left out.

    Parameters
    ----------
    leg
        ``2 * road`` along the road, ``2 * road + 1`` against it.
    """
    name, start, end = _called(network, leg)
    if start and end and start != end:
        return f"{name}, from {start} towards {end}"
    if end:
        return f"{name}, at {end}" if start else f"{name}, towards {end}"
    return f"{name}, from {start}" if start else name


def _called(network: RoadNetwork, leg: int) -> tuple[str, str, str]:
    """Return a leg's street and those that cross it at its start and its end; "" for none."""
    road, against = divmod(leg, 2)
    ends = [int(network.road_from[road]), int(network.road_to[road])]
    start, end = (_cross_street(network, road, node) for node in (ends[::-1] if against else ends))
    return street_names(network).road[road] or network.road_ids[road], start, end


def _cross_street(network: RoadNetwork, road: int, node: int) -> str:
    """Return the street that crosses a road's at one of its ends, or next beyond; "" for none."""
    names = street_names(network)
    street, beyond_m, driven = names.road[road], 0.0, {road}
    while beyond_m <= ALONG_M:
        others = [name for name in names.node[node] if name != street]
        if others:
            return others[0]
        onward = [r for r in names.roads_at[node] if r not in driven and names.road[r] == street]
        if not onward or not street:
            return ""
        driven.update(onward)  # the way back is among them where a road has two directions
        node = _other_end(network, onward[0], node)
        beyond_m += float(network.road_length_m[onward[0]])
    return ""


def _other_end(network: RoadNetwork, road: int, node: int) -> int:
    start, end = int(network.road_from[road]), int(network.road_to[road])
    return end if start == node else start


def no_edge(name: str, network: RoadNetwork) -> str:
    """Return what is wrong with a name that is not that of an edge for cars, and the remedy."""
    if name in network.closed_edges:
        return "is not for cars; name an edge that a car may use"
    folded = {street.casefold(): street for street in network.edge_street if street}
    if name.casefold() in folded:
        return f"is a street; its edges are {_edges_of(folded[name.casefold()], network)}"
    near = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=NEAR)
    if near and not difflib.get_close_matches(name, network.edge_ids, n=1, cutoff=NEAR):
        street = folded[near[0]]
        text = "is not an edge of the network; did you mean the street"
        return f"{text} {street}? its edges are {_edges_of(street, network)}"
    return f"is not an edge of the network; {suggestion(name, network.edge_ids)}"


def _edges_of(street: str, network: RoadNetwork) -> str:
    pairs = zip(network.edge_ids, network.edge_street, strict=True)
    edges = [edge for edge, name in pairs if name == street]
    return ", ".join([*edges[:SHOWN], *(["..."] if len(edges) > SHOWN else [])])
