"""The most that any road plan can earn, as the prices of a certificate prove it, for verify.py.

docs/formats.md says what hops and prices are, and what the bound is.
"""

from typing import NamedTuple, Protocol

import numpy as np
from verify_files import Array, RefusedError
from verify_inputs import Given, Net, Prefix
from verify_misses import contacts, outcome
from verify_sight import Motion, Route, Window, reward_of, route_of
from verify_spans import joined, reached_within, seen_within, stays_through
from verify_uavs import Uav

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
    motion: Motion
    weight: Array

    def seen(self, route: Route, window: Window, starts_s: Array, radius_m: float) -> Array:
        """Return when a flight, begun at each start, first sees each particle."""


class Hops:
    """What road plans consist of: legs, straight flights between nodes, flights from take-off.

    Hops are numbered in this order. The place of take-off counts as one more node. A state is
    where flights can stand: nodes first, then each leg just flown.
    """

    def __init__(self, net: Net, uav: Uav, bin_s: float) -> None:
        self.nodes, take_off = net.node_xy_m @ PLANE, complex(*uav.place_m)
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
        self.routes = [route_of(way, uav.speed_mps) for *_, way in hops]
        self.lasts_s = np.array([route.time_s[-1] for route in self.routes])
        bins = self.lasts_s / bin_s
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
    share: Array  # of it that counts

    def where(self, kept: Array | slice) -> "Sightings":
        """Return some of them."""
        return Sightings(*(column[kept] for column in self))


class Step(NamedTuple):
    """A hop from a state. Its own sightings are those that are worth nothing after its leg."""

    state: int
    hop: int
    known: int  # number of the step whose sightings do not count again, or count less


class Stand(NamedTuple):
    """Where a flight stands, what it has earned, and how probably it has missed whom, (N,)."""

    node: int
    time_s: float
    reward: Array
    missed: Array


class RoadBound:
    """The most that any road plan of one UAV can earn, as prices prove it."""

    def __init__(self, run: Flown, hops: Hops, uav: Uav) -> None:
        self.run, self.given, self.hops, self.uav = run, run.given, hops, uav
        self.rate_per_s, self.whole = run.given.bound_rate_per_s, joined(run.motion)
        begin = 0.0 * run.weight
        self.begin = Stand(hops.take_off, uav.take_off_s, begin, begin + 1.0)

    def reward(self) -> float:
        """Return the greatest expected reward that prices allow."""
        listed = self._listed_all()
        return np.inf if listed is None else self._proven((), self.begin, listed, np.inf)

    def above_prices(self) -> float:
        """Return the most that a flight earns above the prices before take-off."""
        listed, price = self._listed_all(), self.run.prices[()]
        if listed is None:
            return np.inf
        values, most = self._values(listed, price, 0, self.begin.missed), 0.0
        for hop in np.flatnonzero(self.hops.start == self.hops.take_off).tolist():
            there = self._further(self.begin, hop)
            first = reward_of(self.given, self._flown(hop, self.begin.time_s))
            above = (1.0 - there.missed) * np.maximum(0.0, first - price)
            onward = self._onward(listed, price, values, there)
            most = max(most, float(self.run.weight @ above) + onward)
        return most

    def _listed_all(self) -> Sightings | None:
        """Return all sightings that earn more than prices; None if these prove nothing.

        As negative ones do not, nor do bins longer than a hop, or a flight of no length.
        """
        given, hops, take_off_s = self.given, self.hops, self.uav.take_off_s
        least = np.min([*self.run.prices.values()], axis=0)
        shortest = hops.least_bins[: hops.chained].min()
        if not (least.min() >= 0 and shortest >= 1):
            return None
        first_s = take_off_s + hops.lasts_s[hops.chained :].min()
        worthless_s = (
            given.horizon_s - least.min() if given.found_by_s is None else given.found_by_s
        )
        ends_s = max(first_s, min(worthless_s, self.uav.lands_s))
        bins = (ends_s - first_s) / given.bin_s + 2
        if bins * hops.chained > MOST_CELLS or bins * len(self.run.weight) > MOST_SIGHTINGS:
            raise RefusedError(f"plan.json: bin_s {given.bin_s:g} makes {bins:.3g} bins, too many")
        self.starts_s = np.arange(first_s, ends_s + given.bin_s, given.bin_s)
        self.edges_s = first_s + (np.arange(len(self.starts_s) + 1) - 0.5) * given.bin_s
        return self._list_steps(least)

    def _flown(self, hop: int, start_s: float) -> Array:
        """Return when a hop begun at a time first has each particle in reach, (N,)."""
        starts_s, radius_m = np.array([start_s]), self.given.radius_m
        return self.run.seen(self.hops.routes[hop], self._looks(hop), starts_s, radius_m)[0]

    def _looks(self, hop: int) -> Window:
        """Return when the sensor is on, seconds after the hop begins."""
        is_on = hop < self.hops.legs or self.given.transit
        return (0.0, self.hops.lasts_s[hop]) if is_on else NEVER

    def _further(self, at: Stand, hop: int) -> Stand:
        """Return where a flight stands after one more hop."""
        given, route, radius_m = self.given, self.hops.routes[hop], self.given.radius_m
        ends_s = at.time_s + self.hops.lasts_s[hop]
        if np.isinf(self.rate_per_s):
            reward = np.maximum(at.reward, reward_of(given, self._flown(hop, at.time_s)))
            return Stand(self.hops.end[hop], ends_s, reward, (reward == 0.0).astype(float))
        met = contacts(route, [self._looks(hop)], at.time_s, self.run.motion, radius_m)
        worth, missed = outcome(given, met, self.rate_per_s, len(self.run.weight))
        reward = at.reward + at.missed * worth
        return Stand(self.hops.end[hop], ends_s, reward, at.missed * missed)

    def _earliest(self, hop: int, more_m: float) -> Array:
        """Return when a hop begun in each bin may see whom, with some more radius, (bins, N)."""
        particles, radius_m = len(self.run.weight), self.given.radius_m + more_m
        route, motion = self.hops.routes[hop], self.run.motion
        return seen_within(route, motion, particles, self.edges_s, radius_m)

    def _missed(self, hop: int, more_m: float) -> Array:
        """Return how probably the longest contacts of a hop begun in each bin miss, (bins, N)."""
        particles, radius_m = len(self.run.weight), self.given.radius_m + more_m
        if np.isinf(self.rate_per_s):
            return np.zeros((len(self.starts_s), particles))
        route = self.hops.routes[hop]
        lasts_s = reached_within(route, self.whole, particles, self.edges_s, radius_m)
        return np.exp(-self.rate_per_s * lasts_s)

    def _list_steps(self, least: Array) -> Sightings:
        """List all steps, and return their sightings that earn more than some prices."""
        hops = self.hops
        before = [self._seen_before(place) for place in hops.nodes]
        found = [self._listed(hop, least, before[hops.start[hop]]) for hop in range(hops.chained)]
        self.steps = [Step(hops.start[hop], hop, NOTHING_KNOWN) for hop in range(hops.chained)]
        for leg in range(hops.legs):
            earliest_s = np.where(before[hops.start[leg]], -np.inf, self._earliest(leg, TIE_M))
            missed = self._missed(leg, TIE_M)
            for hop in np.flatnonzero(hops.start[: hops.chained] == hops.end[leg]).tolist():
                if hop < hops.legs:  # on straight flights nothing is remembered
                    lost = 1.0 - self._left(found[hop], leg, earliest_s, missed)
                    step = np.full(len(lost), len(self.steps))
                    known = found[hop]._replace(step=step, share=found[hop].share * lost)
                    found.append(known.where(lost > 0.0))
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
        share = 1.0 - self._missed(hop, -TIE_M)[i, k] if len(i) else np.empty(0)
        return Sightings(np.full(len(i), hop), i, k, reward[i, k], share)

    def _seen_before(self, place: complex) -> Array:
        """Return who was seen, throughout a bin, by whatever came to a place, (bins, N)."""
        particles, reach_m = len(self.run.weight), self.given.radius_m + TIE_M
        if not self.given.transit or np.isfinite(self.rate_per_s):
            return np.zeros((len(self.starts_s), particles), dtype=bool)
        return stays_through(self.run.motion, particles, self.edges_s, place, reach_m)

    def _left(self, seen: Sightings, leg: int, earliest_s: Array, missed: Array) -> Array:
        """Return what share of sightings is left after a leg, in whichever bin it began."""
        late, early = seen.bin - self.hops.least_bins[leg], seen.bin - self.hops.most_bins[leg]
        left = np.where(early < 0, 1.0, 0.0)
        for i in (early, late):
            where = np.maximum(0, i), seen.particle
            as_much = reward_of(self.given, earliest_s[where] - TIE_S) >= seen.reward
            left = np.maximum(left, np.where(as_much, missed[where], 1.0))
        return left

    def _above(self, sightings: Sightings, price: Array, missed: Array) -> Array:
        """Return what sightings are worth above prices, of particles that were missed before."""
        above = np.maximum(0.0, sightings.reward - price[sightings.particle]) * sightings.share
        return above * (self.run.weight * missed)[sightings.particle]

    def _values(self, sightings: Sightings, price: Array, since: int, missed: Array) -> Array:
        """Return the most that flights on from each bin and state earn above prices."""
        hops, bins, columns = self.hops, len(self.starts_s), len(self.steps) + 1
        state, hop, known = np.array(self.steps).T
        above = self._above(sightings, price, missed)
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
        seen = seen.where((seen.bin >= since) & (at.missed[seen.particle] > 0))
        values = self._values(seen, price, since, at.missed)
        for hop in np.flatnonzero(hops.start == at.node).tolist():
            there = self._further(at, hop)
            bound = weight @ (there.reward + there.missed * price)
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
        unseen = seen.where(seen.step < hops.chained)
        above = self._above(unseen, price, at.missed)
        gain = np.bincount(unseen.step, above, hops.chained)[hop]
        to, later = hops.after[hop], (i + hops.least_bins[hop], i + hops.most_bins[hop])
        onward = gain + np.maximum(values[later[0], to], values[later[1], to])
        return float(max(0.0, onward.max(initial=0.0)))

    def _bin(self, time_s: float) -> int:
        return round(float(time_s - self.starts_s[0]) / self.given.bin_s)
