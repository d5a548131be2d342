"""Particle prices for a fleet: the prices, and what the dearest flight of each UAV earns beyond.

A fleet earns the greatest reward of all its UAVs' hops with each particle, so for any prices
p_k >= 0 it earns no more than sum_k p_k and, for each UAV, what a flight of it earns above them:
what `planner.bounds.particle_prices` says of one flight, of which each UAV has one. With the UAVs
there is less for any of them above the prices, and the bound is tighter than for one.

Where sensors may miss, each moment of the search earns the rates of those that have k in reach,
times the probability S_k that k is unseen by all. What is below the prices adds up to p_k at most.
And S_k is no more than what one UAV's flight alone leaves unseen, so that what is above the prices
is at most the sum over the UAVs of what each flight would earn there without the others.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Floats
from planner.bounds.movements import Movements
from planner.bounds.particle_prices import Bounded, Table, table_of
from planner.errors import NotApplicableError
from planner.flight.uav import Uav
from planner.search.problem import Problem


@dataclass(frozen=True, eq=False)
class FleetTable:
    """Tables of the kinds of UAVs that a fleet has, and how many there are of each."""

    tables: tuple[Table, ...]
    many: tuple[int, ...]
    bin_s: float  # of all of them, seconds

    @classmethod
    def of(
        cls, problem: Problem, bin_s: float, floors: Sequence[Floats] | None = None
    ) -> "FleetTable":
        """Return the tables of a problem's UAVs; those that fly no more, or too late, have none.

        The floors are those of `planner.bounds.particle_prices.table_of`, for each table anew.

        Raises
        ------
        NotApplicableError
            If a UAV flies more than once, the net is too large, or a bin longer than a hop.
        """
        if any(uav.sorties > 1 for uav in problem.flying):
            raise NotApplicableError("there is no bound yet for UAVs that fly more than once")
        kinds = _kinds(problem)
        tables = tuple(table_of(moves, bin_s, floors) for moves in _moves(problem, kinds))
        return cls(tables, tuple(kinds.values()), bin_s)

    @property
    def weight(self) -> Floats:
        """Of each particle, (N,)."""
        return self.tables[0].weight

    @property
    def floor(self) -> Floats:
        """The least price of each particle, (N,)."""
        return np.asarray(np.max([table.floor for table in self.tables], axis=0))

    def bound(self, prices: Floats) -> Bounded:
        """Return the greatest expected reward of all UAVs together that prices, (N,), allow."""
        paid = float((prices * self.weight).sum())
        reward, counts = paid, np.zeros(len(prices))
        for table, many in zip(self.tables, self.many, strict=True):
            alone = table.bound(prices)
            reward += many * (alone.reward - paid)
            counts += many * alone.counts
        return Bounded(reward, counts)


def fitting_bin_s(problem: Problem) -> float:
    """Return how long bins are in which every hop of every UAV lasts one, seconds."""
    return min(moves.fitting_bin_s for moves in _moves(problem, _kinds(problem)))


def _kinds(problem: Problem) -> Counter[Uav]:
    """Return how many UAVs of each kind may see anything; altitudes and the like do not matter.

    If none may, that is none of one kind: prices are paid for its particles all the same.
    """
    fly = [uav for uav in problem.flying if uav.take_off_s < problem.objective.ends_s]
    alike = Counter(replace(uav, altitude_m=0.0, link_m=np.inf, swap_s=0.0) for uav in fly)
    return alike or Counter({problem.uav: 0})


def _moves(problem: Problem, kinds: Iterable[Uav]) -> list[Movements]:
    return [Movements(problem.replace(uav=uav, others=())) for uav in kinds]
