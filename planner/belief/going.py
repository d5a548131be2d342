"""Targets that go somewhere, when they set out, and when they stop."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.belief.particles import Particles
from planner.belief.prior import Prior
from planner.belief.routes import Routes, Starts, drawn_starts
from planner.belief.uniforms import Columns
from planner.belief.ways import ways_to
from planner.network.road_network import RoadNetwork

GOING = 5  # columns that a target takes that goes somewhere: its start, speed and goal
LARGEST_KEY = 2**62


def going(
    prior: Prior, network: RoadNetwork, blocks: Iterable[Columns], rng: np.random.Generator
) -> tuple[Starts, Routes]:
    """Return targets with a goal each, within the reach of their starts, and the routes there."""
    assert prior.goals is not None
    rows = [
        (drawn_starts(prior, network, columns), next(columns), next(columns)) for columns in blocks
    ]
    starts = Starts(
        np.concatenate([row.edge for row, _, _ in rows]),
        np.concatenate([row.distance_m for row, _, _ in rows]),
        np.concatenate([row.speed_mps for row, _, _ in rows]),
    )
    which, where = (np.concatenate([row[k] for row in rows]) for k in (1, 2))
    seed = int(rng.integers(LARGEST_KEY))
    ways = ways_to(prior.goals, network, starts.edge, which, pace=_pace(prior, network), seed=seed)
    edge = prior.goals.edge[ways.goal]
    from_m, to_m = prior.goals.from_m[ways.goal], prior.goals.to_m[ways.goal]
    # Who leaves, leaves by the end of the exit.
    end_m = np.where(network_exits(network)[edge], np.inf, from_m + where * (to_m - from_m))
    speed_mps = np.repeat(starts.speed_mps, np.diff(ways.first_edge))
    return starts, Routes(ways.first_edge, ways.edge, speed_mps, end_m)


def _pace(prior: Prior, network: RoadNetwork) -> Floats:
    """Return how many seconds a metre of each edge takes a driver who plans a route, (E,)."""
    if prior.driving == "constant":
        return np.ones(len(network.edge_ids))
    return np.asarray(1.0 / np.minimum(network.edge_limit_mps, prior.speed_mps.high))


def network_exits(network: RoadNetwork) -> Flags:
    """Return by which edges a target leaves the map, (E,)."""
    return np.zeros(len(network.edge_ids), bool)


def vanishes(prior: Prior, network: RoadNetwork, last: Ints) -> Flags:
    """Return which targets are gone at the ends of their routes, by their last edges, (N,).

    Who reaches a goal within the town rests there.
    """
    exits = network_exits(network)[last]
    if prior.goals is None:
        return np.asarray(exits | prior.gone)
    sink = np.diff(network.first_turn)[last] == 0
    return np.asarray(exits | (prior.gone & sink))


def timed(prior: Prior, particles: Particles, rng: np.random.Generator) -> Particles:
    """Return the same particles with the times at which they set out, and stop.

    Whole seconds, as SUMO steps.
    """
    sets_out, _ = rng.spawn(2)
    n = len(particles)
    depart_s = sets_out.integers(0, prior.window_s, n, endpoint=True).astype(np.float64)
    # Who starts beyond its goal on the same edge is there.
    single = np.diff(particles.first_edge) == 1
    there = single & (particles.end_m <= particles.start_m)
    stop_s = np.where(there, depart_s, particles.stop_s)
    return replace(particles, depart_s=depart_s, stop_s=stop_s)
