"""Plans by their first hops: bounds for each beginning, the loosest one split again and again.

A beginning is flown exactly, and what it sees needs no price any more. So its bound is the reward
that it has earned, and the price bound for the particles that are still unseen. All road plans
begin with some flight; those that go on from a beginning begin with it and one more hop. The bound
for all is that of the loosest beginning that is not split.
"""

import heapq
import itertools
from collections.abc import Callable, Iterator

import numpy as np

from planner.arrays import Flags, Floats
from planner.bounds.hops import hops_of
from planner.bounds.particle_prices import Start, Table, first_flights
from planner.bounds.sighting_table import pieces_of
from planner.bounds.subgradient import lowest
from planner.search.problem import Problem

Place = tuple[int, float, Floats]  # node, time, reward of what is seen until there
Beginning = tuple[int, ...]  # number of the first flight, then hops; () is before take-off
SMALL = 500_000  # sightings
TIE = 1e-12  # of a reward: no more than what sums in another order differ by
CHUNK = 25  # steps, after which sightings that earn too little are left out anew
NARROW, NEAR = 0.4, 0.6  # of the way from a price to the greatest reward: prices fall no further


class Flights:
    """The beginnings of a problem's road plans, flown exactly."""

    def __init__(self, problem: Problem) -> None:
        self.first = first_flights(problem)
        self._problem, self._hops = problem, hops_of(problem)
        self.legs = self._hops.legs
        self._pieces, self._who = pieces_of(problem.futures)

    def flown(self, beginning: Beginning) -> Place:
        """Return node, time and reward of what is seen, (N,), at the end of a beginning."""
        place = self.first[beginning[0]]
        for hop in beginning[1:]:
            place = self.further(place, hop)
        return place

    def further(self, at: Place, hop: int) -> Place:
        """Return node, time and reward after one more hop."""
        from planner.bounds.kernels.hops import sweep

        _, at_s, reward = at
        seen_at = np.full((1, len(reward)), np.inf)
        sensor = self._problem.sensor
        if hop < self._hops.legs or sensor.detects_in_transit:
            segments, span = self._hops.wide(hop, 0.0), (at_s, 1.0, 1)
            sweep(segments, self._pieces, self._who, span, sensor.radius_m, seen_at)
        earned = np.maximum(reward, self._problem.objective.reward(seen_at[0]))
        return int(self._hops.to_node[hop]), at_s + float(self._hops.duration_s[hop]), earned

    def onward(self, node: int) -> Iterator[tuple[int, int]]:
        """Return the hops that start at a node, and the states that they lead to."""
        hops, nodes = self._hops, len(self._problem.network.node_ids)
        for hop in np.flatnonzero(hops.from_node == node).tolist():
            yield hop, nodes + hop if hop < hops.legs else int(hops.to_node[hop])


class Search:
    """The open beginnings, the loosest first.

    Parameters
    ----------
    value
        Reward of a known plan: beginnings that are worth no more need no split.
    stop
        Hears the bound after each run of the dynamic programme; once it says so, pricing ends.
    """

    def __init__(
        self, problem: Problem, table: Table, value: float, stop: Callable[[float], bool]
    ) -> None:
        self._root, self._flights, self._weight = table, Flights(problem), problem.futures.weight
        self._most = float(problem.objective.reward(np.array(table.bins.first_s)))
        self._deadline = problem.objective.by_s is not None
        self._value, self._stop, self.stopped = value, stop, False
        self._open: list[tuple[float, int, Beginning, Floats]] = []
        self._number = itertools.count()
        self._closed = np.inf  # no beginning that is not open is worth more
        # The most earned, and by what; a tie is not more.
        self.flown: tuple[float, Beginning] = (value * (1 + TIE), ())
        self._priced: dict[Beginning, tuple[float, Floats]] = {}  # bound without them, and prices

    @property
    def proof(self) -> dict[Beginning, Floats]:
        """The beginnings whose own prices, (N,) in units of reward, the bound needs."""
        return {
            beginning: price
            for beginning, (inherited, price) in self._priced.items()
            if inherited > self.bound
        }

    @property
    def better(self) -> tuple[int, ...]:
        """Legs of the best beginning met, if it alone earns more than the known plan.

        Where it flies over a node that no leg of its own touches, the legs alone may earn less.
        """
        return tuple(hop for hop in self.flown[1][1:] if hop < self._flights.legs)

    @property
    def bound(self) -> float:
        """No plan's reward is greater."""
        return max(self._closed, -self._open[0][0] if self._open else -np.inf)

    @property
    def done(self) -> bool:
        """Whether no split can lower the bound."""
        return not self._open or -self._open[0][0] <= self._closed

    def begin(self, price: Floats, steps: int) -> None:
        """Price what is before take-off, in so many steps, and open the first flights."""
        root, unseen = self._root, np.ones(len(price), dtype=bool)
        while True:
            table = root.narrowed(self._floor(price), unseen, root.starts)
            least, price = self._lowest(table, price, 0.0, min(CHUNK, steps))
            self._closed, steps = min(self._closed, least), steps - CHUNK
            if steps <= 0 or self.stopped:
                break
        table.bound(price)
        self._priced[()] = np.inf, price
        near = self._floor(price, NEAR) if root.size > SMALL else root.floor
        self._near = root.narrowed(near, unseen, root.starts)
        for number, place in enumerate(self._flights.first):
            self._add((number,), place, place[0], (self._closed, price, table))
        self._closed = self._value

    def split(self, steps: int) -> None:
        """Tighten the loosest beginning in so many steps; split it if it stays the loosest."""
        inherited, _, beginning, price = self._open[0]
        node, at_s, reward = place = self._flights.flown(beginning)
        got, unseen = float(self._weight @ reward), reward == 0.0
        start = (node, self._root.bins.at(at_s), np.zeros(len(reward)))
        is_new = beginning not in self._priced
        price, table = self._table(price, unseen, start, lower=is_new)
        if is_new:
            _, price = self._lowest(table, price, got, steps)
            self._priced[beginning] = -inherited, price
        bound = min(-inherited, got + table.bound(price)[0])
        heapq.heappop(self._open)
        if bound <= self._value:
            return
        if table.size == 0:  # nothing more is seen, whatever follows
            self._closed = max(self._closed, bound)
            return
        if self._open and bound < -self._open[0][0]:
            heapq.heappush(self._open, (-bound, next(self._number), beginning, price))
            return
        for hop, state in self._flights.onward(node):
            further = self._flights.further(place, hop)
            self._add((*beginning, hop), further, state, (bound, price, table))

    def _table(
        self, price: Floats, unseen: Flags, start: Start, *, lower: bool
    ) -> tuple[Floats, Table]:
        """Return the table of a beginning, and prices no higher than what it may still sell.

        Prices that are part of the proof stay as they are.
        """
        for among in (self._near, self._root):
            free = (price > among.floor) | (among.floor <= self._root.floor)
            if np.all(free, where=unseen):
                lowered = among.no_dearer(price, start) if lower else price
                floor = np.maximum(among.floor, self._floor(lowered))
                table = among.narrowed(floor, unseen, (start,))
                if table.size > 0:
                    break
        return lowered, table

    def _lowest(self, table: Table, price: Floats, got: float, steps: int) -> tuple[float, Floats]:
        def stop(least: float) -> bool:
            self.stopped = self._stop(self.bound if self._priced else min(self.bound, least))
            return self.stopped or got + least <= self._value

        return lowest(table, price, self._value - got, steps=steps, stop=stop)

    def _floor(self, price: Floats, share: float = NARROW) -> Floats:
        """Return below which no step from some prices shall lead, (N,).

        With a deadline all sightings are worth the same, and none can be left out.
        """
        if self._deadline:
            return self._root.floor
        return np.maximum(self._root.floor, price - share * np.maximum(0.0, self._most - price))

    def _add(
        self,
        beginning: Beginning,
        place: Place,
        state: int,
        parent: tuple[float, Floats, Table],
    ) -> None:
        """Open a beginning, unless its parent's prices show that it is worth no more."""
        (_, at_s, reward), (bound, price, table) = place, parent
        self.flown = max(self.flown, (float(self._weight @ reward), beginning))
        earned = float(self._weight @ np.where(reward > 0.0, reward, price))
        bound = min(bound, earned + table.onward(state, table.bins.at(at_s)))
        if bound > self._value:
            heapq.heappush(self._open, (-bound, next(self._number), beginning, price))
