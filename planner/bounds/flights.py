"""The prefixes of road plans, flown exactly: their first hops, one after the other."""

from collections.abc import Iterator

import numpy as np

from planner.arrays import Floats, Ints
from planner.bounds.kernels.flown import Looking, Outcome, fly, look
from planner.bounds.kernels.meetings import Motion
from planner.bounds.movements import Movements, Place, unseen_after
from planner.search.what_if import goal_of

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
        reward, missed = self._done_by(at, some)
        for i, hop in enumerate(some.tolist()):
            ends_s = at.time_s + float(self._hops.duration_s[hop])
            yield hop, Place(int(self._hops.to_node[hop]), ends_s, reward[i], missed[i])

    def _done_by(self, at: Place, some: Ints) -> tuple[Floats, Floats]:
        """Return what is earned after each of some hops from a place, and missed, (hops, N)."""
        problem, hops, shape = self._problem, self._hops, (len(some), len(at.reward))
        sensor, seen_at = problem.sensor, np.full(shape, np.inf)
        out = Outcome(np.zeros(shape), np.ones(shape))
        looks = some if sensor.detects_in_transit else some[some < hops.legs]
        if len(looks):
            motions = [hops.motion(hop) for hop in looks.tolist()]
            whose = np.repeat(np.arange(len(looks)), [len(one.from_s) for one in motions])
            flight = Motion(*map(np.concatenate, zip(*motions, strict=True)))
            if sensor.is_perfect:
                fly(flight, whose, at.time_s, self._pieces, sensor.radius_m, seen_at)
            else:
                goal = goal_of(problem, problem.futures)
                looking = Looking(sensor.radius_m, sensor.rate_per_s, goal)
                look(flight, whose, at.time_s, self._pieces, looking, out)
        if sensor.is_perfect:
            reward = np.maximum(at.reward, problem.objective.reward(seen_at))
            return reward, unseen_after(reward)
        return at.reward + at.missed * out.worth, at.missed * out.missed
