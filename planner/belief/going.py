"""Targets that go somewhere, when they set out, and when they stop."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.belief.habits import Flees
from planner.belief.known_routes import KnownRoutes
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
    rows = [
        (drawn_starts(prior, network, columns), next(columns), next(columns)) for columns in blocks
    ]
    starts = Starts(
        np.concatenate([row.edge for row, _, _ in rows]),
        np.concatenate([row.distance_m for row, _, _ in rows]),
        np.concatenate([row.speed_mps for row, _, _ in rows]),
    )
    which, where = (np.concatenate([row[k] for row in rows]) for k in (1, 2))
    goals = prior.goals
    if isinstance(goals, KnownRoutes):
        first, edge = goals.onward(starts.edge, which)
        last = edge[first[1:] - 1]
        end_m = where * network.edge_length_m[last]
    else:
        assert goals is not None
        seed = int(rng.integers(LARGEST_KEY))
        ways = ways_to(goals, network, starts.edge, which, pace=_pace(prior, network), seed=seed)
        first, edge, last = ways.first_edge, ways.edge, goals.edge[ways.goal]
        from_m, to_m = goals.from_m[ways.goal], goals.to_m[ways.goal]
        end_m = from_m + where * (to_m - from_m)
    # Who leaves, leaves by the end of the last edge.
    end_m = np.where(vanishes(prior, network, last), np.inf, end_m)
    return starts, Routes(first, edge, np.repeat(starts.speed_mps, np.diff(first)), end_m)


def _pace(prior: Prior, network: RoadNetwork) -> Floats:
    """Return how many seconds a metre of each edge takes a driver who plans a route, (E,)."""
    if prior.driving == "constant":
        return np.ones(len(network.edge_ids))
    return np.asarray(1.0 / np.minimum(network.edge_limit_mps, prior.speed_mps.high))


def vanishes(prior: Prior, network: RoadNetwork, last: Ints) -> Flags:
    """Return which targets are gone at the ends of their routes, by their last edges, (N,).

    Who reaches a goal within the town rests there.
    """
    return np.asarray(network.edge_exit[last] | (prior.goals is None and prior.gone))


def timed(prior: Prior, particles: Particles, rng: np.random.Generator) -> Particles:
    """Return the same particles with the times at which they set out, and stop.

    Whole seconds, as SUMO steps.
    """
    sets_out, parks = rng.spawn(2)
    n = len(particles)
    depart_s = sets_out.integers(0, prior.window_s, n, endpoint=True).astype(np.float64)
    # Who starts beyond its goal on the same edge is there.
    single = np.diff(particles.first_edge) == 1
    there = single & (particles.end_m <= particles.start_m)
    stop_s = np.where(there, depart_s, particles.stop_s)
    if prior.stops is not None:
        which, when = parks.random((n, 2)).T
        stop_s = np.minimum(stop_s, depart_s + prior.stops.after_s(which, when))
    flees = prior.flees or Flees(0.0, 1.0)
    return replace(
        particles,
        depart_s=depart_s,
        stop_s=stop_s,
        flees_s=np.full(n, flees.for_s),
        flees=np.full(n, flees.factor),
    )
