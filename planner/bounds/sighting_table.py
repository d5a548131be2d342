"""What every hop may see, whenever it begins: the table that bounds are made of.

Time is divided into bins. What a hop may see from a bin on is what it sees from some start in the
bin, at the earliest; `kernels.meetings` says how that is found without a look at each start.

A particle that cannot be seen for the first time is left out: where the sensor is always on and
misses nothing, one that is within reach of the hop's first node throughout the bin. Whatever came
there has seen it. Where the sensor may miss, a sighting counts for no more than the longest contact
of any start in the bin sees, and for less after a leg that may see the particle as well.

Nor is a sighting listed that earns no more than the floor under its particle's price: it is never
worth more than the price. What a leg before makes worth less is known from a sighting of that leg
that earns as much, and so is above the floor as well: what is listed is what it would be in a whole
table. There the floor is 0; where that lists too much, the lowest of some higher ones is taken.
"""

from collections.abc import Iterator, Sequence
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

# Of which a table is made: 9 bytes each and, while it is made, 20 more; where the sensor may miss
# 17 bytes, and some 65 more.
MOST_SIGHTINGS = 60_000_000


def sightings_of(
    movements: Movements, bins: Bins, arrivals: ArrivalColumns, floors: Sequence[Floats]
) -> tuple[Floats, SightingColumns]:
    """Return a floor under prices, (N,) in units of reward, and the sightings that earn more.

    Parameters
    ----------
    floors
        To be tried, (N,) each, none lower than the one before: the first one that leaves no more
        sightings than a table holds is taken.

    Raises
    ------
    NotApplicableError
        If they are too many above each of them.
    """
    hops, seen_before = movements.hops, _seen_before(movements, bins)
    floor, found = _found_above(movements, bins, seen_before, floors)
    known, odds = _after_legs(movements, bins, arrivals, found, seen_before)
    columns = SightingColumns(found.first, found.particle, found.reward, known, odds)
    return floor, by_bin(columns, len(hops))


def _found_above(
    movements: Movements, bins: Bins, seen_before: list[Flags], floors: Sequence[Floats]
) -> tuple[Floats, "_ByHop"]:
    """Return the floor that is taken, and the sightings above it; those by hop are let go."""
    floor, of_hops = _listed_above(movements, bins, seen_before, floors)
    return floor, _joined(of_hops, movements.hops.legs)


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


class _OfHop(NamedTuple):
    """The sightings of one hop, sorted by bin."""

    counts: Offsets  # (bins,)
    particle: Ints  # (M,)
    reward: Floats  # (M,) times the particle's weight; of straight flights rounded up
    missed: Floats  # (M,) how probably the longest contact misses; (0,) if none does

    def above(self, least: Floats) -> "_OfHop":
        """Return those that, rounded up, earn more than the ``least`` of their particle, (N,)."""
        if not least.any():
            return self
        kept = _rounded_up(self.reward) > least[self.particle]
        bins = np.repeat(np.arange(len(self.counts)), self.counts)[kept]
        return _OfHop(
            np.bincount(bins, minlength=len(self.counts)),
            self.particle[kept],
            self.reward[kept],
            self.missed[kept] if len(self.missed) else self.missed,
        )


def _listed_above(
    movements: Movements, bins: Bins, seen_before: list[Flags], floors: Sequence[Floats]
) -> tuple[Floats, list[_OfHop]]:
    """Return the floor that is taken, and the sightings of each hop above it."""
    hops, problem = movements.hops, movements.problem
    weight, sensor, higher = problem.futures.weight, problem.sensor, iter(floors)
    floor, of_hops, total = next(higher), list[_OfHop](), 0
    sight = blank(bins.total, len(weight), lasting=not sensor.is_perfect)
    for hop in range(len(hops)):
        if sensor.detects_in_transit or hop < hops.legs:
            sweep(hops.motion(hop), movements.pieces, bins, sensor.radius_m, sight)
        seen = listed(sight, problem.objective.ends_s, seen_before[hops.from_node[hop]])
        reward = problem.objective.reward(seen.at_s) * weight[seen.particle]
        reward = reward if hop < hops.legs else _rounded_up(reward)
        missed = np.exp(-sensor.rate_per_s * seen.lasts_s)
        of_hops.append(_OfHop(seen.counts, seen.particle, reward, missed).above(floor * weight))
        total += len(of_hops[-1].particle)
        while total > MOST_SIGHTINGS:
            floor = _next(higher)
            of_hops = [one.above(floor * weight) for one in of_hops]
            total = sum(len(one.particle) for one in of_hops)
    return floor, of_hops


def _next(higher: Iterator[Floats]) -> Floats:
    """Return the next higher floor."""
    floor = next(higher, None)
    if floor is None:
        raise NotApplicableError(
            f"the bound for road plans lists more than {MOST_SIGHTINGS:,} sightings here; "
            "take a smaller net, fewer particles or a shorter horizon"
        )
    return floor


def _joined(of_hops: list[_OfHop], legs: int) -> _ByHop:
    missed = np.concatenate([one.missed for one in of_hops])
    return _ByHop(
        first_rows(np.array([one.counts for one in of_hops])),
        np.concatenate([one.particle for one in of_hops]),
        np.concatenate([_rounded_up(one.reward) for one in of_hops]),
        np.concatenate([one.reward for one in of_hops[:legs]]),
        missed if len(missed) else np.zeros(1),
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
