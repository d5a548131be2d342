"""The road network as a directed graph: where targets can come from, and go round."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.arrays import Ints
from planner.network.road_network import RoadNetwork

if TYPE_CHECKING:
    import networkx as nx


def road_graph(network: RoadNetwork) -> "nx.MultiDiGraph[Any]":
    """Return the directed graph of node indices, one edge per road with the road as its key.

    A road that targets drive both ways is there in both directions.
    """
    import networkx as nx

    graph: nx.MultiDiGraph[Any] = nx.MultiDiGraph()
    graph.add_nodes_from(range(len(network.node_ids)))
    ends = zip(network.road_from.tolist(), network.road_to.tolist(), strict=True)
    back = network.both_ways.tolist()
    for road, (start, end) in enumerate(ends):
        graph.add_edge(start, end, road)
        if back[road]:
            graph.add_edge(end, start, road)
    return graph


def sources(network: RoadNetwork) -> Ints:
    """Return the nodes into which no road leads, (k,) indices."""
    ends = np.concatenate([network.road_to, network.road_from[network.both_ways]])
    degree = np.bincount(ends, minlength=len(network.node_ids))
    return np.flatnonzero(degree == 0).astype(np.int32)


def find_cycle(network: RoadNetwork) -> tuple[str, ...]:
    """Return the names of roads on which a target could drive round for ever, () if there are none.

    The cycle is one of the shortest through the first node that lies on any.
    """
    import networkx as nx

    graph = road_graph(network)
    for circle in sorted(nx.strongly_connected_components(graph), key=min):
        start = min(circle)
        if len(circle) > 1 or graph.has_edge(start, start):
            return _shortest_cycle(network, graph, start)
    return ()


def _shortest_cycle(
    network: RoadNetwork, graph: "nx.MultiDiGraph[Any]", start: int
) -> tuple[str, ...]:
    import networkx as nx

    if graph.has_edge(start, start):
        nodes = [start, start]
    else:
        before = nx.single_target_shortest_path(graph, start)
        nodes = [start, *min((before[n] for n in graph.successors(start) if n in before), key=len)]
    hops = pairwise(nodes)
    return tuple(network.road_ids[min(graph[start][end])] for start, end in hops)
