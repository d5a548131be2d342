"""Particle prices for a fleet: the prices, and what the dearest flight of each UAV earns beyond.

A fleet earns the greatest reward of all its UAVs' hops with each particle, so for any prices
p_k >= 0 it earns no more than sum_k p_k and, for each UAV, what a flight of it earns above them:
what `planner.bounds.particle_prices` says of one flight, of which each UAV has one. With the UAVs
there is less for any of them above the prices, and the bound is tighter than for one.
"""

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
    bin_s: float  # the longest of their bins, seconds

    @classmethod
    def of(cls, problem: Problem) -> "FleetTable":
        """Return the tables of a problem's UAVs; those that take off too late have none.

        Raises
        ------
        NotApplicableError
            If a UAV flies more than once, or the net is too large.
        """
        if any(uav.sorties > 1 for uav in problem.uavs):
            raise NotApplicableError("there is no bound yet for UAVs that fly more than once")
        flies = [uav for uav in problem.uavs if uav.take_off_s < problem.objective.ends_s]
        kinds = list(dict.fromkeys(_alike(flies)))
        moves = [Movements(problem.replace(uav=uav, others=())) for uav in kinds]
        tables = tuple(table_of(one, one.fitting_bin_s) for one in moves)
        many = tuple(_alike(flies).count(kind) for kind in kinds)
        return cls(tables, many, max(one.fitting_bin_s for one in moves))

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


def _alike(uavs: Iterable[Uav]) -> Sequence[Uav]:
    """Return UAVs without what makes no difference to what they may see."""
    return [replace(uav, altitude_m=0.0, link_m=np.inf, swap_s=0.0) for uav in uavs]
