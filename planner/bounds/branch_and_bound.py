"""Plans by their first hops: a bound for each prefix, the loosest one split again and again.

A prefix is flown exactly, and what it sees needs no price any more. So its bound is the reward that
it has earned plus the price bound for the particles that are still unseen, or for what probability
of them is. All road plans begin
with some flight from take-off; those that go on from a prefix begin with it and one more hop. The
bound for all plans is that of the loosest prefix that is not split.
"""

import heapq
import itertools
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.bounds.flights import Flights, Prefix
from planner.bounds.kernels.prices import Start
from planner.bounds.movements import Movements, Place
from planner.bounds.particle_prices import Table, fresh_start
from planner.bounds.subgradient import lowest
from planner.search.stop import never

ROUND = 8  # prefixes at once, whatever the number of threads
SMALL = 500_000  # sightings
TIE = 1e-12  # of a reward, within which sums in another order may differ
CHUNK = 25  # steps, after which sightings that earn too little are left out anew
NARROW, NEAR = 0.4, 0.6  # of the way from a price to the greatest reward: prices fall no further


class Earned(NamedTuple):
    """The reward of a prefix flown."""

    reward: float
    prefix: Prefix


class Proven(NamedTuple):
    """A prefix that has prices of its own."""

    inherited: float  # its bound without them
    price: Floats  # (N,)


class Further(NamedTuple):
    """A prefix that goes on from another one with one more hop."""

    prefix: Prefix
    bound: float  # by the other one's prices
    reward: float  # of the prefix flown


class _Open(NamedTuple):
    """A prefix that is not split yet, ordered so that the loosest comes first."""

    minus_bound: float
    number: int  # decides between equal bounds
    prefix: Prefix
    price: Floats  # (N,)

    @property
    def bound(self) -> float:
        return -self.minus_bound


class _Tightened(NamedTuple):
    """What some price steps make of an open prefix."""

    steps: int
    bound: float
    price: Floats  # (N,)
    further: list[Further] | None  # None: it stays whole
    is_over: bool  # nothing more is seen, whatever follows


class Search:
    """The open prefixes, the loosest first.

    Prefixes are tightened in rounds of as many at once. So the result is the same with any number
    of threads at work; compiled code does nearly all of it, and lets other threads run.

    Parameters
    ----------
    table
        Of the same movements.
    value
        Reward of a known plan: prefixes that are worth no more need no split.
    stop
        Hears the bound after each run of the dynamic programme; once it says so, the search ends.
    is_late
        Tells during a round whether it should end at once.
    workers
        Threads.
    """

    def __init__(
        self,
        movements: Movements,
        table: Table,
        value: float,
        stop: Callable[[float], bool],
        *,
        is_late: Callable[[], bool] = never,
        workers: int = 1,
    ) -> None:
        objective = movements.problem.objective
        self._root, self._flights = table, Flights(movements)
        self._weight = movements.problem.futures.weight
        self._most = float(objective.reward(np.array(table.bins.first_s)))
        self._deadline = objective.by_s is not None
        self._value, self._stop, self._is_late, self.stopped = value, stop, is_late, False
        self._workers = workers
        self._open: list[_Open] = []
        self._round: list[_Open] = []  # those that a round is about, the loosest last
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
        loosest = [*self._open[:1], *self._round[-1:]]
        return max([self._closed, *(one.bound for one in loosest)])

    @property
    def done(self) -> bool:
        """Whether no split can lower the bound."""
        return not self._open or self._open[0].bound <= self._closed

    def begin(self, price: Floats, steps: int) -> None:
        """Price what is before take-off, in at most ``steps`` steps, and open the first flights."""
        root, unseen = self._root, np.ones(len(price))

        def stop(least: float) -> bool:
            self._hear(min(self.bound, least))
            return self.stopped or least <= self._value

        while True:
            table = root.narrowed(self._floor(price), unseen, root.starts)
            most = min(CHUNK, steps)
            least, price = lowest(table, price, self._value, steps=most, stop=stop)
            self._closed, steps = min(self._closed, least), steps - CHUNK
            if steps <= 0 or self.stopped:
                break
        table.bound(price)
        self._proven[()] = Proven(np.inf, price)
        near = self._floor(price, NEAR) if root.size > SMALL else root.floor
        self._near = root.narrowed(near, unseen, root.starts)
        first = [
            self._further(prefix, place, (self._closed, unseen), price, table)
            for prefix, place in self._flights.begin()
        ]
        self._closed = self._value
        for further in first:
            self._add(further, price)

    def split(self, steps: int) -> None:
        """Tighten the loosest prefixes, in at most ``steps`` steps each; split what stays loose."""
        some = [heapq.heappop(self._open) for _ in range(min(ROUND, len(self._open)))]
        self._round, other = some[::-1], self._open[0].bound if self._open else -np.inf
        tighten = partial(self._tightened, steps=steps, other=other)
        for one, done in zip(some, self._all(tighten, some), strict=True):
            for _ in range(done.steps):
                self._hear(self.bound)
            self._round.pop()
            self._put_back(one, done)
            if self.stopped:
                break
        for one in self._round:
            heapq.heappush(self._open, one)
        self._round = []

    def _all(
        self, tighten: Callable[[_Open], _Tightened], some: list[_Open]
    ) -> Iterator[_Tightened]:
        if self._workers == 1:
            return map(tighten, some)
        with ThreadPoolExecutor(self._workers) as threads:
            return threads.map(tighten, some)

    def _tightened(self, loosest: _Open, steps: int, other: float) -> _Tightened:
        """Return what price steps make of a prefix.

        Parameters
        ----------
        other
            Bound of the loosest prefix beside those of the round.
        """
        prefix, price = loosest.prefix, loosest.price
        place = self._flights.flown(prefix)
        earned, missed = float(self._weight @ place.reward), place.missed
        start = fresh_start(place, self._root.bins)
        is_new, taken = prefix not in self._proven, itertools.count()
        price, table = self._table(price, missed, start, lower=is_new)

        def stop(least: float) -> bool:
            next(taken)
            return self._is_late() or earned + least <= self._value

        if is_new:
            value = self._value - earned
            _, price = lowest(table, price, value, steps=steps, stop=stop)
        bound = min(loosest.bound, earned + table.bound(price).reward)
        is_over, further = table.size == 0, None
        if not is_over and bound > self._value and bound >= other:
            further = [
                self._further((*prefix, hop), there, (bound, missed), price, table)
                for hop, there in self._flights.onward(place)
            ]
        return _Tightened(next(taken), bound, price, further, is_over)

    def _put_back(self, one: _Open, done: _Tightened) -> None:
        if one.prefix not in self._proven:
            self._proven[one.prefix] = Proven(one.bound, done.price)
        if done.bound <= self._value:
            return
        if done.is_over:
            self._closed = max(self._closed, done.bound)
        elif done.further is None:
            heapq.heappush(
                self._open, _Open(-done.bound, next(self._number), one.prefix, done.price)
            )
        else:
            for further in done.further:
                self._add(further, done.price)

    def _hear(self, bound: float) -> None:
        self.stopped = self._stop(bound) or self.stopped

    def _table(
        self, price: Floats, missed: Floats, start: Start, *, lower: bool
    ) -> tuple[Floats, Table]:
        """Return the table of a prefix, and prices no higher than what may still be earned.

        Prices that are part of the proof stay as they are.
        """
        for among in (self._near, self._root):
            free = (price > among.floor) | (among.floor <= self._root.floor)
            if np.all(free, where=missed > 0.0):
                lowered = among.lowered(price, start) if lower else price
                floor = np.maximum(among.floor, self._floor(lowered))
                table = among.narrowed(floor, missed, (start,))
                if table.size > 0:
                    break
        return lowered, table

    def _floor(self, price: Floats, share: float = NARROW) -> Floats:
        """Return how low a step from some prices may lead, (N,).

        With a deadline all sightings are worth the same, and none can be left out.
        """
        if self._deadline:
            return self._root.floor
        return np.maximum(self._root.floor, price - share * np.maximum(0.0, self._most - price))

    def _further(
        self,
        prefix: Prefix,
        place: Place,
        before: tuple[float, Floats],
        price: Floats,
        table: Table,
    ) -> Further:
        """Return a prefix that was flown, bounded by the prices of the one that it goes on from.

        Parameters
        ----------
        before
            The bound of that one, and how probably it leaves each particle unseen, (N,).
        """
        bound, missed = before
        earned = float(self._weight @ (place.reward + place.missed * price))
        most = min(bound, earned + table.after(place, price, missed))
        return Further(prefix, most, float(self._weight @ place.reward))

    def _add(self, further: Further, price: Floats) -> None:
        """Open a prefix, unless its bound shows that it is worth no more."""
        self.flown = max(self.flown, Earned(further.reward, further.prefix))
        if further.bound > self._value:
            number = next(self._number)
            heapq.heappush(self._open, _Open(-further.bound, number, further.prefix, price))
