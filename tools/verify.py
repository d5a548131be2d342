"""Check a certified plan without the code that made it: verify.py DIR.

docs/formats.md says what the files hold, what is taken as given and what the bound is. Here places
and velocities are complex numbers, x + iy, in metres and metres per second; times are seconds.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from pyarrow.parquet import read_table

Array: TypeAlias = Any  # of NumPy; its shape is said in words
Window: TypeAlias = tuple[float, float]  # from and to
Prefix: TypeAlias = tuple[int, ...]  # the first hops of a flight; () is before take-off
PLANE = np.array([1, 1j])  # from pairs x, y to complex numbers
NEVER = (0.0, -1.0)
NOTHING_KNOWN = -1
TOLERANCE = 1e-6  # by which a figure may be off, as a share of it or, below one, of one
TIE_M = 1e-6  # a distance this near the radius may count either way
OFF_M = 1e-4  # by how much all parts of a flight together may be longer than time times speed
OF_MOTION = ("particle", "from_s", "to_s", "x_m", "y_m", "vx_mps", "vy_mps")
OF_CERTIFICATE = ("plan_class", "transit", "speed_mps", "landing_s", "bin_s")


@dataclass(frozen=True)
class Given:
    """What plan.json says of the problem; it is taken as given."""

    horizon_s: float
    radius_m: float
    plan_class: str
    transit: bool
    speed_mps: float
    landing_s: float | None
    bin_s: float
    found_by_s: float | None

    @property
    def bound_key(self) -> str:
        """The name of the bound in the certificate."""
        return "upper_bound_probability" if self.found_by_s else "lower_bound_s"

    def reward(self, seen_at: Array) -> Array:
        """Return what it is worth to see a particle at some times."""
        if self.found_by_s:
            return (seen_at <= self.found_by_s).astype(float)
        return np.maximum(0.0, self.horizon_s - seen_at)


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


def near_pairs(segment: Segment, motion: Motion, starts_s: Array, reach_m: float) -> Array:
    """Return pieces that may come in reach of a segment, and the start of the flight, (2, pairs).

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
    before = np.cumsum(counts) - counts
    starts = np.arange(counts.sum()) + np.repeat(first - before, counts)
    return np.stack([np.repeat(near, counts), starts])


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

    def __init__(self, net: dict[str, Any], take_off: complex, given: Given) -> None:
        self.nodes = np.array(net["node_xy_m"], dtype=float) @ PLANE
        self.take_off, place = len(self.nodes), np.append(self.nodes, take_off)
        roads = [(a, b, np.array(xy_m) @ PLANE) for a, b, xy_m in net["roads"]]
        hops = [(a, b, np.concatenate((place[[a]], way[1:-1], place[[b]]))) for a, b, way in roads]
        self.legs, straight = len(hops), {(a, b) for a, b, way in hops if len(way) == 2}
        for a, b in np.ndindex(self.take_off + 1, self.take_off):
            if (a, b) not in straight and self._is_one_hop(place[a], place[b], a):
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
        """Tell whether a straight flight leads anywhere and passes over no node in between.

        From take-off it may lead nowhere, but not begin at a node that is not its end.
        """
        share = (self.nodes - start) / (end - start)
        least = 1e-6 if node < self.take_off else -1e-9
        between = (share.real > least) & (share.real < 1 - 1e-6) & (abs(share.imag) < 1e-9)
        return (start != end or node == self.take_off) and not between.any()


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
            return np.inf  # such prices or bins prove nothing
        first_s = take_off_s + hops.lasts_s[hops.chained :].min()
        ends_s = min(given.found_by_s or given.horizon_s - least.min(), given.landing_s or np.inf)
        self.starts_s = np.arange(first_s, max(first_s, ends_s) + given.bin_s, given.bin_s)
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
            reward = self.given.reward(self._seen(hop, self.starts_s, slack_s))
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
            reward = self.given.reward(self._seen(hop, np.array([at.time_s]))[0])
            reward = np.maximum(at.reward, reward)
            there = Stand(hops.end[hop], at.time_s + hops.lasts_s[hop], reward)
            onward = values[min(self._bin(there.time_s), len(values) - 1), hops.after[hop]]
            bound = weight @ np.where(reward > 0, reward, price) + onward
            most = max(most, self._proven((*prefix, hop), there, seen, min(inherited, bound)))
        return float(most)

    def _bin(self, time_s: float) -> int:
        return round(float(time_s - self.starts_s[0]) / self.given.bin_s)


class Claim(NamedTuple):
    """What the files say, and what is found."""

    name: str
    claimed: Any
    found: Any
    wrong: Any  # by how much


def numbers(path: Path, *names: str) -> list[Array]:
    """Return columns of numbers of a Parquet file, by name."""
    table = read_table(path)
    return [np.from_dlpack(table[name].combine_chunks()) for name in names]


class Run:
    """A certified plan, its claims, the particles, the net and the prices."""

    def __init__(self, folder: Path) -> None:
        plan, net = (json.loads((folder / name).read_text()) for name in ("plan.json", "net.json"))
        self.planned, self.certificate, (uav,) = plan["planned"], plan["certificate"], plan["uavs"]
        given = {key: self.planned[key] for key in ("horizon_s", "radius_m")}
        given |= {key: self.certificate[key] for key in OF_CERTIFICATE}
        self.given, self.net = Given(**given, found_by_s=self.planned.get("found_by_s")), net
        waypoints = np.array(uav["waypoints"], dtype=float)
        self.route = Route(waypoints[:, 0], waypoints[:, 1:] @ PLANE)
        self.sensor_on: list[Window] = uav["sensor_on"]
        particle, from_s, to_s, x, y, vx, vy = numbers(folder / "motion.parquet", *OF_MOTION)
        self.motion = Motion(particle, from_s, to_s, x + 1j * y, vx + 1j * vy)
        (self.weight,) = numbers(folder / "weights.parquet", "weight")  # (N,) probability
        table = read_table(folder / "prices.parquet")
        flights = zip(table["flight"].to_pylist(), table["price"].to_pylist(), strict=True)
        self.prices: dict[Prefix, Array] = {tuple(hops): np.array(price) for hops, price in flights}

    def claims(self) -> Iterator[Claim]:
        """Yield each claim beside what is found."""
        given, (time_s, place), most = self.given, self.route, self._most_of_all_flights()
        late_m = abs(np.diff(place)) - given.speed_mps * np.diff(time_s)
        watched: list[int] | None = np.flatnonzero(np.diff(place) == 0).tolist()
        off_m = np.maximum(0.0, late_m)
        if given.plan_class == "roads":  # these are never early either
            hops = Hops(self.net, place[0], given)
            watched, off_m = on_legs(place, hops), abs(late_m)
            most = min(most, RoadBound(self, hops).reward())
        lands = time_s[-1] <= (given.landing_s or np.inf) + 1e-6
        fits = bool(watched is not None and off_m.sum() <= OFF_M and lands)
        yield self._weights()
        yield Claim("flight as its class allows", True, fits, 1 - fits)
        yield from self._figures(self._seen(watched or []))
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
            pieces, start = near_pairs(segment, self.motion, starts_s, widest_m)
            at, start_s = Motion(*(column[pieces] for column in self.motion)), starts_s[start]
            begin_s = np.maximum(start_s + segment.begin_s, at.from_s)
            end_s = np.minimum(start_s + segment.end_s, at.to_s)
            flown = segment.place + segment.velocity * (begin_s - start_s - segment.begin_s)
            offset = at.place + at.velocity * (begin_s - at.from_s) - flown
            reach_m = radius_m + growth_mps * (begin_s - start_s)
            after_s = first_in_reach(offset, at.velocity - segment.velocity, reach_m, growth_mps)
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
        return float(self.weight @ given.reward(met_s[0]))

    def _seen(self, watched: list[int]) -> Array:
        """Return when the plan sees each particle: where it may see, and its sensor is on."""
        time_s, radius_m = self.route.time_s, self.given.radius_m
        parts = [(time_s[i], time_s[i + 1]) for i in watched]
        parts = [(time_s[0], time_s[-1])] if self.given.transit else parts
        on = [(max(a, begin), min(b, end)) for a, b in self.sensor_on for begin, end in parts]
        on, at_zero = [window for window in on if window[0] <= window[1]] or [NEVER], np.zeros(1)
        seen = [self.seen(self.route, window, at_zero, radius_m) for window in on]
        return np.min(seen, axis=0)[0]

    def _weights(self) -> Claim:
        weight, whose = self.weight, self.motion.particle
        likely = min(weight.min(), whose.min()) >= 0 and weight.sum() <= 1 + 1e-9
        return Claim("weights are probabilities", "at most 1", weight.sum(), 1 - likely)

    def _figures(self, seen_at: Array) -> Iterator[Claim]:
        weight, given = self.weight, self.given
        time_s = given.horizon_s - weight @ np.maximum(0.0, given.horizon_s - seen_at)
        found = weight @ given.reward(seen_at)
        gap = abs((found if given.found_by_s else time_s) / self.certificate[given.bound_key] - 1)
        ever = weight @ (seen_at <= given.horizon_s)
        planned = {"expected_detection_time_s": time_s, "detection_probability": ever}
        planned |= {"found_by_probability": found} if given.found_by_s else {}
        planned |= {"particles": len(weight)}
        finite_gap = None if gap == np.inf else gap
        certificate: dict[str, Any] = {"gap": finite_gap, "particles": len(weight)}
        for said, figures in ((self.planned, planned), (self.certificate, certificate)):
            for key, figure in figures.items():
                off = said[key] != figure and abs(said[key] - figure) / max(1, figure)
                yield Claim(key, said[key], figure, off)

    def _bound(self, most: float) -> Claim:
        claimed, is_upper = self.certificate[self.given.bound_key], bool(self.given.found_by_s)
        bound = most if is_upper else self.given.horizon_s - most
        beyond = bound - claimed if is_upper else claimed - bound
        return Claim(self.given.bound_key, claimed, bound, beyond / max(1, bound))


def on_legs(place: Array, hops: Hops) -> list[int] | None:
    """Return the parts of a flight, by their first point, that are on legs.

    None if the flight does not consist of whole hops.
    """
    i, watched, legs = 0, list[int](), [route.place for route in hops.routes[: hops.legs]]
    while i < len(place) - 1:
        flown = (leg for leg in legs if np.array_equal(leg, place[i : i + len(leg)]))
        points = len(next(flown, ()))
        if points == 0 and place[i + 1] not in hops.nodes:
            return None  # neither a leg nor a straight flight to a node
        watched += range(i, i + points - 1)
        i += max(1, points - 1)
    return watched


def main() -> int:
    """Check the run in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder of a certified run")
    folder = parser.parse_args().directory
    np.seterr(divide="ignore", invalid="ignore")  # where nobody is met
    try:
        claims = list((run := Run(folder)).claims())
    except (OSError, LookupError, AttributeError, TypeError, ValueError, ArithmeticError) as error:
        parser.error(f"{folder}: holds no certified run ({error}); `planner certify` makes one")
    given = (f"{of.name} {getattr(run.given, of.name)!r}," for of in fields(run.given))
    print("assumed:", *given, f"take-off {run.route.time_s[0]} s at {run.route.place[0]:.1f}")
    for claim in claims:
        verdict = "holds" if claim.wrong <= TOLERANCE else "WRONG"
        print(f"{claim.name}: claimed {claim.claimed}, found {claim.found}: {verdict}")
    return 0 if all(claim.wrong <= TOLERANCE for claim in claims) else 1


if __name__ == "__main__":
    raise SystemExit(main())
