"""Tiny networks with known answers, and futures made from physics alone."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from planner.arrays import Floats, Ints
from planner.futures.even_speed import Drive, at_even_speed
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.network.straight_roads import by_two_letters, figure3, grid, network_of_roads

__all__ = [
    "by_two_letters",
    "edge_of_knots",
    "figure1",
    "figure3",
    "grid",
    "network_of_roads",
    "physics_futures",
    "town",
]


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
    start of the first road) after which it stops for good.
    """
    columns = (
        np.broadcast_to(np.asarray(column, dtype=float), len(routes))
        for column in (start_m, speed_mps, depart_s, stop_m)
    )
    drives = [Drive(*map(float, each)) for each in zip(*columns, strict=True)]
    share = None if weight is None else np.asarray(weight, dtype=float)
    return at_even_speed(network, routes, drives, horizon_s=horizon_s, gone=gone, weight=share)


def edge_of_knots(futures: Futures) -> Ints:
    """Return the edge driven from each knot on, (K,)."""
    return futures.edges.of_times(futures.time_s, futures.first_knot)


def town() -> RoadNetwork:
    """Small two-way town: curves, lanes, one signal, one dead end, no exit; by netconvert."""
    from planner.network.build import build_net
    from planner.network.read import read_net

    folder = Path(__file__).parents[1] / "nets" / "town"
    net = build_net(folder / "town.nod.xml", folder / "town.edg.xml", abstract=False)
    return read_net(net, exits=())
