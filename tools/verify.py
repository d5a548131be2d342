"""Check a certified plan without the code that made it: verify.py DIR.

docs/formats.md says what the files hold, what is taken as given and what the bound is. Here places
and velocities are complex numbers, x + iy, in metres and metres per second; times are seconds.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

sys.path.append(str(Path(__file__).parent))  # however this file is run
from verify_files import Array, RefusedError, one_line, shown
from verify_flight import are_flown, legs_on
from verify_inputs import Claim, Given, Inputs, Net, Prefix, read_inputs

Window: TypeAlias = tuple[float, float]  # from and to
PLANE = np.array([1, 1j])  # from pairs x, y to complex numbers
NEVER = (0.0, -1.0)
NOTHING_KNOWN = -1
TOLERANCE = 1e-6  # by which a figure may be off, as a share of it or, below one, of one
TIE_M = 1e-6  # a distance this near the radius may count either way
OFF_M = 1e-4  # by how much all parts of a flight together may be longer than time times speed
MOST_CELLS = 4_100_000  # hops times bins
MOST_SIGHTINGS = 10**8  # bins times particles
AT_ONCE = 2_000_000  # pairs of a flight and a piece of motion


def reward_of(given: Given, seen_at: Array) -> Array:
    """Return what it is worth to see a particle at some times."""
    if given.found_by_s is not None:
        return (seen_at <= given.found_by_s).astype(float)
    return np.maximum(0.0, given.horizon_s - seen_at)


class Route(NamedTuple):
    """A flight: straight from point to point, at rest before and after; (points,) each."""

    time_s: Array
    place: Array


class Segment(NamedTuple):
    """A straight part of a flight; times count from the flight's start."""

    begin_s: float
    end_s: float
    place: complex  # at begin
    velocity: complex


class Motion(NamedTuple):
    """Straight motions of particles at constant velocity; (pieces,) each."""

    particle: Array
    from_s: Array
    to_s: Array  # infinity: at rest without end
    place: Array  # at from
    velocity: Array


def segments(route: Route, window: Window) -> Iterator[Segment]:
    """Yield the straight parts of a flight within a window of time."""
    inside = (route.time_s > window[0]) & (route.time_s < window[1])
    time_s = np.concatenate(([window[0]], route.time_s[inside], [window[1]]))
    place = np.interp(time_s, route.time_s, route.place)
    velocity = np.diff(place) / np.maximum(np.diff(time_s), 1e-9)
    yield from map(Segment, time_s[:-1], time_s[1:], place[:-1], velocity)


def near_pairs(
    segment: Segment, motion: Motion, starts_s: Array, reach_m: float
) -> Iterator[Array]:
    """Yield pieces that may come in reach of a segment, and the start of the flight, (2, pairs).

    A piece lies in a disc around its middle. A rest is cut off where the last flight ends.
    """
    to_s = np.minimum(motion.to_s, starts_s[-1] + segment.end_s)
    half_s = (to_s - motion.from_s) / 2
    disc_m = reach_m + abs(motion.velocity) * half_s + 1e-3
    middle = motion.place + motion.velocity * half_s - segment.place
    along_s = (middle * np.conj(segment.velocity)).real / max(abs(segment.velocity) ** 2, 1e-9)
    nearest = segment.velocity * np.clip(along_s, 0.0, segment.end_s - segment.begin_s)
    near = np.flatnonzero(abs(middle - nearest) <= disc_m)
    first = np.searchsorted(starts_s, motion.from_s[near] - segment.end_s - 1e-6)
    end = np.searchsorted(starts_s, to_s[near] - segment.begin_s + 1e-6)
    counts = np.maximum(0, end - first)
    parts = np.flatnonzero(np.diff(np.cumsum(counts) // AT_ONCE, prepend=0))
    for part in np.split(np.arange(len(near)), parts):
        many, before = counts[part], np.cumsum(counts[part]) - counts[part]
        starts = np.arange(many.sum()) + np.repeat(first[part] - before, many)
        yield np.stack([np.repeat(near[part], many), starts])


def first_in_reach(offset: Array, drift: Array, reach_m: Array, growth_mps: float) -> Array:
    """Return the first t >= 0 with |offset + drift t| <= reach + growth t.

    Negative or not a number: never.
    """
    outside = abs(offset) ** 2 - reach_m**2
    half_b = (np.conj(offset) * drift).real - growth_mps * reach_m
    product = (abs(drift) ** 2 - growth_mps**2) * outside
    return np.where(outside <= 0.0, 0.0, outside / (np.sqrt(half_b**2 - product) - half_b))


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


def route_of(way: Array, speed_mps: float) -> Route:
    """Return the flight along points at full speed, begun at zero."""
    return Route(np.append(0.0, np.cumsum(abs(np.diff(way))) / speed_mps), way)


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

    def __init__(self, run: "Run", hops: Hops) -> None:
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


class Run:
    """A certified plan, its claims, the particles, the net and the prices."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs, self.given, self.prices = inputs, inputs.given, inputs.prices
        self.route = Route(inputs.waypoints[:, 0], inputs.waypoints[:, 1:] @ PLANE)
        of, self.weight = inputs.motion, inputs.weight  # (N,) probability
        place, velocity = of["x_m"] + 1j * of["y_m"], of["vx_mps"] + 1j * of["vy_mps"]
        self.motion = Motion(of["particle"], of["from_s"], of["to_s"], place, velocity)

    def claims(self) -> Iterator[Claim]:
        """Yield each claim beside what is found."""
        given, (time_s, place), most = self.given, self.route, self._most_of_all_flights()
        late_m = abs(np.diff(place)) - given.speed_mps * np.diff(time_s)
        watched: list[int] = np.flatnonzero(np.diff(place) == 0).tolist()
        off_m, fits = np.maximum(0.0, late_m), not self.inputs.legs
        if given.plan_class == "roads":  # these are never early either
            hops, off_m = Hops(self.inputs.net, place[0], given), abs(late_m)
            legs = legs_on(place, hops.routes[: hops.legs], hops.nodes)
            fits = legs is not None and are_flown(self.inputs.legs, legs, time_s, self.inputs.net)
            watched = [i for leg in legs or () for i in leg.parts]
            most = min(most, RoadBound(self, hops).reward())
        fits = bool(fits and off_m.sum() <= OFF_M and time_s[-1] <= given.lands_s + 1e-6)
        yield from self.inputs.record
        yield self._weights()
        yield Claim("flight as its class allows", True, fits, 1 - fits)
        yield from self._figures(self._seen(watched))
        yield self._bound(most)

    def seen(
        self, route: Route, window: Window, starts_s: Array, radius_m: float, growth_mps: float = 0
    ) -> Array:
        """Return when a flight, begun at each start, first sees each particle, (starts, N).

        Parameters
        ----------
        window
            When the sensor is on, seconds after the start.
        growth_mps
            By how much the radius grows in each second after the start.
        """
        seen_at = np.full((len(starts_s), len(self.weight)), np.inf)
        for segment in segments(route, window) if window != NEVER else ():
            widest_m = radius_m + growth_mps * segment.end_s
            for pieces, start in near_pairs(segment, self.motion, starts_s, widest_m):
                at, start_s = Motion(*(column[pieces] for column in self.motion)), starts_s[start]
                begin_s = np.maximum(start_s + segment.begin_s, at.from_s)
                end_s = np.minimum(start_s + segment.end_s, at.to_s)
                flown = segment.place + segment.velocity * (begin_s - start_s - segment.begin_s)
                offset = at.place + at.velocity * (begin_s - at.from_s) - flown
                reach_m, drift = (
                    radius_m + growth_mps * (begin_s - start_s),
                    at.velocity - segment.velocity,
                )
                after_s = first_in_reach(offset, drift, reach_m, growth_mps)
                is_seen = (after_s >= 0.0) & (after_s <= end_s - begin_s)
                whose = start[is_seen], at.particle[is_seen]
                np.minimum.at(seen_at, whose, (begin_s + after_s)[is_seen])
        return seen_at

    def _most_of_all_flights(self) -> float:
        """Return the reward of seeing each particle as soon as the UAV can be there."""
        given, (time_s, place) = self.given, self.route
        ever = (0.0, max(given.horizon_s, given.found_by_s or 0))
        waits = Route(np.zeros(1), place[:1])
        met_s = self.seen(waits, ever, time_s[:1], given.radius_m, given.speed_mps)
        return float(self.weight @ reward_of(given, met_s[0]))

    def _seen(self, watched: list[int]) -> Array:
        """Return when the plan sees each particle: where it may see, and its sensor is on."""
        time_s, radius_m = self.route.time_s, self.given.radius_m
        parts = [(time_s[i], time_s[i + 1]) for i in watched]
        parts = [(time_s[0], time_s[-1])] if self.given.transit else parts
        on = [
            (max(a, begin), min(b, end)) for a, b in self.inputs.sensor_on for begin, end in parts
        ]
        on, at_zero = [window for window in on if window[0] <= window[1]] or [NEVER], np.zeros(1)
        seen = [self.seen(self.route, window, at_zero, radius_m) for window in on]
        return np.min(seen, axis=0)[0]

    def _weights(self) -> Claim:
        weight, whose = self.weight, self.motion.particle
        likely = min(weight.min(), whose.min()) >= 0 and weight.sum() <= 1 + 1e-9
        return Claim("weights are probabilities", "at most 1", weight.sum(), 1 - likely)

    def _figures(self, seen_at: Array) -> Iterator[Claim]:
        weight, given = self.weight, self.given
        planned, certificate = self.inputs.planned, self.inputs.certificate
        missed_s = np.maximum(0.0, given.horizon_s - seen_at)
        found: dict[str, float] = {
            "expected_detection_time_s": given.horizon_s - weight @ missed_s,
            "detection_probability": weight @ (seen_at <= given.horizon_s),
            "particles": len(weight),
        }
        value = planned["expected_detection_time_s"]
        if given.found_by_s is not None:
            found["found_by_probability"] = weight @ reward_of(given, seen_at)
            value = planned["found_by_probability"]
        for key, figure in found.items():
            yield Claim(key, planned[key], figure, abs(planned[key] - figure) / max(1, figure))
        claimed, bound = certificate["gap"], certificate[given.bound_key] or 0.0
        gap = abs(value - bound) / bound if bound > 0 else None
        apart = 0.0 if claimed == gap else np.inf
        if claimed is not None and gap is not None:
            apart = abs(claimed - gap) * bound / max(1, bound)  # of a share of nothing, no more
        yield Claim("gap", claimed, gap, apart)
        particles = certificate["particles"]
        yield Claim("particles", particles, len(weight), float(particles != len(weight)))

    def _bound(self, most: float) -> Claim:
        key, is_upper = self.given.bound_key, self.given.found_by_s is not None
        claimed, bound = (
            self.inputs.certificate[key] or 0.0,
            most if is_upper else self.given.horizon_s - most,
        )
        beyond = bound - claimed if is_upper else claimed - bound
        return Claim(key, claimed, bound, beyond / max(1, bound))


def main(arguments: Sequence[str] | None = None) -> int:
    """Check the run in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder of a certified run")
    folder = parser.parse_args(arguments).directory
    try:
        with np.errstate(all="ignore"):  # where nobody is met
            claims = list((run := Run(read_inputs(folder))).claims())
    except (RefusedError, RecursionError, MemoryError) as error:
        reason, remedy = one_line(error), "`planner certify` makes one"
        print(
            f"verify.py: {str(folder)!a}: holds no certified run ({reason}); {remedy}",
            file=sys.stderr,
        )
        return 2
    given = (f"{key} {value!r}," for key, value in asdict(run.given).items())
    print("assumed:", *given, f"take-off {run.route.time_s[0]} s at {run.route.place[0]:.1f}")
    print(
        "not checked: evaluated",
        *(f"{key} {run.inputs.unchecked[key]}" for key in run.inputs.unchecked),
        sep=", ",
    )
    for claim in claims:
        verdict = "holds" if claim.wrong <= TOLERANCE else "WRONG"
        print(
            f"{claim.name}: claimed {shown(claim.claimed)}, found {shown(claim.found)}: {verdict}"
        )
    return 0 if all(claim.wrong <= TOLERANCE for claim in claims) else 1


if __name__ == "__main__":
    raise SystemExit(main())
