"""Plans by their first hops: a bound for each prefix, the loosest one split again and again.

A prefix is flown exactly, and what it sees needs no price any more. So its bound is the reward that
it has earned plus the price bound for the particles that are still unseen. All road plans begin
with some flight from take-off; those that go on from a prefix begin with it and one more hop. The
bound for all plans is that of the loosest prefix that is not split.
"""

import heapq
import itertools
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats
from planner.bounds.kernels.hops import Bins, sweep
from planner.bounds.kernels.prices import Start
from planner.bounds.movements import Movements, Place
from planner.bounds.particle_prices import Table
from planner.bounds.subgradient import lowest

# Hops, of which the first is a flight from take-off, numbered after all others; () is before it.
Prefix = tuple[int, ...]
SMALL = 500_000  # sightings
TIE = 1e-12  # of a reward, within which sums in another order may differ
CHUNK = 25  # steps, after which sightings that earn too little are left out anew
NARROW, NEAR = 0.4, 0.6  # of the way from a price to the greatest reward: prices fall no further


class Onward(NamedTuple):
    """A hop that a flight can go on with."""

    hop: int
    state: int  # of the dynamic programme, after it


class Earned(NamedTuple):
    """The reward of a prefix flown."""

    reward: float
    prefix: Prefix


class Proven(NamedTuple):
    """A prefix that has prices of its own."""

    inherited: float  # its bound without them
    price: Floats  # (N,)


class Parent(NamedTuple):
    """What is known of a prefix, for those that go on from it with one more hop."""

    bound: float
    price: Floats  # (N,)
    table: Table


class _Open(NamedTuple):
    """A prefix that is not split yet, ordered so that the loosest comes first."""

    minus_bound: float
    number: int  # decides between equal bounds
    prefix: Prefix
    price: Floats  # (N,)

    @property
    def bound(self) -> float:
        return -self.minus_bound


class Flights:
    """The prefixes of a problem's road plans, flown exactly."""

    def __init__(self, movements: Movements) -> None:
        self._problem, self._hops = movements.problem, movements.hops
        self._pieces, self._first = movements.pieces, movements.first_flights
        self.legs = self._hops.legs

    def begin(self) -> Iterator[tuple[Prefix, Place]]:
        """Yield each flight from take-off, and where it ends."""
        for hop, place in enumerate(self._first, len(self._hops)):
            yield (hop,), place

    def flown(self, prefix: Prefix) -> Place:
        """Return where a prefix ends."""
        place = self._first[prefix[0] - len(self._hops)]
        for hop in prefix[1:]:
            place = self.further(place, hop)
        return place

    def further(self, at: Place, hop: int) -> Place:
        """Return where one more hop ends."""
        seen_at = np.full((1, len(at.reward)), np.inf)
        sensor = self._problem.sensor
        if hop < self._hops.legs or sensor.detects_in_transit:
            motion, start = self._hops.inflated(hop, 0.0), Bins(at.time_s, 1.0, 1)
            sweep(motion, self._pieces, start, sensor.radius_m, seen_at)
        reward = np.maximum(at.reward, self._problem.objective.reward(seen_at[0]))
        ends_s = at.time_s + float(self._hops.duration_s[hop])
        return Place(int(self._hops.to_node[hop]), ends_s, reward)

    def onward(self, node: int) -> Iterator[Onward]:
        """Yield the hops that start at a node."""
        hops, nodes = self._hops, len(self._problem.network.node_ids)
        for hop in np.flatnonzero(hops.from_node == node).tolist():
            yield Onward(hop, nodes + hop if hop < hops.legs else int(hops.to_node[hop]))


class Search:
    """The open prefixes, the loosest first.

    Parameters
    ----------
    table
        Of the same movements.
    value
        Reward of a known plan: prefixes that are worth no more need no split.
    stop
        Hears the bound after each run of the dynamic programme; once it says so, pricing ends.
    """

    def __init__(
        self, movements: Movements, table: Table, value: float, stop: Callable[[float], bool]
    ) -> None:
        objective = movements.problem.objective
        self._root, self._flights = table, Flights(movements)
        self._weight = movements.problem.futures.weight
        self._most = float(objective.reward(np.array(table.bins.first_s)))
        self._deadline = objective.by_s is not None
        self._value, self._stop, self.stopped = value, stop, False
        self._open: list[_Open] = []
        self._number = itertools.count()
        self._closed = np.inf  # no prefix that is not open is worth more
        self.flown = Earned(value * (1 + TIE), ())  # the best prefix met; a tie is not better
        self._proven: dict[Prefix, Proven] = {}

    @property
    def proof(self) -> dict[Prefix, Floats]:
        """The prefixes whose own prices, (N,) in units of reward, the bound needs."""
        return {
            prefix: proven.price
            for prefix, proven in self._proven.items()
            if proven.inherited > self.bound
        }

    @property
    def better(self) -> tuple[int, ...]:
        """Legs of the best prefix met, if it alone earns more than the known plan.

        Where it flies over a node that no leg of its own touches, the legs alone may earn less.
        """
        return tuple(hop for hop in self.flown.prefix[1:] if hop < self._flights.legs)

    @property
    def bound(self) -> float:
        """No plan's reward is greater."""
        return max(self._closed, self._open[0].bound if self._open else -np.inf)

    @property
    def done(self) -> bool:
        """Whether no split can lower the bound."""
        return not self._open or self._open[0].bound <= self._closed

    def begin(self, price: Floats, steps: int) -> None:
        """Price what is before take-off, in at most ``steps`` steps, and open the first flights."""
        root, unseen = self._root, np.ones(len(price), dtype=bool)
        while True:
            table = root.narrowed(self._floor(price), unseen, root.starts)
            least, price = self._lowest(table, price, 0.0, min(CHUNK, steps))
            self._closed, steps = min(self._closed, least), steps - CHUNK
            if steps <= 0 or self.stopped:
                break
        table.bound(price)
        self._proven[()] = Proven(np.inf, price)
        near = self._floor(price, NEAR) if root.size > SMALL else root.floor
        self._near = root.narrowed(near, unseen, root.starts)
        for prefix, place in self._flights.begin():
            self._add(prefix, place, place.node, Parent(self._closed, price, table))
        self._closed = self._value

    def split(self, steps: int) -> None:
        """Tighten the loosest prefix in at most ``steps`` steps; split it if it stays loosest."""
        loosest = self._open[0]
        prefix, price = loosest.prefix, loosest.price
        place = self._flights.flown(prefix)
        earned, unseen = float(self._weight @ place.reward), place.reward == 0.0
        start = Start(place.node, self._root.bins.at(place.time_s), np.zeros(len(price)))
        is_new = prefix not in self._proven
        price, table = self._table(price, unseen, start, lower=is_new)
        if is_new:
            _, price = self._lowest(table, price, earned, steps)
            self._proven[prefix] = Proven(loosest.bound, price)
        bound = min(loosest.bound, earned + table.bound(price).reward)
        heapq.heappop(self._open)
        if bound <= self._value:
            return
        if table.size == 0:  # nothing more is seen, whatever follows
            self._closed = max(self._closed, bound)
            return
        if self._open and bound < self._open[0].bound:
            heapq.heappush(self._open, _Open(-bound, next(self._number), prefix, price))
            return
        for hop, state in self._flights.onward(place.node):
            further = self._flights.further(place, hop)
            self._add((*prefix, hop), further, state, Parent(bound, price, table))

    def _table(
        self, price: Floats, unseen: Flags, start: Start, *, lower: bool
    ) -> tuple[Floats, Table]:
        """Return the table of a prefix, and prices no higher than what may still be earned.

        Prices that are part of the proof stay as they are.
        """
        for among in (self._near, self._root):
            free = (price > among.floor) | (among.floor <= self._root.floor)
            if np.all(free, where=unseen):
                lowered = among.lowered(price, start) if lower else price
                floor = np.maximum(among.floor, self._floor(lowered))
                table = among.narrowed(floor, unseen, (start,))
                if table.size > 0:
                    break
        return lowered, table

    def _lowest(
        self, table: Table, price: Floats, earned: float, steps: int
    ) -> tuple[float, Floats]:
        def stop(least: float) -> bool:
            self.stopped = self._stop(self.bound if self._proven else min(self.bound, least))
            return self.stopped or earned + least <= self._value

        return lowest(table, price, self._value - earned, steps=steps, stop=stop)

    def _floor(self, price: Floats, share: float = NARROW) -> Floats:
        """Return how low a step from some prices may lead, (N,).

        With a deadline all sightings are worth the same, and none can be left out.
        """
        if self._deadline:
            return self._root.floor
        return np.maximum(self._root.floor, price - share * np.maximum(0.0, self._most - price))

    def _add(self, prefix: Prefix, place: Place, state: int, parent: Parent) -> None:
        """Open a prefix, unless its parent's prices show that it is worth no more."""
        reward, price, table = place.reward, parent.price, parent.table
        self.flown = max(self.flown, Earned(float(self._weight @ reward), prefix))
        earned = float(self._weight @ np.where(reward > 0.0, reward, price))
        bound = min(parent.bound, earned + table.onward(state, table.bins.at(place.time_s)))
        if bound > self._value:
            heapq.heappush(self._open, _Open(-bound, next(self._number), prefix, price))
