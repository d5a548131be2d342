"""What a net is like, measured: how large, how connected, and what a car meets on it."""

import re
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.network.georeference import grid_convergence_deg, is_georeferenced, lonlat
from planner.network.road_network import RoadNetwork
from planner.network.street_names import has_street_names, named_share
from planner.xml_guard import elements_in

COUNTED = re.compile(rb"<(?:tlLogic|roundabout)[\s/>]")
SAME_M = 0.01  # ends of edges that are one place
SHOWN = 3  # names in a remark


@dataclass(frozen=True)
class Survey:
    """The measures of a net."""

    edges: int  # for cars
    closed_edges: int  # for others alone
    edge_km: float
    roads: int  # what is flown
    road_km: float
    nodes: int
    extent_m: tuple[float, float]  # east and north
    lonlat_deg: tuple[float, float, float, float] | None  # west, south, east, north
    projection: str | None  # None: none that PROJ understands
    convergence_deg: float | None  # how far the net's north lies east of true north, in its middle
    named_share: float  # of the edges' length, in streets with a name
    pieces: int  # that no road joins
    components: int  # within which cars get from everywhere to everywhere
    main_share: float  # of the edges' length, in the largest of these
    dead_ends: int  # edges after which a car can only turn round, or stays
    exits: int
    signals: int
    roundabouts: int
    not_reached: tuple[str, ...]  # edges to which no car gets from the largest component
    not_left: tuple[str, ...]  # edges from which no car gets to it, or off the map
    rings: bool  # whether it is nothing but circles: nowhere is there a turn to choose
    attribution: str

    def as_dict(self) -> dict[str, Any]:
        """Return the measures as plain data."""
        return asdict(self)


def survey(network: RoadNetwork) -> Survey:
    """Return the measures of a network."""
    labels, count = _strong(network)
    main, circles = _main(network, labels, count)
    length_m = network.edge_length_m
    not_reached = ~_reached(network, main)
    not_left = ~_reached(network, main | network.edge_exit, backwards=True)
    low, high = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    signals, roundabouts = _counted(network)
    return Survey(
        edges=len(network.edge_ids),
        closed_edges=len(network.closed_edge_ids),
        edge_km=float(length_m.sum()) / 1000,
        roads=len(network.road_ids),
        road_km=float(network.road_length_m.sum()) / 1000,
        nodes=len(network.node_ids),
        extent_m=(float(high[0] - low[0]), float(high[1] - low[1])),
        lonlat_deg=_bounds_deg(network, low, high),
        projection=network.projection if is_georeferenced(network) else None,
        convergence_deg=_convergence_deg(network, (low + high) / 2),
        named_share=named_share(network),
        pieces=_pieces(network),
        components=circles,
        main_share=float(length_m[main].sum() / length_m.sum()) if circles else 0.0,
        dead_ends=int(_dead_ends(network).sum()),
        exits=int(network.edge_exit.sum()),
        signals=signals,
        roundabouts=roundabouts,
        not_reached=_names(network, not_reached) if circles else (),
        not_left=_names(network, not_left) if circles else (),
        rings=_is_rings(network),
        attribution=network.attribution,
    )


def _names(network: RoadNetwork, which: Flags) -> tuple[str, ...]:
    return tuple(network.edge_ids[edge] for edge in np.flatnonzero(which))


def _ways(network: RoadNetwork) -> tuple[Ints, Ints]:
    """Return the edges that turns leave and lead to, of those that drivers take."""
    left = np.repeat(np.arange(len(network.edge_ids)), np.diff(network.first_turn))
    onward = ~network.turn_back
    return left[onward], network.turn_edge[onward]


def _graph(left: Ints, to: Ints, count: int) -> Any:
    from scipy.sparse import coo_array

    return coo_array((np.ones(len(left), np.int8), (left, to)), shape=(count, count)).tocsr()


def _strong(network: RoadNetwork) -> tuple[Ints, int]:
    from scipy.sparse.csgraph import connected_components

    graph = _graph(*_ways(network), len(network.edge_ids))
    count, labels = connected_components(graph, directed=True, connection="strong")
    return labels, int(count)


def _main(network: RoadNetwork, labels: Ints, count: int) -> tuple[Flags, int]:
    """Return the edges of the longest strong component, (E,), and how many there are.

    A single edge is one only if it leads to itself.
    """
    left, to = _ways(network)
    circular = np.zeros(count, bool)
    circular[labels[left][labels[left] == labels[to]]] = True
    if not circular.any():
        return np.zeros(len(labels), bool), 0
    length_m = np.bincount(labels, weights=network.edge_length_m, minlength=count)
    return labels == np.argmax(np.where(circular, length_m, -1.0)), int(circular.sum())


def _reached(network: RoadNetwork, start: Flags, *, backwards: bool = False) -> Flags:
    """Return to which edges a car gets from some, (E,); backwards: from which it gets to them."""
    from scipy.sparse.csgraph import breadth_first_order

    left, to = _ways(network)
    edges = len(network.edge_ids)
    sources = np.flatnonzero(start)
    # One more place, from which all starts are a step away.
    before, after = (to, left) if backwards else (left, to)
    before, after = np.append(before, np.full(len(sources), edges)), np.append(after, sources)
    graph = _graph(before, after, edges + 1)
    order = breadth_first_order(graph, edges, return_predecessors=False)
    reached = np.zeros(edges + 1, bool)
    reached[order] = True
    return reached[:edges]


def reach_m(network: RoadNetwork, edge: int) -> float:
    """Return how many metres of edges a car gets to from an edge, this one included.

    Infinity where it gets off the map.
    """
    start = np.zeros(len(network.edge_ids), bool)
    start[edge] = True
    reached = _reached(network, start)
    if np.any(reached & network.edge_exit):
        return float("inf")
    return float(network.edge_length_m[reached].sum())


def _pieces(network: RoadNetwork) -> int:
    from scipy.sparse.csgraph import connected_components

    graph = _graph(network.road_from, network.road_to, len(network.node_ids))
    used = np.unique(np.concatenate((network.road_from, network.road_to)))
    labels = connected_components(graph, directed=False)[1]
    return len(np.unique(labels[used]))


def _dead_ends(network: RoadNetwork) -> Flags:
    """Return the edges after which a car stays or drives back where it came from, (E,)."""
    every = np.arange(len(network.edge_ids))
    begin, end = network.edge_xy(every, 0.0), network.edge_xy(every, network.edge_length_m)
    left, to = _ways(network)
    there = np.linalg.norm(end[to] - begin[left], axis=1) <= SAME_M
    back = there & (np.linalg.norm(begin[to] - end[left], axis=1) <= SAME_M)
    onward = np.bincount(left[~back], minlength=len(every)) > 0
    return ~onward & ~network.edge_exit


def _is_rings(network: RoadNetwork) -> bool:
    left, to = _ways(network)
    counts = np.bincount(left, minlength=len(network.edge_ids))
    again = np.bincount(to, minlength=len(network.edge_ids))
    return bool(np.all(counts == 1) and np.all(again == 1) and not _dead_ends(network).any())


def _counted(network: RoadNetwork) -> tuple[int, int]:
    found = elements_in(network.path, COUNTED)
    signals = {said.get("id") for name, said in found if name == "tlLogic"}
    return len(signals), sum(name == "roundabout" for name, _ in found)


def _bounds_deg(
    network: RoadNetwork, low: Floats, high: Floats
) -> tuple[float, float, float, float] | None:
    if not is_georeferenced(network):
        return None
    corners = np.array([low, (low[0], high[1]), high, (high[0], low[1])])
    places = lonlat(network, corners)
    west, south = places.min(axis=0).tolist()
    east, north = places.max(axis=0).tolist()
    return west, south, east, north


def _convergence_deg(network: RoadNetwork, middle_m: Floats) -> float | None:
    if not is_georeferenced(network):
        return None
    return float(grid_convergence_deg(network, middle_m))


def remarks(found: Survey, network: RoadNetwork) -> list[str]:
    """Return what deserves to be known of a net before anything is planned on it, a line each."""
    lines = [
        (found.projection is None, _no_projection(network)),
        (not has_street_names(network), "no street has a name: roads are called by their ids"),
        (found.roads == 1 or _is_one_road(network), "there is one road only: nothing to choose"),
        (found.rings, "nothing but a ring of one-way roads: a target drives round for ever"),
        (
            found.pieces > 1,
            f"it is in {found.pieces} pieces, which no road joins: a target stays in its own",
        ),
        (bool(found.not_reached), edges_told(found.not_reached, "no car gets to from elsewhere")),
        (bool(found.not_left), edges_told(found.not_left, "no car gets away from")),
        (
            found.exits == 0 and not network.is_abstract,
            "no exits: a closed box, which nobody leaves (network.exits)",
        ),
    ]
    return [text for holds, text in lines if holds]


def _no_projection(network: RoadNetwork) -> str:
    if network.projection is None:
        return "no projection: places are metres in the net's frame, without longitude and latitude"
    return f"PROJ does not know its projection, {network.projection}: places are metres only"


def _is_one_road(network: RoadNetwork) -> bool:
    ends = np.sort(np.stack([network.road_from, network.road_to], axis=1), axis=1)
    return len(ends) == 2 and len(np.unique(ends, axis=0)) == 1


def edges_told(names: tuple[str, ...], what: str) -> str:
    """Return how many edges something is true of, in words, with the first of their names."""
    more = ", ..." if len(names) > SHOWN else ""
    edges = "1 edge that" if len(names) == 1 else f"{len(names):,} edges that"
    return f"{edges} {what}: {', '.join(names[:SHOWN])}{more}"
