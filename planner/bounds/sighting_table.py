"""What every hop may see, and surely sees, whenever it begins: the table that bounds are made of.

Times are bins. Whoever starts a hop within half a bin of its middle is at every moment within
v * bin / 2 of whoever starts at the middle, who rests half a bin at both ends; so what a hop may
see is what that flight sees with a radius larger by as much, and what it surely sees with one that
is smaller.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.bounds.hops import Hops
from planner.futures.futures import Futures
from planner.search.problem import Problem

ROUNDING = 1e-9  # of a bin, by which a hop may seem to end in the next one


@dataclass(frozen=True)
class Bins:
    """Equal spans of time, each known by its middle."""

    first_s: float  # middle of the first one
    step_s: float
    count: int

    def at(self, time_s: float) -> int:
        """Return the bin that holds a time; it may lie beyond the last one."""
        return round((time_s - self.first_s) / self.step_s)

    def lasting(self, duration_s: Floats) -> Ints:
        """Return how many bins on a flight may end, at least and at most, (..., 2)."""
        many = np.asarray(duration_s) / self.step_s
        ends = [np.floor(many + ROUNDING), np.ceil(many - ROUNDING)]
        return np.stack(ends, axis=-1).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Arrivals:
    """The legs by the node that they lead to."""

    first: Offsets  # (V + 1,)
    leg: Ints  # (legs,)

    @classmethod
    def of(cls, hops: Hops, nodes: int) -> "Arrivals":
        """Return the legs of some hops by the node that they lead to, in leg order."""
        ends = hops.to_node[: hops.legs]
        counts = np.bincount(ends, minlength=nodes)
        return cls(np.concatenate(([0], np.cumsum(counts))), np.argsort(ends, kind="stable"))

    def at(self, node: int) -> Ints:
        """Return the legs that lead to a node."""
        return self.leg[self.first[node] : self.first[node + 1]]


def sightings_of(problem: Problem, hops: Hops, bins: Bins, arrivals: Arrivals) -> Any:
    """Return the sightings that earn something as ``kernels_prices`` takes them."""
    from planner.bounds.kernels.prices import by_bin

    first, particle, reward, sure = _by_hop(problem, hops, bins)
    known = _known(hops, arrivals, (first, particle), sure, bins)
    return by_bin((first, particle, reward, known), len(hops))


def _by_hop(problem: Problem, hops: Hops, bins: Bins) -> tuple[Ints, Ints, Floats, Ints]:
    """Return the sightings by hop and bin, and what legs surely see, one bit each.

    First (hops * bins + 1,), particle (M,), reward times weight (M,), sure (legs, bins, N / 8).
    """
    from planner.bounds.kernels.hops import listed, sweep

    pieces, who = pieces_of(problem.futures)
    objective, weight, sensor = problem.objective, problem.futures.weight, problem.sensor
    span = (bins.first_s, bins.step_s, bins.count)
    half_s, radius_m = bins.step_s / 2, sensor.radius_m
    slack_m = half_s * problem.legs.speed_mps
    counts = np.zeros((len(hops), bins.count), dtype=np.int64)
    whose, rewards = [], []
    sure = np.zeros((hops.legs, bins.count, (len(weight) + 7) // 8), dtype=np.uint8)
    seen_at = np.empty((bins.count, len(weight)))
    for hop in range(len(hops) if sensor.detects_in_transit else hops.legs):
        seen_at[:] = np.inf
        sweep(hops.wide(hop, half_s), pieces, who, span, radius_m + slack_m, seen_at)
        counts[hop], particle, when = listed(seen_at, objective.ends_s)
        whose.append(particle)
        rewards.append(objective.reward(when) * weight[particle])
        if hop < hops.legs and radius_m > slack_m:
            seen_at[:] = np.inf
            sweep(hops.core(hop, half_s), pieces, who, span, radius_m - slack_m, seen_at)
            sure[hop] = np.packbits(seen_at < np.inf, axis=1)
    first = np.concatenate(([0], np.cumsum(counts)))
    return first, np.concatenate(whose), np.concatenate(rewards), sure


def _known(
    hops: Hops, arrivals: Arrivals, sightings: tuple[Ints, Ints], sure: Ints, bins: Bins
) -> Ints:
    """Return for each sighting after which legs before the hop its particle is surely seen."""
    from planner.bounds.kernels.hops import known_after
    from planner.bounds.kernels.prices import REMEMBERED

    first, particle = sightings
    known = np.zeros(len(particle), dtype=np.uint8)
    for leg in range(hops.legs):
        cells = first[leg * bins.count : (leg + 1) * bins.count + 1]
        legs = arrivals.at(hops.from_node[leg])[:REMEMBERED]
        before = (legs, bins.lasting(hops.duration_s[legs]))
        among = slice(cells[0], cells[-1])
        known[among] = known_after(cells - cells[0], particle[among], sure, before)
    return known


def pieces_of(futures: Futures) -> tuple[Floats, Ints]:
    """Return all straight motions: from, to, place at from, velocity, (P, 6); and whose (P,).

    Somebody who is somewhere for a moment only does not move there, and can be seen all the same.
    """
    who = np.repeat(np.arange(len(futures)), np.diff(futures.first_knot))
    at = np.stack([futures.time_s, futures.x_m, futures.y_m], axis=1)
    last = np.diff(who, append=-1) != 0
    moves = np.flatnonzero(~last & (np.diff(at[:, 0], append=np.inf) > 0.0))
    rests = np.flatnonzero(last & ~futures.gone[who])
    moments = np.setdiff1d(np.arange(len(who)), np.concatenate([moves, moves + 1, rests]))
    step = at[moves + 1] - at[moves]
    places = np.concatenate([moves, rests, moments])
    until_s = [at[moves + 1, 0], np.full(len(rests), np.inf), at[moments, 0]]
    velocity = np.zeros((len(places), 2))
    velocity[: len(moves)] = step[:, 1:] / step[:, :1]
    pieces = np.column_stack([at[places, 0], np.concatenate(until_s), at[places, 1:], velocity])
    return np.ascontiguousarray(pieces), who[places].astype(np.int64)
