"""Particles drawn from the prior, reading like the paper's Figure 5."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, first_rows
from planner.belief.distribution import Distribution, Listed
from planner.belief.going import GOING, going, timed, vanishes
from planner.belief.mixture import Belief, Mixture, OneBelief, Several
from planner.belief.particles import Particles, together
from planner.belief.prior import Prior, in_town
from planner.belief.routes import (
    Routes,
    Starts,
    all_routes,
    drawn_routes,
    drawn_starts,
    most_turns,
    refuse_too_many,
)
from planner.belief.uniforms import SOBOL_DIMENSIONS, Columns, independent, sobol
from planner.checked import choice, number, whole
from planner.errors import InputError
from planner.network.road_network import RoadNetwork
from planner.network.signals import signal_cycle_s

Sampling = Literal["iid", "sobol", "all"]
LARGEST_SEED = 2**31 - 1
TURNS = 64  # in towns so many are points of the Sobol sequence, whatever the horizon
SETTLED_S = 301  # at second 300 SUMO goes once through all that it holds; after that it is quick


class Streams(NamedTuple):
    """Random numbers beside those of starts and routes; none depends on how many another gives."""

    seeds: np.random.Generator  # of SUMO's driver
    phases: np.random.Generator  # of the signals
    trees: np.random.Generator  # of routes to goals
    times: np.random.Generator  # of setting out and stopping

    @classmethod
    def of(cls, seeds: np.random.Generator) -> "Streams":
        """Return all of them from one."""
        return cls(seeds, *seeds.spawn(3))


def sample(
    prior: Belief,
    network: RoadNetwork,
    n: int,
    rng: np.random.Generator,
    *,
    sampling: Sampling = "iid",
    horizon_s: float,
) -> Particles:
    """Return particles that stand for the prior, as in the paper's Figure 5.

    Of a mixture, each part has random streams of its own, and of several targets each target. They
    share the particles evenly, one after the other: particle k is of target k modulo their number.

    Parameters
    ----------
    n
        How many; "all" makes as many as there are.
    rng
        Fresh for this use. A particle's draws do not depend on ``n``; in towns, and wherever they
        are independent, neither on the horizon.
    sampling
        "iid": independent draws, the paper's sampling with replacement. "sobol": points of a
        scrambled Sobol sequence over all dimensions, which fill the prior more evenly. "all":
        every listed start, distance and speed and every route, weighted by its probability. Which
        part of a mixture a particle is of is drawn with "iid", and shared out evenly with "sobol".
    horizon_s
        Routes go on to a sink, or to the edge on which the particle is then, in towns a little
        further; seconds on the target's clock.

    Raises
    ------
    InputError
        If "all" is asked for and there are too many combinations, or endlessly many.
    """
    choice("sampling", sampling, Sampling)
    n = whole("n", n, least=0 if sampling == "all" else 1)
    horizon_s = number("horizon_s", horizon_s, above=0.0, ends=False)
    how = How(sampling, horizon_s)
    if isinstance(prior, Several):
        return _of_several(prior, network, n, rng, how)
    return _of_target(prior, network, n, rng, how)


class How(NamedTuple):
    """How particles are drawn."""

    sampling: Sampling
    horizon_s: float


def _of_several(
    several: Several, network: RoadNetwork, n: int, rng: np.random.Generator, how: How
) -> Particles:
    """Return particles of all targets in turn; those of each weigh what is probable of it."""
    many = len(several.targets)
    if n < many and how.sampling != "all":
        raise InputError(f"n: {n} particles are too few for {many} targets; give one for each")
    shares = [(n - number + many - 1) // many for number in range(many)]
    drawn = [
        _of_target(target, network, share, own, how)
        for target, share, own in zip(several.targets, shares, rng.spawn(many), strict=True)
    ]
    target = np.concatenate([np.full(len(part), number) for number, part in enumerate(drawn)])
    turn = np.concatenate([np.arange(len(part)) for part in drawn])
    particles = replace(together(drawn), target=target)
    return particles.take(np.lexsort((target, turn)))


def _of_target(
    prior: OneBelief, network: RoadNetwork, n: int, rng: np.random.Generator, how: How
) -> Particles:
    """Return particles of one target."""
    if isinstance(prior, Mixture):
        return _mixed(prior, network, n, rng, how)
    return _of_one(prior, network, n, rng, how)


def _mixed(
    mixture: Mixture, network: RoadNetwork, n: int, rng: np.random.Generator, how: How
) -> Particles:
    """Return particles of all parts, each in its place among the others."""
    which, *own = rng.spawn(1 + len(mixture.parts))
    if how.sampling == "all":
        every = [_of_one(p, network, n, r, how) for p, r in zip(mixture.parts, own, strict=True)]
        return together(
            [
                replace(part, weight=part.weight * share)
                for part, share in zip(every, mixture.share, strict=True)
            ]
        )
    is_drawn = how.sampling == "iid"
    part = mixture.drawn(n, which) if is_drawn else mixture.apportioned(n)
    count = np.bincount(part, minlength=len(mixture.parts))
    particles = together(
        [
            _of_one(prior, network, many, stream, how)
            for prior, many, stream in zip(mixture.parts, count.tolist(), own, strict=True)
            if many
        ]
    )
    # All weigh alike that are drawn; what is shared out weighs what it stands for.
    each = np.full(n, 1 / n) if is_drawn or not count.all() else (mixture.share / count)[part]
    back = np.argsort(np.argsort(part, kind="stable"), kind="stable")
    return replace(particles.take(back), weight=each * mixture.probability_present)


def _of_one(
    prior: Prior, network: RoadNetwork, n: int, rng: np.random.Generator, how: How
) -> Particles:
    sampling, horizon_s = how
    # First of all, so that a particle's driver is the same however many there are.
    streams = Streams.of(rng.spawn(1)[0])
    if sampling == "all":
        starts, weight, routes = _every(prior, network, horizon_s)
    else:
        weight = np.full(n, 1 / n)
        blocks = _blocks(prior, network, n, rng, sampling, horizon_s)
        if prior.goals is None:
            parts = [_drawn(prior, network, columns, horizon_s) for columns in blocks]
            starts, routes = _joined(parts)
        else:
            starts, routes = going(prior, network, blocks, streams.trees)
    present = weight * prior.probability_present
    particles = particles_on(prior, network, starts, routes, present, streams)
    return timed(prior, particles, streams.times)


def _phases(prior: Prior, network: RoadNetwork, n: int, rng: np.random.Generator) -> Ints:
    """Return when on the signals' clock targets start, (n,) seconds: anywhere in the cycle.

    All at one second would meet the same greens and drive in platoons, which plans would chase.
    """
    if prior.driving != "free" or prior.signals_known:
        return np.zeros(n, np.int32)
    return (SETTLED_S + rng.integers(0, signal_cycle_s(network), n)).astype(np.int32)


def _blocks(
    prior: Prior,
    network: RoadNetwork,
    n: int,
    rng: np.random.Generator,
    sampling: Sampling,
    horizon_s: float,
) -> Iterator[Columns]:
    if sampling == "iid":
        return iter([independent(n, rng)])
    if prior.goals is not None:
        return sobol(n, GOING, rng)
    if in_town(prior, network):
        turns = TURNS
    else:
        turns = most_turns(prior, network, horizon_s, limit=SOBOL_DIMENSIONS)
    return sobol(n, 3 + turns * (2 if prior.speed_per_road else 1), rng)


def _drawn(
    prior: Prior, network: RoadNetwork, columns: Columns, horizon_s: float
) -> tuple[Starts, Routes]:
    # Figure 5: the loop of lines 1 and 9 is along the columns; a particle's id (line 6) is its
    # row.
    starts = drawn_starts(prior, network, columns)  # lines 2 to 5, 7 and 8
    # Every p(x_k | x_k-1) that Figure 4 draws from as it moves the particles (lines 5 to 9).
    return starts, drawn_routes(prior, network, starts, columns, horizon_s)


def _joined(parts: Sequence[tuple[Starts, Routes]]) -> tuple[Starts, Routes]:
    if len(parts) == 1:
        return parts[0]
    starts, routes = zip(*parts, strict=True)
    lengths = np.concatenate([np.diff(part.first_edge) for part in routes])
    return (
        Starts(
            np.concatenate([part.edge for part in starts]),
            np.concatenate([part.distance_m for part in starts]),
            np.concatenate([part.speed_mps for part in starts]),
        ),
        Routes(
            first_rows(lengths),
            np.concatenate([part.edge for part in routes]),
            np.concatenate([part.speed_mps for part in routes]),
        ),
    )


def _every(prior: Prior, network: RoadNetwork, horizon_s: float) -> tuple[Starts, Floats, Routes]:
    edges = np.flatnonzero(prior.edge_probability)
    distances, p_distance = _values(prior.distance_m, "target.distance_m")
    speeds, p_speed = _values(prior.speed_mps, "target.speed_mps")
    if prior.speed_per_road and len(speeds) > 1:
        raise InputError(
            'target.speed_drawn: "per road" has no end of combinations; write "once", or "iid" '
            "for search.sampling"
        )
    refuse_too_many(len(edges) * len(distances) * len(speeds))
    combined = np.indices((len(edges), len(distances), len(speeds))).reshape(3, -1)
    edge, distance, speed = combined
    starts = Starts(edges[edge], distances[distance], speeds[speed])
    weight = prior.edge_probability[edges[edge]] * p_distance[distance] * p_speed[speed]
    start, p_route, routes = all_routes(prior, network, starts, horizon_s)
    return starts.take(start), weight[start] * p_route, routes


def _values(numbers: Distribution | None, key: str) -> tuple[Floats, Floats]:
    if not isinstance(numbers, Listed):
        raise InputError(
            f"{key}: has endlessly many values; give {{ list = [...] }} or {{ constant = x }}, "
            'or "iid" for search.sampling'
        )
    some = numbers.probabilities > 0
    return numbers.values[some], numbers.probabilities[some]


def particles_on(
    prior: Prior,
    network: RoadNetwork,
    starts: Starts,
    routes: Routes,
    weight: Floats,
    streams: Streams,
) -> Particles:
    """Return particles that start at time 0 and drive given routes."""
    n = len(starts)
    return Particles(
        weight=weight,
        start_m=starts.distance_m,
        depart_s=np.zeros(n),  # time 0 is when the target was last seen
        first_edge=routes.first_edge,
        route_edge=routes.edge,
        speed_mps=routes.speed_mps,
        seed=streams.seeds.integers(1, LARGEST_SEED, n, endpoint=True),
        gone=vanishes(prior, network, routes.edge[routes.first_edge[1:] - 1]),
        driving=prior.driving,
        phase_s=_phases(prior, network, n, streams.phases),
        end_m=np.full(n, np.inf) if routes.end_m is None else routes.end_m,
    )
