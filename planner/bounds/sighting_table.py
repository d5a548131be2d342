"""What every hop may see, whenever it begins: the table that bounds are made of.

Time is divided into bins. What a hop may see from a bin on is what it sees from some start in the
bin, at the earliest; `kernels.meetings` says how that is found without a look at each start.

A particle that cannot be seen for the first time is left out: where the sensor is always on and
misses nothing, one that is within reach of the hop's first node throughout the bin. Whatever came
there has seen it. Where the sensor may miss, a sighting counts for no more than the longest contact
of any start in the bin sees, and for less after a leg that may see the particle as well.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets, first_rows
from planner.bounds.hops import Hops
from planner.bounds.kernels.hops import (
    Bins,
    blank,
    listed,
    stay_through,
    sweep,
)
from planner.bounds.kernels.known import LegBefore, Sightings, left_after, note_known
from planner.bounds.kernels.prices import REMEMBERED, ArrivalColumns, SightingColumns, by_bin
from planner.bounds.movements import Movements
from planner.errors import NotApplicableError

MOST_SIGHTINGS = 60_000_000  # of which a table is made: 9 bytes each, and 20 for a moment


def sightings_of(movements: Movements, bins: Bins, arrivals: ArrivalColumns) -> SightingColumns:
    """Return the sightings that earn something.

    Raises
    ------
    NotApplicableError
        If they are too many.
    """
    hops, seen_before = movements.hops, _seen_before(movements, bins)
    found = _by_hop(movements, bins, seen_before)
    known, odds = _after_legs(movements, bins, arrivals, found, seen_before)
    columns = SightingColumns(found.first, found.particle, found.reward, known, odds)
    return by_bin(columns, len(hops))


def _after_legs(
    movements: Movements,
    bins: Bins,
    arrivals: ArrivalColumns,
    found: "_ByHop",
    seen_before: list[Flags],
) -> tuple[Ints, Floats]:
    """Return after which legs sightings are known, and the odds that they count, then too."""
    hops, missed = movements.hops, found.missed
    known, again = np.zeros(len(found.particle), dtype=np.uint8), np.zeros(len(missed))
    legs_only = Sightings(found.first, found.particle, found.leg_reward, missed)
    for leg in range(hops.legs):
        node = hops.from_node[leg]
        into = arrivals.leg[arrivals.first[node] : arrivals.first[node + 1]][:REMEMBERED]
        since, end = found.first[leg * bins.total], found.first[(leg + 1) * bins.total]
        left = np.ones((end - since, len(into)))
        for bit, before in enumerate(into.tolist()):
            least, most = map(int, bins.lasting(hops.duration_s[before]))
            one_before = LegBefore(before, least, most, seen_before[hops.from_node[before]])
            left_after(legs_only, leg, one_before, left[:, bit])
        note_known(left, since, known, again)
    share = 1.0 - missed
    return known, _rounded_up(np.stack([share, share * again], axis=1))


def arrivals_of(hops: Hops, nodes: int) -> ArrivalColumns:
    """Return the legs by the node that they lead to, in leg order."""
    ends = hops.to_node[: hops.legs]
    counts = np.bincount(ends, minlength=nodes)
    return ArrivalColumns(first_rows(counts), np.argsort(ends, kind="stable"))


class _ByHop(NamedTuple):
    """Sightings sorted by hop and bin."""

    first: Offsets  # (h * bins + 1,) where the sightings of a hop from a bin start
    particle: Ints  # (M,)
    reward: Floats  # (M,) times the particle's weight, rounded up to four bytes
    leg_reward: Floats  # of legs, as it is
    missed: Floats  # (M,) how probably the longest contact misses; (1,) if none does


def _by_hop(movements: Movements, bins: Bins, seen_before: list[Flags]) -> _ByHop:
    hops, problem = movements.hops, movements.problem
    objective, weight, sensor = problem.objective, problem.futures.weight, problem.sensor
    counts = np.zeros((len(hops), bins.total), dtype=np.int64)
    particles, rewards, leg_rewards, missed, total = [], [], [], [], 0
    sight = blank(bins.total, len(weight), lasting=not sensor.is_perfect)
    for hop in range(len(hops) if sensor.detects_in_transit else hops.legs):
        sweep(hops.motion(hop), movements.pieces, bins, sensor.radius_m, sight)
        seen = listed(sight, objective.ends_s, seen_before[hops.from_node[hop]])
        counts[hop], total = seen.counts, total + len(seen.particle)
        if total > MOST_SIGHTINGS:
            raise NotApplicableError(
                f"the bound for road plans lists more than {MOST_SIGHTINGS:,} sightings here; "
                "take a smaller net, fewer particles or a shorter horizon"
            )
        reward = objective.reward(seen.at_s) * weight[seen.particle]
        particles.append(seen.particle)
        rewards.append(_rounded_up(reward))
        if not sensor.is_perfect:
            missed.append(np.exp(-sensor.rate_per_s * seen.lasts_s))
        if hop < hops.legs:
            leg_rewards.append(reward)
    return _ByHop(
        first_rows(counts),
        np.concatenate(particles),
        np.concatenate(rewards),
        np.concatenate(leg_rewards),
        np.concatenate(missed) if missed else np.zeros(1),
    )


def _seen_before(movements: Movements, bins: Bins) -> list[Flags]:
    """Return who has been seen, throughout a bin, by whatever came to each node, (bins, N) each."""
    problem, count = movements.problem, len(movements.problem.futures)
    found, shape = [], (bins.total, count)
    for x_m, y_m in problem.network.node_xy_m.tolist():
        here = np.zeros(shape, dtype=np.bool_)
        if problem.sensor.detects_in_transit and problem.sensor.is_perfect:
            stay_through((x_m, y_m), movements.pieces, bins, problem.sensor.radius_m, here)
        found.append(here)
    return found


def _rounded_up(figure: Floats) -> Floats:
    """Return figures in four bytes each, none of them less than before."""
    short = figure.astype(np.float32)
    return np.where(short < figure, np.nextafter(short, np.float32(np.inf)), short)
