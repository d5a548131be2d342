"""The bound for any flight: the better one of group hunts and cell prices."""

from collections.abc import Callable

import numpy as np

from planner.arrays import Floats
from planner.bounds.cell_prices import cell_table
from planner.bounds.group_hunts import GroupHunts
from planner.bounds.subgradient import first_prices, lowest
from planner.search.problem import Problem

PRICE_STEPS = 300


def most_of_any_flight(
    problem: Problem, earliest_s: Floats, earned: Floats, stop: Callable[[float], bool]
) -> float:
    """Return an expected reward that no flight's is above, on roads or off them.

    Parameters
    ----------
    earliest_s
        When each particle could be seen if it were the only one, (N,) seconds; infinity: never.
    earned
        What a plan earns with each particle, (N,): where prices start.
    stop
        Hears the lowest bound after each step; once it says so, the search ends.
    """
    least, stopped = np.inf, False

    def hear(bounded: float) -> bool:
        nonlocal least, stopped
        least = min(least, bounded)
        stopped = stop(least)
        return stopped

    GroupHunts(problem, earliest_s).most(hear)
    if not stopped and least > 0.0:
        table = cell_table(problem, earliest_s)
        value = float(problem.futures.weight @ earned)
        lowest(table, first_prices(table, earned), value, steps=PRICE_STEPS, stop=hear)
    return least
