"""Routes to goals, as drivers choose them: each weighs the roads a little differently."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets, first_rows
from planner.belief.kernels.trees import NO_EDGE, Goals, Graph, Trips, ways_to_goals
from planner.belief.stretches import Stretches
from planner.network.road_network import RoadNetwork

# A road seems up to so much longer than it is, each one and to each tree differently; by 40 % in
# the mean.
SPREAD = 0.8
DRIVERS = 8  # that share a tree of quickest ways
BACK_S = 30.0  # that turning back on the road costs
QUIET_MPS = 25.0  # roads with a higher limit are nobody's destination


class Ways(NamedTuple):
    """What drivers who go somewhere do."""

    goal: Offsets  # (N,) which of the stretches each goes to
    first_edge: Offsets  # (N + 1,) where a route starts
    edge: Ints  # (M,) edge index


def graph_of(network: RoadNetwork, pace: Floats) -> Graph:
    """Return a network with the time that its edges and turns take.

    Parameters
    ----------
    pace
        (E,) seconds that a metre of each edge takes.
    """
    return Graph(
        network.first_turn,
        network.turn_edge,
        network.edge_length_m * pace,
        np.where(network.turn_back, BACK_S, 0.0),
    )


def ways_to(
    goals: Stretches,
    network: RoadNetwork,
    start: Offsets,
    u: Floats,
    *,
    pace: Floats,
    seed: int,
) -> Ways:
    """Return a route for each driver, from its edge to one of the goals within its reach.

    Turns are the network's, so what is one-way or banned is so by construction. A driver's route
    does not depend on those after it.

    Parameters
    ----------
    start
        (N,) the edges on which drivers are, each with a goal within reach.
    u
        (N,) the shares of the goals within reach, from 0 up to but not including 1.
    pace
        (E,) seconds that a metre of each edge takes.
    seed
        Of what each tree makes of the roads.
    """
    order = np.argsort(start, kind="stable")
    source = start[order].astype(np.int64)
    begins = np.flatnonzero(np.diff(source, prepend=-1))
    rank = np.arange(len(source)) - np.repeat(begins, np.diff(np.append(begins, len(source))))
    trees = np.flatnonzero(rank % DRIVERS == 0)
    trips = Trips(
        seed,
        source[trees],
        rank[trees] // DRIVERS,
        np.append(trees, len(source)),
        u[order],
    )
    graph = graph_of(network, pace)
    places = Goals(goals.edge, goals.probability)
    goal, first, edge = ways_to_goals(graph, places, trips, SPREAD)
    assert np.all(goal != NO_EDGE)
    back = np.argsort(order)
    counts = np.diff(first)
    taken = first_rows(counts[back])
    rows = np.arange(len(edge)) + np.repeat(first[back] - taken[:-1], counts[back])
    return Ways(goal[back], taken, edge[rows])


def can_reach(network: RoadNetwork, edges: Ints) -> Flags:
    """Return from which edges a target can come to one of some edges, or is on it, (E,)."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    count = len(network.edge_ids)
    left = np.repeat(np.arange(count), np.diff(network.first_turn))
    # Turns backwards, and a node before all goals from which the search begins.
    rows = np.concatenate((network.turn_edge, np.full(len(edges), count)))
    columns = np.concatenate((left, edges))
    graph = csr_array((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1))
    found = breadth_first_order(graph, count, return_predecessors=False)
    reached = np.zeros(count + 1, bool)
    reached[found] = True
    return reached[:count]


def quiet_streets(network: RoadNetwork) -> Stretches:
    """Return all streets where people stop, as probable as they are long; there may be none."""
    quiet = np.flatnonzero((network.edge_limit_mps <= QUIET_MPS) & ~network.edge_exit)
    return _whole(network, quiet, network.edge_length_m[quiet])


def ways_out(network: RoadNetwork) -> Stretches:
    """Return the exits, as probable as they have lanes and are fast; there may be none."""
    out = np.flatnonzero(network.edge_exit)
    return _whole(network, out, network.edge_lanes[out] * network.edge_limit_mps[out])


def _whole(network: RoadNetwork, edge: Offsets, weight: Floats) -> Stretches:
    length_m = network.edge_length_m[edge]
    return Stretches(edge, np.zeros(len(edge)), length_m, weight / max(weight.sum(), 1e-300))
