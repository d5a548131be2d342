"""Check a certified plan without the code that made it: verify.py DIR.

docs/formats.md says what the files hold, what is taken as given and what the bound is. Here places
and velocities are complex numbers, x + iy, in metres and metres per second; times are seconds.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TypeAlias

import numpy as np

sys.path.append(str(Path(__file__).parent))  # however this file is run
from verify_bound import NEVER, PLANE, Hops, RoadBound
from verify_files import Array, RefusedError, one_line, read_json, shown
from verify_flight import are_flown, legs_named, legs_on
from verify_inputs import Claim, Inputs, read_inputs
from verify_misses import contacts
from verify_odds import Search, fate, unchecked
from verify_odds import claims as odds_claims
from verify_sight import Motion, Route, Window, first_in_reach, near_pairs, reward_of, segments
from verify_uavs import Flight

Look: TypeAlias = tuple[Route, list[Window]]  # a flight, and when it sees

TOLERANCE = 1e-6  # by which a figure may be off, as a share of it or, below one, of one
EXACT = 1e-9  # the same for figures that rest on no more than places and times
OFF_M = 1e-4  # by how much all parts of a flight together may be longer than time times speed


def _route(flight: Flight) -> Route:
    return Route(flight.waypoints[:, 0], flight.waypoints[:, 1:] @ PLANE)


class Run:
    """A certified plan, its claims, the particles, the net and the prices."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs, self.given, self.prices = inputs, inputs.given, inputs.prices
        of, self.weight = inputs.motion, inputs.weight  # (N,) probability
        place, velocity = of["x_m"] + 1j * of["y_m"], of["vx_mps"] + 1j * of["vy_mps"]
        self.motion = Motion(of["particle"], of["from_s"], of["to_s"], place, velocity)

    def claims(self) -> Iterator[Claim]:
        """Yield each claim beside what is found."""
        given, hops = self.given, list[Hops]()
        if given.plan_class == "roads":
            hops = [Hops(self.inputs.net, uav, given.bin_s) for uav in given.uavs]
        yield from self.inputs.record
        yield self._weights()
        looks = list[Look]()
        for flight in self.inputs.flights:
            fits, watched = self._flown(flight, hops[flight.uav] if hops else None)
            whose = f"UAV {flight.uav + 1}: " if len(given.uavs) > 1 else ""
            yield Claim(f"{whose}flight as its class allows", True, fits, 1 - fits)
            route = _route(flight)
            looks.append((route, self._on(flight, route, watched)))
        yield from self._figures(looks)
        most = self._most_of_all_flights()
        yield self._bound(min(most, self._most_by_prices(hops)) if hops else most)

    def _flown(self, flight: Flight, hops: Hops | None) -> tuple[bool, list[int]]:
        """Tell whether a flight is one of its class, and on which parts it may see if not on all.

        Parameters
        ----------
        hops
            Those of its UAV, of which road plans consist; otherwise None.
        """
        uav, named, net = self.given.uavs[flight.uav], flight.legs, self.inputs.net
        time_s, place = _route(flight)
        late_m = abs(np.diff(place)) - uav.speed_mps * np.diff(time_s)
        watched: list[int] = np.flatnonzero(np.diff(place) == 0).tolist()
        off_m, fits = np.maximum(0.0, late_m), not named
        if hops is not None:  # these are never early either
            off_m = abs(late_m)
            legs = legs_on(time_s, place, hops.routes[: hops.legs], hops.nodes)
            fits = legs is not None and are_flown(named, legs, time_s, net)
            watched = [i for leg in legs or () for i in leg.parts]
        elif named and flight.law is not None:
            legs = legs_named(named, time_s, place, net)
            at_height_s = time_s[np.argmax(place != place[0]) - 1 :]
            fits = legs is not None and are_flown(named, legs, at_height_s, net)
        return bool(fits and off_m.sum() <= OFF_M and time_s[-1] <= uav.lands_s + 1e-6), watched

    def _most_by_prices(self, hops: Sequence[Hops]) -> float:
        """Return the most that road plans can earn as prices prove it."""
        each = zip(hops, self.given.uavs, strict=True)
        bounds = [RoadBound(self, own, uav) for own, uav in each if uav.sorties]
        if len(bounds) == 1:
            return bounds[0].reward()
        least = self.prices[()].min()
        paid = float(self.weight @ self.prices[()])
        return paid + sum(one.above_prices() for one in bounds) if least >= 0.0 else np.inf

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
        """Return the reward of seeing each particle as soon as a UAV can be there."""
        given = self.given
        ever = (0.0, max(given.horizon_s, given.found_by_s or 0))
        met_s = np.full(len(self.weight), np.inf)
        for uav in given.uavs:
            if not uav.sorties:
                continue
            begin_s, sees_m = (
                np.array([uav.take_off_s + uav.climb_s]),
                given.radius_m + uav.strays_m,
            )
            waits = Route(np.zeros(1), np.array([complex(*uav.place_m)]))
            met_s = np.minimum(met_s, self.seen(waits, ever, begin_s, sees_m, uav.speed_mps)[0])
        return float(self.weight @ reward_of(given, met_s))

    def _on(self, flight: Flight, route: Route, watched: list[int]) -> list[Window]:
        """Return when a flight sees: where it may see, and its sensor is on."""
        time_s = route.time_s
        parts = [(time_s[i], time_s[i + 1]) for i in watched]
        parts = [(time_s[0], time_s[-1])] if self.given.transit else parts
        on = [(max(a, begin), min(b, end)) for a, b in flight.sensor_on for begin, end in parts]
        return [window for window in on if window[0] <= window[1]] or [NEVER]

    def _seen(self, looks: Sequence[Look]) -> Array:
        """Return when the plan first has each particle in reach, (N,)."""
        at_zero, radius_m = np.zeros(1), self.given.radius_m
        seen = [self.seen(route, on, at_zero, radius_m) for route, on_s in looks for on in on_s]
        return np.min(seen, axis=0)[0]

    def _fates(self, looks: Sequence[Look]) -> Array:
        """Return what `verify_odds.fate` says of each particle under all flights, (N, 3)."""
        given, spans = self.given, [list[Window]() for _ in self.weight]
        for route, on_s in looks:
            met = contacts(route, on_s, 0.0, self.motion, given.radius_m)
            for who, *span in zip(*met, strict=True):
                if span[0] < given.horizon_s:
                    spans[who].append((float(span[0]), float(min(span[1], given.horizon_s))))
        search = Search(given.radius_m, given.rate_per_s, given.horizon_s, given.found_by_s)
        return np.array([fate(some, search) for some in spans]).reshape(-1, 3)

    def _weights(self) -> Claim:
        weight = self.weight
        likely = weight.min(initial=0.0) >= 0 and weight.sum() <= 1 + 1e-9
        return Claim("weights are probabilities", "at most 1", weight.sum(), 1 - likely)

    def _figures(self, looks: Sequence[Look]) -> Iterator[Claim]:
        weight, given = self.weight, self.given
        planned, certificate = self.inputs.planned, self.inputs.certificate
        if np.isinf(given.rate_per_s):
            seen_at = self._seen(looks)
            saved_s = np.maximum(0.0, given.horizon_s - seen_at)
            found_in_time, found_by = seen_at <= given.horizon_s, reward_of(given, seen_at)
        else:
            lasts_s, unseen, unseen_by = self._fates(looks).T
            saved_s = given.horizon_s - lasts_s
            found_in_time, found_by = 1.0 - unseen, 1.0 - unseen_by
        found: dict[str, float] = {
            "expected_detection_time_s": given.horizon_s - weight @ saved_s,
            "detection_probability": weight @ found_in_time,
            "particles": len(weight),
        }
        value = planned["expected_detection_time_s"]
        if given.found_by_s is not None:
            found["found_by_probability"] = weight @ found_by
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
    parser.add_argument(
        "--futures",
        type=Path,
        metavar="PARTICLES",
        help="check only the figures of a plan of any number of flights, on particles that "
        "`planner futures DIR/run.json -o PARTICLES` has written",
    )
    wanted = parser.parse_args(arguments)
    folder = wanted.directory
    if wanted.futures is not None:
        return _odds(folder, wanted.futures)
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
    given = {key: said for key, said in asdict(run.given).items() if key != "uavs"}
    uavs = [
        f"UAV {number}: take-off {uav.take_off_s} s at {uav.place_m}, speed_mps {uav.speed_mps}, "
        f"landing_s {uav.landing_s}, climb_s {uav.climb_s}, strays_m {uav.strays_m}"
        + ("" if uav.sorties == 1 else f", sorties {uav.sorties}")
        + ("" if uav.sorties else ": it flies no more and is left out of the bound")
        for number, uav in enumerate(run.given.uavs, 1)
    ]
    print("assumed:", ", ".join([*(f"{key} {value!r}" for key, value in given.items()), *uavs]))
    print(
        "not checked: evaluated",
        *(f"{key} {run.inputs.unchecked[key]}" for key in run.inputs.unchecked),
        sep=", ",
    )
    return _told(claims, TOLERANCE)


def _odds(folder: Path, particles: Path) -> int:
    """Check the figures of a plan on the particles that it was made on."""
    try:
        claims = list(odds_claims(folder, particles))
        given = unchecked(read_json(folder, "plan.json").part("planned"))
    except RefusedError as error:
        print(f"verify.py: {str(folder)!a}: {one_line(error)}", file=sys.stderr)
        return 2
    if given:
        print("assumed:", ", ".join(f"{key} {said!r}" for key, said in given.items()))
    return _told(claims, EXACT)


def _told(claims: Sequence[Claim], tolerance: float) -> int:
    """Print which claims hold; return the exit code."""
    for claim in claims:
        verdict = "holds" if claim.wrong <= tolerance else "WRONG"
        print(
            f"{claim.name}: claimed {shown(claim.claimed)}, found {shown(claim.found)}: {verdict}"
        )
    return 0 if all(claim.wrong <= tolerance for claim in claims) else 1


if __name__ == "__main__":
    raise SystemExit(main())
