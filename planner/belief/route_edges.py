"""Routes by the names of their edges."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from planner.arrays import Ints
from planner.errors import InputError
from planner.network.road_network import RoadNetwork
from planner.network.street_names import no_edge


def route_edges(
    names: Sequence[str], network: RoadNetwork, *, where: str, remedy: str = ""
) -> Ints:
    """Return the edges of a route that a car can drive, (k,) edge indices.

    Parameters
    ----------
    where, remedy
        What messages begin and end with: where the route stands, and what to do about it.

    Raises
    ------
    InputError
        If one is no edge for cars, or does not lead to the next.
    """
    for name in names:
        if name not in network.edge_index:
            raise InputError(f"{where}: {name} {no_edge(name, network)}")
    route = [network.edge_index[name] for name in names]
    for before, after in pairwise(route):
        ways = network.turns(before, back=True)
        if after not in ways:
            onward = ", ".join(network.edge_ids[way] for way in ways) or "nothing"
            one, other = network.edge_ids[before], network.edge_ids[after]
            text = f"{where}: {one} does not lead to {other}, but to {onward}"
            raise InputError(f"{text}; {remedy}" if remedy else text)
    return np.array(route, dtype=np.int32)
