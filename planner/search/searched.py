"""The problem that planners solve within an airspace: the roads that are searched, and no others.

They plan as if the way between two roads were straight. Their plans are flown around no-fly areas,
and timed and evaluated as flown.
"""

from dataclasses import replace

import numpy as np

from planner.arrays import Flags, Ints, first_of_parts
from planner.errors import NotApplicableError
from planner.flight.legs import Legs
from planner.flight.plan import Plan
from planner.futures.edges_driven import NO_EDGE
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.search.problem import Problem


def searched_problem(problem: Problem) -> tuple[Problem, Ints]:
    """Return the problem over the roads that are searched, and their indices in the given one.

    Raises
    ------
    NotApplicableError
        If there are none.
    """
    assert problem.airspace is not None
    network, uav = problem.network, problem.uav_at_start
    roads = np.flatnonzero(problem.airspace.roads_searched(network, (uav.x_m, uav.y_m)))
    if len(roads) == 0:
        raise NotApplicableError("no road lies within [airspace]; correct its areas")
    if len(roads) == len(network.road_ids):
        return problem, roads
    closed = ~np.isin(network.edge_road, roads)
    holdout = problem.holdout and _without_edges(problem.holdout, closed)
    proposals = problem.proposals and _without_edges(problem.proposals, closed)
    futures = _without_edges(problem.futures, closed)
    fewer = _with_roads(network, roads)
    changed = {"futures": futures, "holdout": holdout, "proposals": proposals}
    return problem.replace(network=fewer, **changed), roads


def named_as_before(plan: Plan, roads: Ints) -> Plan:
    """Return a plan over some roads with the legs numbered as for all; ``roads`` are its roads."""
    legs = tuple(
        tuple(
            replace(flown, leg=Legs.both(int(roads[flown.road]))[Legs.is_against(flown.leg)])
            for flown in flight
        )
        for flight in plan.legs
    )
    return replace(plan, legs=legs)


def _with_roads(network: RoadNetwork, roads: Ints) -> RoadNetwork:
    """Return a network for the UAV; edges without a road, which nobody drives, are on the first."""
    shapes = [network.shape(int(road)) for road in roads]
    index = np.zeros(len(network.road_ids), dtype=np.int32)
    index[roads] = np.arange(len(roads))
    return replace(
        network,
        road_ids=tuple(network.road_ids[road] for road in roads),
        road_from=network.road_from[roads],
        road_to=network.road_to[roads],
        first_point=first_of_parts(shapes),
        shape_xy_m=np.concatenate(shapes),
        half_width_m=network.half_width_m[roads],
        both_ways=network.both_ways[roads],
        edge_road=index[network.edge_road],
    )


def _without_edges(futures: Futures, closed: Flags) -> Futures:
    """Return futures of which it is unknown when they are on closed edges; they move the same."""
    edge = futures.edges.edge
    known = np.where((edge != NO_EDGE) & closed[edge], NO_EDGE, edge)
    return replace(futures, edges=replace(futures.edges, edge=known))
