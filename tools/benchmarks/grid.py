"""The 5 x 5 grid for benchmarks of news, fleets and misses: how it is opened, and who is judged on.

Speeds stay constant, so that fresh targets are moved without SUMO.
"""

import numpy as np

from planner import Futures, OpenScenario, Particles, RoadNetwork, open_scenario, stream
from planner import sample as sampled
from planner.belief.mixture import Belief

GRID, SEED = "grid5x5", 1001
DISTANCES_KM = (60, 120, 300)


def opened_at(u0_km: int, *overrides: str, seed: int = 1) -> OpenScenario:
    """Return the grid with a UAV that comes from so far away."""
    given = (f"uav.start.distance_m={1000 * u0_km}", f"search.seed={seed}", *overrides)
    return open_scenario(GRID, overrides=given)


def fresh(opened: OpenScenario, many: int, belief: Belief | None = None) -> Futures:
    """Return fresh targets, independent draws, the same whatever was planned.

    Parameters
    ----------
    belief
        What they are drawn from, if not from what is true in the scenario.
    """
    particles = sampled(
        opened.truth_prior if belief is None else belief,
        opened.network,
        many,
        stream(SEED, "evaluation"),
        sampling="iid",
        horizon_s=opened.scenario.search.horizon_s,
    )
    return moved(opened.network, particles)


def moved(network: RoadNetwork, particles: Particles) -> Futures:
    """Return how particles move at constant speed along straight edges: exact, without SUMO."""
    first, edge, speed = particles.first_edge, particles.route_edge, particles.speed_mps
    length_m, counts = network.edge_length_m[edge], np.diff(particles.first_edge)
    way_m = length_m.copy()
    way_m[first[:-1]] -= particles.start_m
    since = np.concatenate(([0.0], np.cumsum(way_m / speed)))
    ends_s = (
        since[1:] - np.repeat(since[first[:-1]], counts) + np.repeat(particles.depart_s, counts)
    )
    knots = first + np.arange(len(first))
    at_end = np.arange(len(edge)) + np.repeat(np.arange(len(counts)), counts) + 1
    time_s, xy_m = np.empty(knots[-1]), np.empty((knots[-1], 2))
    time_s[knots[:-1]], time_s[at_end] = particles.depart_s, ends_s
    xy_m[knots[:-1]] = network.edge_xy(edge[first[:-1]], particles.start_m)
    xy_m[at_end] = network.edge_xy(edge, length_m)
    x_m, y_m = xy_m.T
    weight, gone = particles.weight, particles.gone
    return Futures(time_s, x_m, y_m, knots, weight, gone, particles.target)
