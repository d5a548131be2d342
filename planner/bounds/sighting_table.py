"""What every hop may see, and surely sees, whenever it begins: the table that bounds are made of.

Time is divided into bins. A hop that starts within half a bin of a bin's middle is at every moment
within v * bin / 2 of the hop that starts at the middle and rests half a bin at both ends. So what
a hop may see is what that inflated flight sees with a radius larger by as much, and what it surely
sees is what a deflated one sees with a smaller radius.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, first_rows
from planner.bounds.hops import Hops
from planner.bounds.kernels.hops import Bins, LegsBefore, known_after, listed, sweep
from planner.bounds.kernels.prices import REMEMBERED, ArrivalColumns, SightingColumns, by_bin
from planner.bounds.movements import Movements


class _ByHop(NamedTuple):
    """Sightings sorted by hop and bin."""

    first: Ints  # (h * bins + 1,) where the sightings of a hop from a bin start
    particle: Ints  # (M,)
    reward: Floats  # (M,) times the particle's weight
    sure: Ints  # (legs, bins, N / 8) one bit for each particle that a leg surely sees


def sightings_of(movements: Movements, bins: Bins, arrivals: ArrivalColumns) -> SightingColumns:
    """Return the sightings that earn something."""
    hops, found = movements.hops, _by_hop(movements, bins)
    known = _known(hops, arrivals, found, bins)
    columns = SightingColumns(found.first, found.particle, found.reward, known)
    return by_bin(columns, len(hops))


def arrivals_of(hops: Hops, nodes: int) -> ArrivalColumns:
    """Return the legs by the node that they lead to, in leg order."""
    ends = hops.to_node[: hops.legs]
    counts = np.bincount(ends, minlength=nodes)
    return ArrivalColumns(first_rows(counts), np.argsort(ends, kind="stable"))


def _by_hop(movements: Movements, bins: Bins) -> _ByHop:
    hops, pieces, problem = movements.hops, movements.pieces, movements.problem
    objective, weight, sensor = problem.objective, problem.futures.weight, problem.sensor
    half_s, radius_m = bins.step_s / 2, sensor.radius_m
    slack_m = half_s * problem.legs.speed_mps
    counts = np.zeros((len(hops), bins.total), dtype=np.int64)
    particles, rewards = [], []
    sure = np.zeros((hops.legs, bins.total, (len(weight) + 7) // 8), dtype=np.uint8)
    seen_at = np.empty((bins.total, len(weight)))
    for hop in range(len(hops) if sensor.detects_in_transit else hops.legs):
        seen_at[:] = np.inf
        sweep(hops.inflated(hop, half_s), pieces, bins, radius_m + slack_m, seen_at)
        seen = listed(seen_at, objective.ends_s)
        counts[hop] = seen.counts
        particles.append(seen.particle)
        rewards.append(objective.reward(seen.at_s) * weight[seen.particle])
        if hop < hops.legs and radius_m > slack_m:
            seen_at[:] = np.inf
            sweep(hops.deflated(hop, half_s), pieces, bins, radius_m - slack_m, seen_at)
            sure[hop] = np.packbits(seen_at < np.inf, axis=1)
    first = first_rows(counts)
    return _ByHop(first, np.concatenate(particles), np.concatenate(rewards), sure)


def _known(hops: Hops, arrivals: ArrivalColumns, found: _ByHop, bins: Bins) -> Ints:
    """Return for each sighting after which legs before the hop its particle is surely seen."""
    known = np.zeros(len(found.particle), dtype=np.uint8)
    for leg in range(hops.legs):
        first = found.first[leg * bins.total : (leg + 1) * bins.total + 1]
        node = hops.from_node[leg]
        legs = arrivals.leg[arrivals.first[node] : arrivals.first[node + 1]][:REMEMBERED]
        before = LegsBefore(legs, bins.lasting(hops.duration_s[legs]))
        own = slice(first[0], first[-1])
        known[own] = known_after(first - first[0], found.particle[own], found.sure, before)
    return known
