"""The roads of a town: what a sensor sees as one, out of the directed edges of its net.

A town's net has two directed edges per street, split at every crossing, and dual carriageways some
metres apart. A sensor of 60 m sees one road. With a tolerance, usually a third of the sensor's
radius, roads are made of edges by these rules, in this order:

1. Edges that no car may use are left out; the network keeps their names.
2. The axis of an edge is the mean of its lanes that a car may use, led to its two nodes.
3. Edges between the same two nodes are one road if their Hausdorff distance is within 1.5 times
   the tolerance. Of two single edges the mean counts; else the line of the one that more were
   merged to.
4. Nodes closer than the tolerance, and those of roads shorter than it, are contracted to one in
   their middle, as long as all that is contracted to it spans at most 1.6 times the tolerance.
   What is lost within it, such as a roundabout's ring, goes to the nearest roads. Then rule 3
   again.
5. Rule 4 is repeated until nothing changes.
6. Roads that meet at a node where no other does are joined, unless that makes a loop. Where some
   were joined, rules 3 to 6 are repeated.
7. No road is cut at a greatest length: an edge would then be of several roads. Loops stay.

Nodes and edges are taken in the order of their names, whatever the order of the file. A road has
the name and the direction of the first of its edges by name, those that begin with a minus last; a
node has the name of the first of its own. How far a road's lanes, and the ways through junctions
that lead onto them, lie off it at most is measured: ``half_width_m``.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from planner.arrays import Floats, Ints, first_of_parts
from planner.cache import cache_folder, is_whole, seal
from planner.checked import number
from planner.errors import InputError
from planner.network.beside import nearest_road, off_roads
from planner.network.contraction import Nodes, contracted
from planner.network.lines import Lines
from planner.network.links import NetFile, read_links
from planner.network.road_network import RoadNetwork
from planner.network.streets import (
    Street,
    joined_chains,
    mean_line,
    merged_abreast,
    simplified,
)
from planner.npz import load_fields, save_fields

# Goes into the name of kept columns: raise it when the rules change.
ROADS_VERSION = 1
ABREAST = 1.5  # tolerances within which edges between the same nodes are one road
SMOOTH = 0.05  # of a tolerance, by which a road's line may be simplified in the end
IN_MEMORY = 8  # networks whose roads a process keeps
TEXTS = ("node_ids", "road_ids")
ARRAYS = (
    "node_xy_m",
    "road_from",
    "road_to",
    "first_point",
    "shape_xy_m",
    "edge_road",
    "half_width_m",
    "both_ways",
)


def with_roads(network: RoadNetwork, tolerance_m: float) -> RoadNetwork:
    """Return a network whose edges are merged to roads, by the rules at the head of this file.

    What was merged is kept beside the networks, by the net's content and the tolerance.

    Parameters
    ----------
    network
        As `planner.network.read.read_net` returns it: its roads are its edges. It comes back as it
        is where it is abstract.
    tolerance_m
        0: roads stay the edges.

    Raises
    ------
    InputError
        If the tolerance is negative, roads are merged already, or the network's file cannot be
        read any more or holds a number that is none.
    """
    tolerance_m = number("tolerance_m", tolerance_m, least=0.0)
    if network.is_abstract or tolerance_m == 0.0:
        return network
    if network.is_merged:
        raise InputError("network: its roads are merged already; give the one that was read")
    return _roads(network, tolerance_m)


@lru_cache(IN_MEMORY)
def _roads(network: RoadNetwork, tolerance_m: float) -> RoadNetwork:
    name = f"{network.sha256[:32]}.merged{ROADS_VERSION}-{tolerance_m!r}.npz"
    kept = cache_folder("nets") / name
    fields = load_fields(kept, TEXTS, ARRAYS) if is_whole(kept) else None
    if fields is None or len(fields["edge_road"]) != len(network.edge_ids):
        fields = _read_and_merged(network, tolerance_m)
        save_fields(kept, fields, TEXTS)
        seal(kept)
    return replace(network, **fields)


def _read_and_merged(network: RoadNetwork, tolerance_m: float) -> dict[str, Any]:
    try:
        return merged_fields(network, read_links(network.path), tolerance_m)
    except (ValueError, LookupError) as error:
        raise InputError(
            f"{network.given_as}: its lanes or links cannot be read ({error!r}); "
            "give a .net.xml that netconvert or netedit wrote"
        ) from error


def merged_fields(network: RoadNetwork, file: NetFile, tolerance_m: float) -> dict[str, Any]:
    """Return the fields of ``RoadNetwork`` that merging changes, worked out anew.

    Parameters
    ----------
    file
        What the network's own says of lanes and links.
    tolerance_m
        Above 0.
    """
    nodes_by_name = np.argsort(np.array(network.node_ids), kind="stable")
    edges_by_name = np.array(sorted(range(len(network.edge_ids)), key=_rank(network)))
    xy_m = network.node_xy_m[nodes_by_name]
    edges = _edge_streets(network, file, np.argsort(nodes_by_name), edges_by_name)
    nodes, streets = _merged(Nodes(xy_m, xy_m, xy_m), edges, tolerance_m)
    streets = sorted(map(_directed, streets), key=lambda street: min(street.edges))
    used = np.unique([(street.start, street.end) for street in streets])
    ends = np.searchsorted(used, [(street.start, street.end) for street in streets])
    roads = _lines([simplified(street.line_m, SMOOTH * tolerance_m) for street in streets])
    edge_road = np.empty(len(edges), dtype=np.int32)
    edge_road[edges_by_name] = _edge_roads(roads, streets, edges)
    return {
        "node_ids": tuple(network.node_ids[nodes_by_name[node]] for node in used),
        "node_xy_m": nodes.xy_m[used],
        "road_ids": tuple(network.edge_ids[edges_by_name[min(one.edges)]] for one in streets),
        "road_from": ends[:, 0].astype(np.int32),
        "road_to": ends[:, 1].astype(np.int32),
        "first_point": roads.first_point,
        "shape_xy_m": roads.xy_m,
        "edge_road": edge_road,
        "half_width_m": off_roads(roads, *_driven_ways(network, file, edge_road)),
        "both_ways": np.array([len(set(street.against)) == 2 for street in streets]),
    }


def _rank(network: RoadNetwork) -> Callable[[int], tuple[bool, str]]:
    """Return by what edges are ordered; SUMO names the opposite of an edge with a minus."""
    names = network.edge_ids
    return lambda edge: (names[edge].startswith("-"), names[edge])


def _edge_streets(
    network: RoadNetwork, file: NetFile, place: Ints, edges_by_name: Ints
) -> list[Street]:
    """Return each edge as a street of its own: rules 1 and 2."""
    found = []
    for nth, edge in enumerate(edges_by_name.tolist()):
        start, end = network.road_from[edge], network.road_to[edge]
        axis_m = mean_line([lane.xy_m for lane in file.car_lanes[network.edge_ids[edge]]])
        line_m = np.vstack([network.node_xy_m[start], axis_m, network.node_xy_m[end]])
        found.append(Street(int(place[start]), int(place[end]), line_m, (nth,), (False,)))
    return found


def _merged(nodes: Nodes, streets: list[Street], tolerance_m: float) -> tuple[Nodes, list[Street]]:
    within_m, before = ABREAST * tolerance_m, (0, 0)
    streets = merged_abreast(streets, within_m)  # rule 3
    while _size(streets) != before:
        while _size(streets) != before:  # rule 5
            before = _size(streets)
            nodes, streets = contracted(nodes, streets, tolerance_m)  # rule 4
            streets = merged_abreast(streets, within_m)
        streets = merged_abreast(joined_chains(streets, len(nodes.xy_m)), within_m)  # rule 6
    return nodes, streets


def _size(streets: Sequence[Street]) -> tuple[int, int]:
    """Return how many streets there are, and nodes that they join."""
    return len(streets), len({node for one in streets for node in (one.start, one.end)})


def _directed(street: Street) -> Street:
    """Return a street in the direction of the edge that it is named after."""
    return street.turned() if street.against[street.edges.index(min(street.edges))] else street


def _lines(lines_m: Sequence[Floats]) -> Lines:
    return Lines(first_of_parts(lines_m), np.concatenate(lines_m))


def _edge_roads(roads: Lines, streets: Sequence[Street], edges: Sequence[Street]) -> Ints:
    """Return the road that each edge was merged to, or else the nearest one, (E,)."""
    found = np.full(len(edges), -1, dtype=np.int32)
    for road, street in enumerate(streets):
        found[list(street.edges)] = road
    lost = np.flatnonzero(found < 0)
    if len(lost):
        found[lost] = nearest_road(roads, _lines([edges[edge].line_m for edge in lost.tolist()]))
    return found


def _driven_ways(network: RoadNetwork, file: NetFile, edge_road: Ints) -> tuple[Lines, Ints]:
    """Return all that cars drive on, and the road of each, (W,): in a junction, the one after it.

    So recordings count: who is inside a junction is on the edge that comes next.
    """
    edge_of = network.edge_index
    ways = [(lane, edge) for name, edge in edge_of.items() for lane in file.car_lanes[name]]
    for link in file.every:
        if link["to"] in edge_of:
            ways += [(lane, edge_of[link["to"]]) for lane in file.through(link)]
    return _lines([lane.xy_m for lane, _ in ways]), edge_road[[edge for _, edge in ways]]
