"""The prefixes of road plans, flown exactly: their first hops, one after the other."""

from collections.abc import Iterator

import numpy as np

from planner.arrays import Ints
from planner.bounds.kernels.hops import fly
from planner.bounds.kernels.meetings import Motion
from planner.bounds.movements import Movements, Place

# Hops, of which the first is a flight from take-off, numbered after all others; () is before it.
Prefix = tuple[int, ...]


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
        return next(place for other, place in self._flown_on(at, np.array([hop])))

    def onward(self, at: Place) -> Iterator[tuple[int, Place]]:
        """Yield each hop that goes on from a place, and where it ends."""
        return self._flown_on(at, np.flatnonzero(self._hops.from_node == at.node))

    def _flown_on(self, at: Place, some: Ints) -> Iterator[tuple[int, Place]]:
        seen_at = np.full((len(some), len(at.reward)), np.inf)
        sensor, hops = self._problem.sensor, self._hops
        looks = some if sensor.detects_in_transit else some[some < hops.legs]
        if len(looks):
            motions = [hops.motion(hop) for hop in looks.tolist()]
            whose = np.repeat(np.arange(len(looks)), [len(one.from_s) for one in motions])
            flight = Motion(*map(np.concatenate, zip(*motions, strict=True)))
            fly(flight, whose, at.time_s, self._pieces, sensor.radius_m, seen_at)
        reward = np.maximum(at.reward, self._problem.objective.reward(seen_at))
        for i, hop in enumerate(some.tolist()):
            ends_s = at.time_s + float(hops.duration_s[hop])
            yield hop, Place(int(hops.to_node[hop]), ends_s, reward[i])
