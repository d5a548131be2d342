"""One target on a given route, as in the paper's tests."""

from collections.abc import Sequence
from numbers import Real

import numpy as np

from planner.belief.mixture import Belief, parts_of
from planner.belief.particles import Particles
from planner.belief.route_edges import route_edges
from planner.belief.routes import Routes, Starts
from planner.belief.sampling import Streams, particles_on
from planner.checked import instance
from planner.errors import InputError
from planner.messages import as_written
from planner.network.road_network import RoadNetwork
from planner.scenario.values import FASTEST_MPS


def predefined(
    network: RoadNetwork,
    prior: Belief,
    route: Sequence[str],
    rng: np.random.Generator,
    *,
    speed_mps: float,
    offset_m: float = 0.0,
) -> Particles:
    """Return one target on a given route at a given speed, as in the paper's tests.

    Parameters
    ----------
    prior
        Tells how it drives and what happens at its end; of a mixture, the first part does.
    route
        Names of edges, each of which leads to the next.
    offset_m
        Metres along the first edge at which it starts.

    Raises
    ------
    InputError
        If the route is not in the network, or the speed or the offset is impossible.
    """
    instance("speed_mps", speed_mps, Real)
    instance("offset_m", offset_m, Real)
    if not route:
        raise InputError("route: is empty; name at least one edge")
    edges = route_edges(route, network, where="route")
    length_m = network.edge_length_m[edges[0]]
    if not 0 <= offset_m <= length_m:
        raise InputError(
            f"target offset {as_written(offset_m)}: is not on {route[0]}; "
            f"give 0 to {as_written(float(length_m))} m"
        )
    if not 0 < speed_mps <= FASTEST_MPS:
        raise InputError(
            f"target speed {as_written(speed_mps)}: "
            f"give a speed above 0 and up to {FASTEST_MPS:g} m/s"
        )
    start = Starts(np.array(edges[:1]), np.array([offset_m]), np.array([speed_mps]))
    routes = Routes(np.array([0, len(edges)]), np.array(edges), np.full(len(edges), speed_mps))
    streams = Streams.of(rng.spawn(1)[0])
    return particles_on(parts_of(prior)[0], network, start, routes, np.ones(1), streams)
