"""What stored prices prove: the bound of a certificate worked out again, without a search."""

from collections.abc import Mapping

import numpy as np

from planner.arrays import Floats
from planner.bounds.flights import Flights, Prefix
from planner.bounds.movements import Movements, Place
from planner.bounds.particle_prices import Table, fresh_start, table_of


def proven_reward(movements: Movements, bin_s: float, proof: Mapping[Prefix, Floats]) -> float:
    """Return the most that prices let any road plan earn; infinity if they prove nothing.

    Parameters
    ----------
    proof
        Prices by prefix, (N,) each in units of reward. Those of a prefix count only if the one
        that it goes on from has prices too.

    Raises
    ------
    NotApplicableError
        As `planner.bounds.particle_prices.table_of`.
    """
    if () not in proof or any(np.any(~(price >= 0.0)) for price in proof.values()):
        return np.inf
    return _Proof(movements, bin_s, proof).reward()


class _Proof:
    """A table of what can be seen, and the prices to hold against it."""

    def __init__(self, movements: Movements, bin_s: float, proof: Mapping[Prefix, Floats]) -> None:
        self._proof, self._flights = proof, Flights(movements)
        self._weight = movements.problem.futures.weight
        self._table = table_of(movements, bin_s, [np.min([*proof.values()], axis=0)])

    def reward(self) -> float:
        price, table = self._proof[()], self._table
        table.bound(price)
        unseen = np.ones(len(price))
        first = [
            (prefix, place, self._inherited(price, table, place, (np.inf, unseen)))
            for prefix, place in self._flights.begin()
        ]
        return max(0.0, *(self._most(*one) for one in first))

    def _most(self, prefix: Prefix, place: Place, inherited: float) -> float:
        """Return the most that plans with a prefix earn: by its own prices, or its parent's."""
        if prefix not in self._proof:
            return inherited
        price, start = self._proof[prefix], fresh_start(place, self._table.bins)
        table = self._table.narrowed(self._table.floor, place.missed, (start,))
        table.bound(price)
        # All are looked up before the next prefix's values take the place of these.
        onward = []
        for hop, there in self._flights.onward(place):
            bound = self._inherited(price, table, there, (inherited, place.missed))
            onward.append(((*prefix, hop), there, bound))
        earned = float(self._weight @ place.reward)
        return max(earned, *(self._most(*one) for one in onward))

    def _inherited(
        self, price: Floats, table: Table, place: Place, before: tuple[float, Floats]
    ) -> float:
        """Return a bound by the prices of the prefix before: of its bound, and whom it missed."""
        inherited, missed = before
        earned = float(self._weight @ (place.reward + place.missed * price))
        return min(inherited, earned + table.after(place, price, missed))
