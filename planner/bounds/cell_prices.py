"""Cell prices: no flight is worth more than prices and what flights from cell to cell earn above.

Time is divided into ticks, the plane into square cells as wide as the UAV flies in a tick. So from
the middle of one tick to that of the next it gets no farther than into a cell beside its own. From
where it is in the middle of a tick it sees no more, during the tick, than what comes within the
radius and half a tick of flight; how far particles stray from their own places in the middle is
added. A sighting counts from the start of the tick. So every flight has a flight over cells that
may see all that it sees, as early, and the bound by particle prices (see `particle_prices`) holds.

A particle that the cell before may see is left out: the earlier sighting, which is counted, is
worth more. So a flight that stays where it is, or flies along with particles, earns them once.
Cells span all places from which anything is seen. A flight that leaves them sees no less if it
keeps to their border.
"""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Ints
from planner.bounds.kernels.cell_prices import Contacts, Lattice, best_flight
from planner.bounds.particle_prices import Bounded
from planner.bounds.whereabouts import driven_at, is_there, places_at
from planner.search.problem import Problem

MOST_STATES = 500_000  # cells times ticks, about
MOST_TICKS = 5_000
ROUNDING = 1e-9  # of a tick
ROUNDING_M = 1e-6


@dataclass(frozen=True, eq=False)
class CellTable:
    """All that flights from cell to cell may see, and what the bound needs beside prices."""

    weight: Floats  # (N,)
    floor: Floats  # (N,) no price is below
    contacts: Contacts
    lattice: Lattice
    steps: Ints  # (ticks, columns, rows), of the best flights at the last prices asked for

    def bound(self, prices: Floats) -> Bounded:
        """Return the greatest expected reward that prices, (N,) in units of reward, allow."""
        weighted, counts = prices * self.weight, np.zeros(len(prices))
        most = best_flight(self.contacts, self.lattice, weighted, self.steps, counts)
        return Bounded(float(weighted.sum()) + most, counts)


def cell_table(problem: Problem, earliest_s: Floats) -> CellTable:
    """Return the table of the bound for any flight.

    Parameters
    ----------
    earliest_s
        When each particle could be seen if it were the only one, (N,) seconds; infinity: never.
        One of them may be seen at least.
    """
    uav = problem.uav
    ends_s = max(uav.take_off_s, min(problem.objective.ends_s, uav.landing_s))
    flown_m = (ends_s - uav.take_off_s) * uav.speed_mps
    cells_m = np.ptp(_span(problem, problem.sensor.radius_m), axis=0)
    side_m = max(
        problem.sensor.radius_m,
        float(np.prod(cells_m) * flown_m / MOST_STATES) ** (1 / 3),
        flown_m / MOST_TICKS,
        ROUNDING_M,
    )
    tick_s = side_m / uav.speed_mps
    edges_s = uav.take_off_s + tick_s * np.arange(int(flown_m / side_m + ROUNDING) + 2)
    corner_m, far_m = _span(problem, problem.sensor.radius_m + side_m)
    shape = np.ceil((far_m - corner_m) / side_m).astype(int)
    columns, rows = (side_m * np.arange(many) for many in shape)
    away_m = [
        np.maximum(0.0, np.maximum(low - at, at - low - side_m))
        for low, at in ((columns, uav.x_m - corner_m[0]), (rows, uav.y_m - corner_m[1]))
    ]
    ticks = np.hypot(away_m[0][:, None], away_m[1]) / side_m - 1.0 - ROUNDING
    return CellTable(
        weight=problem.futures.weight,
        floor=np.zeros(len(problem.futures)),
        contacts=_contacts(problem, earliest_s, edges_s, corner_m),
        lattice=Lattice(side_m, np.maximum(0.0, np.ceil(ticks)).astype(np.int64)),
        steps=np.zeros((len(edges_s) - 1, *shape), dtype=np.int8),
    )


def _span(problem: Problem, around_m: float) -> Floats:
    """Return the corners of all places of particles and what is around them, (2, 2) metres."""
    xy = np.stack([problem.futures.x_m, problem.futures.y_m], axis=1)
    return np.stack([xy.min(axis=0) - around_m, xy.max(axis=0) + around_m])


def _contacts(problem: Problem, earliest_s: Floats, edges_s: Floats, corner_m: Floats) -> Contacts:
    """Return what may be seen in the ticks between some times, (ticks + 1,) seconds."""
    futures, objective = problem.futures, problem.objective
    shape, tick_s = (len(futures), len(edges_s) - 1), float(edges_s[1] - edges_s[0])
    middles_s, wide_m = edges_s[:-1] + tick_s / 2, problem.uav.speed_mps * tick_s / 2
    xy_m, reach_m = np.zeros((2, *shape)), np.full(shape, -1.0)
    for k in np.flatnonzero(objective.reward(earliest_s) > 0.0).tolist():
        xy_m[:, k] = places_at(futures, k, middles_s) - corner_m[:, None]
        driven_m, at_edges_m = driven_at(futures, k, middles_s), driven_at(futures, k, edges_s)
        strays_m = np.maximum(driven_m - at_edges_m[:-1], at_edges_m[1:] - driven_m)
        is_met = is_there(futures, k, edges_s) & (edges_s[1:] >= earliest_s[k] - ROUNDING_M)
        sees_m = problem.sensor.radius_m + wide_m + strays_m + ROUNDING_M
        reach_m[k] = np.where(is_met, sees_m, -1.0)
    alone = objective.reward(earliest_s)[:, None]
    reward = np.minimum(alone, objective.reward(edges_s[:-1])) * futures.weight[:, None]
    return Contacts(xy_m[0], xy_m[1], reach_m, reward)
