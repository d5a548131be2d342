"""The most that any road plan can earn, as the prices of a certificate prove it, for verify.py.

docs/formats.md says what hops and prices are, and what the bound is.
"""

from typing import NamedTuple, Protocol

import numpy as np
from verify_files import Array, RefusedError
from verify_inputs import Given, Net, Prefix
from verify_sight import Route, Window, reward_of, route_of

PLANE = np.array([1, 1j])  # from pairs x, y to complex numbers
NEVER = (0.0, -1.0)
NOTHING_KNOWN = -1
TIE_M = 1e-6  # a distance this near the radius may count either way
MOST_CELLS = 4_100_000  # hops times bins
MOST_SIGHTINGS = 10**8  # bins times particles


class Flown(Protocol):
    """A run whose plan is bounded."""

    given: Given
    prices: dict[Prefix, Array]
    route: Route
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
    """What steps begun in a bin may see; (sightings,) each."""

    step: Array
    bin: Array
    particle: Array
    reward: Array

    def where(self, kept: Array) -> "Sightings":
        """Return some of them."""
        return Sightings(*(column[kept] for column in self))


class Step(NamedTuple):
    """A hop from a state. Its own sightings are those that the state's leg has surely seen."""

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
        surely_m = given.radius_m - given.speed_mps * given.bin_s / 2
        shortest = hops.least_bins[: hops.chained].min()
        if not (least.min() >= 0 and surely_m >= 0 and shortest >= 1):
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
        begin = Stand(hops.take_off, take_off_s, 0.0 * self.run.weight)
        return self._proven((), begin, self._list_steps(least), np.inf)

    def _seen(self, hop: int, starts_s: Array, slack_s: float = 0.0) -> Array:
        """Return when a hop sees each particle if it may start by some slack sooner or later.

        With a negative slack: when it surely does, whenever it starts.
        """
        on = (-slack_s, self.hops.lasts_s[hop] + slack_s)
        on = on if hop < self.hops.legs or self.given.transit else NEVER
        radius_m = self.given.radius_m + self.given.speed_mps * slack_s - TIE_M * np.sign(slack_s)
        return self.run.seen(self.hops.routes[hop], on, starts_s, radius_m)

    def _list_steps(self, least: Array) -> Sightings:
        """List all steps, and return their sightings that earn more than some prices."""
        hops, slack_s, found = self.hops, self.given.bin_s / 2, list[Sightings]()
        sure = [np.isfinite(self._seen(leg, self.starts_s, -slack_s)) for leg in range(hops.legs)]
        self.steps = [Step(hops.start[hop], hop, NOTHING_KNOWN) for hop in range(hops.chained)]
        for hop in range(hops.chained):
            reward = reward_of(self.given, self._seen(hop, self.starts_s, slack_s))
            i, k = np.nonzero(reward > least)
            seen = Sightings(np.full(len(i), hop), i, k, reward[i, k])
            found.append(seen)
            for leg in np.flatnonzero(hops.end[: hops.legs] == hops.start[hop]).tolist():
                if hop < hops.legs:  # on straight flights nothing is remembered
                    known = seen.where(self._is_known(seen, leg, sure[leg]))
                    found.append(known._replace(step=np.full(len(known.bin), len(self.steps))))
                self.steps.append(Step(hops.after[leg], hop, len(self.steps)))
        return Sightings(*map(np.concatenate, zip(*found, strict=True)))

    def _is_known(self, seen: Sightings, leg: int, sure: Array) -> Array:
        """Tell of which sightings a leg flown just before was sure, in whichever bin it began."""
        late, early = seen.bin - self.hops.least_bins[leg], seen.bin - self.hops.most_bins[leg]
        is_sure = sure[np.maximum(0, early), seen.particle]
        return (early >= 0) & is_sure & sure[np.maximum(0, late), seen.particle]

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
            reward = reward_of(self.given, self._seen(hop, np.array([at.time_s]))[0])
            reward = np.maximum(at.reward, reward)
            there = Stand(hops.end[hop], at.time_s + hops.lasts_s[hop], reward)
            onward = values[min(self._bin(there.time_s), len(values) - 1), hops.after[hop]]
            bound = weight @ np.where(reward > 0, reward, price) + onward
            most = max(most, self._proven((*prefix, hop), there, seen, min(inherited, bound)))
        return float(most)

    def _bin(self, time_s: float) -> int:
        return round(float(time_s - self.starts_s[0]) / self.given.bin_s)
