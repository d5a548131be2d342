"""Tiny networks with known answers, and futures made from physics alone."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from planner.arrays import Floats, Ints
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures
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
        edge_lanes=np.ones(len(roads)),
        first_turn=np.concatenate(([0], np.cumsum([len(turn) for turn in turns]))),
        turn_edge=np.concatenate(turns) if turns else [],
        path=Path("tiny.net.xml"),
        sha256=hashlib.sha256(repr((dict(nodes), list(roads))).encode()).hexdigest(),
    )


def by_two_letters(nodes: Mapping[str, tuple[float, float]], roads: str) -> RoadNetwork:
    """Network whose road names are their two nodes, as ``AB BC``."""
    return network_of_roads(nodes, [(road, road[0], road[1]) for road in roads.split()])


def figure1() -> RoadNetwork:
    """Figure 1 of the paper; as in ``sumo_nets/figure1``."""
    kilometres = {
        "A": (0, 0),
        "B": (5, 0),
        "C": (10, 4),
        "D": (12, 0),
        "E": (10, -4),
        "F": (15, 0),
        "G": (20, 0),
    }
    nodes = {name: (x * 1000.0, y * 1000.0) for name, (x, y) in kilometres.items()}
    return by_two_letters(nodes, "AB BC BD BE CD CF DF ED EF FG")


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


def physics_futures(
    network: RoadNetwork,
    routes: Sequence[Sequence[str]],
    start_m: Sequence[float] | Floats | float,
    speed_mps: Sequence[float] | Floats | float,
    *,
    horizon_s: float = np.inf,
    gone: Sequence[bool] | bool = False,
    weight: Sequence[float] | Floats | None = None,
    depart_s: Sequence[float] | Floats | float = 0.0,
    stop_m: Sequence[float] | Floats | float = np.inf,
) -> Futures:
    """Constant speed along the roads' polylines, a knot at every polyline point.

    One entry (or one for all) per particle: metres along the first road at which it departs,
    speed, whether it vanishes at its end, and metres along its whole route (counted from the
    start of the first road) after which it stops for good. Motion after the horizon is cut: the
    last knot then lies at the horizon.
    """
    n = len(routes)
    start, speed, depart, stop = (
        np.broadcast_to(np.asarray(column, dtype=float), n)
        for column in (start_m, speed_mps, depart_s, stop_m)
    )
    parts = [
        _motion(network, route, start[k], speed[k], depart[k], stop[k], horizon_s)
        for k, route in enumerate(routes)
    ]
    knots = np.concatenate(parts) if parts else np.empty((0, 4))
    first_knot = np.concatenate(([0], np.cumsum([len(part) for part in parts]))).astype(int)
    return Futures(
        time_s=knots[:, 0],
        x_m=knots[:, 1],
        y_m=knots[:, 2],
        first_knot=first_knot,
        weight=np.full(n, 1 / max(n, 1)) if weight is None else weight,
        gone=np.broadcast_to(np.asarray(gone), n),
        edges=EdgesDriven.of_knots(knots[:, 3], knots[:, 0], first_knot),
    )


def edge_of_knots(futures: Futures) -> Ints:
    """Return the edge driven from each knot on, (K,)."""
    return futures.edges.of_times(futures.time_s, futures.first_knot)


def _motion(
    network: RoadNetwork,
    route: Sequence[str],
    start_m: float,
    speed_mps: float,
    depart_s: float,
    stop_m: float,
    horizon_s: float,
) -> Floats:
    """Knots (time, x, y, edge) of one particle, (k, 4)."""
    roads = [network.road_ids.index(name) for name in route]
    points = [network.shape(roads[0])[:1]] + [network.shape(road)[1:] for road in roads]
    edges = np.repeat(roads, [len(part) for part in points[1:]])
    xy = np.concatenate(points)
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))))
    end_m = min(along[-1], max(start_m, stop_m), start_m + speed_mps * (horizon_s - depart_s))
    if end_m < start_m:
        return np.empty((0, 4))
    inner = along[(along > start_m) & (along < end_m)]
    at = np.unique(np.concatenate(([start_m], inner, [end_m])))
    piece = np.minimum(np.searchsorted(along, at, side="right") - 1, len(edges) - 1)
    return np.column_stack(
        [
            depart_s + (at - start_m) / speed_mps,
            np.interp(at, along, xy[:, 0]),
            np.interp(at, along, xy[:, 1]),
            edges[piece],
        ]
    )


def town() -> RoadNetwork:
    """Small two-way town: curves, lanes, one signal, one dead end, no exit; by netconvert."""
    from planner.network.build import build_net
    from planner.network.read import read_net

    folder = Path(__file__).parents[1] / "nets" / "town"
    net = build_net(folder / "town.nod.xml", folder / "town.edg.xml", abstract=False)
    return read_net(net, exits=())
