"""Particles at constant speed that share a run of SUMO, each in its own time."""

import numpy as np

from planner.arrays import Floats
from planner.belief.particles import Particles
from planner.futures.futures import Futures
from planner.futures.truncate import delayed, stopped
from planner.network.road_network import RoadNetwork


def as_timed(futures: Futures, particles: Particles, network: RoadNetwork, end_s: float) -> Futures:
    """Return the futures of particles that set out together and drove to their routes' ends.

    Each as it sets out in its own time, and up to where it stops.

    Parameters
    ----------
    end_s
        Up to when motion is recorded, seconds on the target's clock.
    """
    stop_s = np.minimum(particles.stop_s, arrival_s(network, particles))
    if not particles.depart_s.any() and np.isinf(stop_s).all():
        return futures
    futures = delayed(futures, particles.depart_s)
    return stopped(futures, np.minimum(stop_s, end_s))


def arrival_s(network: RoadNetwork, particles: Particles) -> Floats:
    """Return when particles at constant speed are where they stop on their last edges, (N,).

    Seconds on the target's clock; infinity where they drive on to the edges' ends.
    """
    taken_s = network.edge_length_m[particles.route_edge] / particles.speed_mps
    before_s = np.concatenate(([0.0], np.cumsum(taken_s)))
    first, last = particles.first_edge[:-1], particles.first_edge[1:] - 1
    along_s = particles.end_m / particles.speed_mps[last]
    along_s -= particles.start_m / particles.speed_mps[first]
    return np.asarray(particles.depart_s + before_s[last] - before_s[first] + along_s)
