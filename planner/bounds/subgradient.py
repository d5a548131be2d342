"""Better and better prices: a bound that may be stopped at any time."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from planner.arrays import Floats
from planner.bounds.particle_prices import Bounded

PATIENCE = 8  # steps without a lower bound, after which they grow shorter
SHORTER, INERTIA = 0.7, 0.7
AIM = 0.3  # of the gap left, below the lowest bound: the bound that a step aims at
SHORTEST = 1e-3
STARTS = (0.99, 0.97, 0.93, 0.85, 0.75)  # of what a plan earns: prices to try as the first ones


class Priced(Protocol):
    """What any prices prove a bound with."""

    @property
    def weight(self) -> Floats:
        """Of each particle, (N,); 0: it does not count."""

    @property
    def floor(self) -> Floats:
        """The least price of each particle, (N,)."""

    def bound(self, prices: Floats) -> Bounded:
        """Return the greatest expected reward that prices, (N,), allow."""


def first_prices(table: Priced, earned: Floats) -> Floats:
    """Return the best ones of some prices, (N,), to start from where a plan earns so much, (N,)."""
    tried = (np.maximum(share * earned, table.floor) for share in STARTS)
    return min(tried, key=lambda prices: table.bound(prices).reward)


def lowest(
    table: Priced,
    prices: Floats,
    value: float,
    *,
    steps: int,
    stop: Callable[[float], bool],
) -> tuple[float, Floats]:
    """Return the lowest bound found on the expected reward, and the prices that prove it.

    Deflected subgradient steps of Polyak's length.

    Parameters
    ----------
    prices
        To start from, (N,) in units of reward.
    value
        The reward of some plan, which no bound can be below.
    steps
        At most this many.
    stop
        Hears the lowest bound after each step; once it says so, the search ends.
    """
    at = np.maximum(prices, table.floor)
    least, kept = np.inf, at
    direction, length, waited = np.zeros(len(at)), 1.0, 0
    for _ in range(steps):
        bound, counts = table.bound(at)
        waited = 0 if bound < least - 1e-4 * (least - value) or least == np.inf else waited + 1
        if bound < least:
            least, kept = bound, at
        if stop(least) or length < SHORTEST:
            break
        slope = np.where(table.weight > 0.0, 1.0 - counts, 0.0)
        if waited >= PATIENCE:
            length, waited, at = length * SHORTER, 0, kept
            direction = np.zeros(len(at))
        turns_back = direction @ (slope * table.weight) < 0.0
        direction = slope if turns_back else slope + INERTIA * direction
        steepness = float((direction * table.weight) @ direction)
        if steepness == 0.0:
            break
        aimed = bound - value - AIM * (least - value)
        at = np.maximum(table.floor, at - length * aimed / steepness * direction)
    return least, kept
