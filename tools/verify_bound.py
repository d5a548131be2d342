"""The most that any road plan can earn, as the prices of a certificate prove it, for verify.py.

docs/formats.md says what hops and prices are, and what the bound is.
"""

from typing import NamedTuple, Protocol

import numpy as np
from verify_files import Array, RefusedError
from verify_inputs import Given, Net, Prefix
from verify_sight import Motion, Route, Window, reward_of, route_of
from verify_spans import seen_within, stays_through

PLANE = np.array([1, 1j])  # from pairs x, y to complex numbers
NEVER = (0.0, -1.0)
NOTHING_KNOWN = -1
TIE_M = 1e-6  # a distance this near the radius may count either way,
TIE_S = 1e-6  # and so may a moment
MOST_CELLS = 20_100_000  # hops times bins
MOST_SIGHTINGS = 10**8  # bins times particles


class Flown(Protocol):
    """A run whose plan is bounded."""

    given: Given
    prices: dict[Prefix, Array]
    route: Route
    motion: Motion
    weight: Array

    def seen(self, route: Route, window: Window, starts_s: Array, radius_m: float) -> Array:
        """Return when a flight, begun at each start, first sees each particle."""


class Hops:
    """What road plans consist of: legs, straight flights between nodes, flights from take-off.

    Hops are numbered in this order. The place of take-off counts as one more node. A state is
    where flights can stand: nodes first, then each leg just flown.
    """

    def __init__(self, net: Net, take_off: complex, given: Given) -> None:
        self.nodes = net.node_xy_m @ PLANE
        self.take_off, place = len(self.nodes), np.append(self.nodes, take_off)
        roads = [(a, b, xy_m @ PLANE) for a, b, xy_m in net.roads]
        hops = [(a, b, np.concatenate((place[[a]], way[1:-1], place[[b]]))) for a, b, way in roads]
        self.legs, straight = len(hops), {(a, b) for a, b, way in hops if len(way) == 2}
        for a, b in np.ndindex(self.take_off + 1, self.take_off):
            if a != b and (a, b) not in straight and self._is_one_hop(place[a], place[b], a):
                hops.append((a, b, place[[a, b]]))
        self.start, self.end = np.array([ends for *ends, _ in hops]).T
        leg_states = self.take_off + 1 + np.arange(self.legs)
        self.after = np.append(leg_states, self.end[self.legs :])  # the state after each hop
        self.chained = int(sum(self.start < self.take_off))  # the others begin with take-off
        self.routes = [route_of(way, given.speed_mps) for *_, way in hops]
        self.lasts_s = np.array([route.time_s[-1] for route in self.routes])
        bins = self.lasts_s / given.bin_s
        self.least_bins, self.most_bins = (bins + 1e-9).astype(int), (bins + 1 - 1e-9).astype(int)

    def _is_one_hop(self, start: Array, end: Array, node: int) -> bool:
        """Tell whether a straight flight passes over no node in between.

        One from take-off does not begin at a node either, unless that is its end.
        """
        share = (self.nodes - start) / (end - start)
        least = 1e-6 if node < self.take_off else -1e-9
        between = (share.real > least) & (share.real < 1 - 1e-6) & (abs(share.imag) < 1e-9)
        return not between.any()


class Sightings(NamedTuple):
    """What steps begun in a bin may see, sorted by bin; (sightings,) each."""

    step: Array
    bin: Array
    particle: Array
    reward: Array

    def where(self, kept: Array | slice) -> "Sightings":
        """Return some of them."""
        return Sightings(*(column[kept] for column in self))


class Step(NamedTuple):
    """A hop from a state. Its own sightings are those that are worth nothing after its leg."""

    state: int
    hop: int
    known: int  # number of the step whose sightings do not count again


class Stand(NamedTuple):
    """Where a flight stands, and the reward of what it has seen, (N,)."""

    node: int
    time_s: float
    reward: Array


class RoadBound:
    """The most that any road plan can earn, as prices prove it."""

    def __init__(self, run: Flown, hops: Hops) -> None:
        self.run, self.given, self.hops = run, run.given, hops

    def reward(self) -> float:
        """Return the greatest expected reward that prices allow."""
        given, hops, take_off_s = self.given, self.hops, self.run.route.time_s[0]
        least = np.min([*self.run.prices.values()], axis=0)
        shortest = hops.least_bins[: hops.chained].min()
        if not (least.min() >= 0 and shortest >= 1):
            return np.inf  # such prices or bins prove nothing, nor does a flight of no length
        first_s = take_off_s + hops.lasts_s[hops.chained :].min()
        worthless_s = (
            given.horizon_s - least.min() if given.found_by_s is None else given.found_by_s
        )
        ends_s = max(first_s, min(worthless_s, given.lands_s))
        bins = (ends_s - first_s) / given.bin_s + 2
        if bins * hops.chained > MOST_CELLS or bins * len(self.run.weight) > MOST_SIGHTINGS:
            raise RefusedError(f"plan.json: bin_s {given.bin_s:g} makes {bins:.3g} bins, too many")
        self.starts_s = np.arange(first_s, ends_s + given.bin_s, given.bin_s)
        self.edges_s = first_s + (np.arange(len(self.starts_s) + 1) - 0.5) * given.bin_s
        begin = Stand(hops.take_off, take_off_s, 0.0 * self.run.weight)
        return self._proven((), begin, self._list_steps(least), np.inf)

    def _flown(self, hop: int, start_s: float) -> Array:
        """Return when a hop begun at a time sees each particle, (N,)."""
        on = (0.0, self.hops.lasts_s[hop])
        on = on if hop < self.hops.legs or self.given.transit else NEVER
        starts_s, radius_m = np.array([start_s]), self.given.radius_m
        return self.run.seen(self.hops.routes[hop], on, starts_s, radius_m)[0]

    def _earliest(self, hop: int, more_m: float) -> Array:
        """Return when a hop begun in each bin may see whom, with some more radius, (bins, N)."""
        particles, radius_m = len(self.run.weight), self.given.radius_m + more_m
        route, motion = self.hops.routes[hop], self.run.motion
        return seen_within(route, motion, particles, self.edges_s, radius_m)

    def _list_steps(self, least: Array) -> Sightings:
        """List all steps, and return their sightings that earn more than some prices."""
        hops = self.hops
        before = [self._seen_before(place) for place in hops.nodes]
        found = [self._listed(hop, least, before[hops.start[hop]]) for hop in range(hops.chained)]
        self.steps = [Step(hops.start[hop], hop, NOTHING_KNOWN) for hop in range(hops.chained)]
        for leg in range(hops.legs):
            earliest_s = np.where(before[hops.start[leg]], -np.inf, self._earliest(leg, TIE_M))
            for hop in np.flatnonzero(hops.start[: hops.chained] == hops.end[leg]).tolist():
                if hop < hops.legs:  # on straight flights nothing is remembered
                    known = found[hop].where(self._is_known(found[hop], leg, earliest_s))
                    found.append(known._replace(step=np.full(len(known.bin), len(self.steps))))
                self.steps.append(Step(hops.after[leg], hop, len(self.steps)))
        seen = Sightings(*map(np.concatenate, zip(*found, strict=True)))
        return seen.where(np.argsort(seen.bin, kind="stable"))

    def _listed(self, hop: int, least: Array, before: Array) -> Sightings:
        """Return a hop's sightings of those who were not seen before that earn more than prices."""
        if hop < self.hops.legs or self.given.transit:
            at_s = self._earliest(hop, -TIE_M)
        else:
            at_s = np.full((len(self.starts_s), len(least)), np.inf)
        reward = np.where(before, 0.0, reward_of(self.given, at_s))
        i, k = np.nonzero(reward > least)
        return Sightings(np.full(len(i), hop), i, k, reward[i, k])

    def _seen_before(self, place: complex) -> Array:
        """Return who was seen, throughout a bin, by whatever came to a place, (bins, N)."""
        particles, reach_m = len(self.run.weight), self.given.radius_m + TIE_M
        if not self.given.transit:
            return np.zeros((len(self.starts_s), particles), dtype=bool)
        return stays_through(self.run.motion, particles, self.edges_s, place, reach_m)

    def _is_known(self, seen: Sightings, leg: int, earliest_s: Array) -> Array:
        """Tell which sightings are worth nothing after a leg, in whichever bin it began."""
        late, early = seen.bin - self.hops.least_bins[leg], seen.bin - self.hops.most_bins[leg]
        before = [earliest_s[np.maximum(0, i), seen.particle] - TIE_S for i in (early, late)]
        as_much = reward_of(self.given, np.maximum(*before)) >= seen.reward
        return np.asarray((early >= 0) & as_much)

    def _values(self, sightings: Sightings, price: Array, since: int) -> Array:
        """Return the most that flights on from each bin and state earn above prices."""
        hops, bins, columns = self.hops, len(self.starts_s), len(self.steps) + 1
        state, hop, known = np.array(self.steps).T
        above = np.maximum(0.0, sightings.reward - price[sightings.particle])
        above *= self.run.weight[sightings.particle]
        cell = sightings.bin * columns + sightings.step
        gains = np.bincount(cell, above, bins * columns).reshape(bins, columns)  # NOTHING_KNOWN: 0
        chained = slice(hops.chained)
        to, least, most = hops.after[chained], hops.least_bins[chained], hops.most_bins[chained]
        values = np.zeros((bins + most.max() + 1, max(hops.after) + 1))
        for i in range(bins - 1, since - 1, -1):
            whole = gains[i, chained] + np.maximum(values[i + least, to], values[i + most, to])
            np.maximum.at(values[i], state, whole[hop] - gains[i, known])
        return values

    def _proven(self, prefix: Prefix, at: Stand, seen: Sightings, inherited: float) -> float:
        """Return the most that plans with a prefix can earn: by its own prices, or inherited."""
        if prefix not in self.run.prices:
            return inherited
        hops, weight, price = self.hops, self.run.weight, self.run.prices[prefix]
        since, most = max(0, self._bin(at.time_s)), weight @ at.reward
        seen = seen.where((seen.bin >= since) & (at.reward[seen.particle] == 0))
        values = self._values(seen, price, since)
        for hop in np.flatnonzero(hops.start == at.node).tolist():
            reward = np.maximum(at.reward, reward_of(self.given, self._flown(hop, at.time_s)))
            there = Stand(hops.end[hop], at.time_s + hops.lasts_s[hop], reward)
            bound = weight @ np.where(reward > 0, reward, price)
            bound += self._onward(seen, price, values, there)
            most = max(most, self._proven((*prefix, hop), there, seen, min(inherited, bound)))
        return float(most)

    def _onward(self, sightings: Sightings, price: Array, values: Array, at: Stand) -> float:
        """Return the most that flights on from where one stands earn above prices."""
        hops, i = self.hops, self._bin(at.time_s)
        if i >= len(self.starts_s):
            return 0.0
        hop = np.flatnonzero(hops.start[: hops.chained] == at.node)
        begin, end = np.searchsorted(sightings.bin, (i, i + 1))
        seen = sightings.where(slice(begin, end))
        unseen = seen.where((seen.step < hops.chained) & (at.reward[seen.particle] == 0))
        above = np.maximum(0.0, unseen.reward - price[unseen.particle])
        above *= self.run.weight[unseen.particle]
        gain = np.bincount(unseen.step, above, hops.chained)[hop]
        to, later = hops.after[hop], (i + hops.least_bins[hop], i + hops.most_bins[hop])
        onward = gain + np.maximum(values[later[0], to], values[later[1], to])
        return float(max(0.0, onward.max(initial=0.0)))

    def _bin(self, time_s: float) -> int:
        return round(float(time_s - self.starts_s[0]) / self.given.bin_s)
