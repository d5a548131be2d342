"""Check a certified plan without the code that made it: verify.py DIR.

docs/formats.md says what the files hold, what is taken as given and what the bound is. Here places
and velocities are complex numbers, x + iy, in metres and metres per second; times are seconds.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parent))  # however this file is run
from verify_bound import NEVER, PLANE, Hops, RoadBound
from verify_files import Array, RefusedError, one_line, shown
from verify_flight import are_flown, legs_named, legs_on
from verify_inputs import Claim, Inputs, read_inputs
from verify_odds import claims as odds_claims
from verify_sight import Motion, Route, Window, first_in_reach, near_pairs, reward_of, segments

TOLERANCE = 1e-6  # by which a figure may be off, as a share of it or, below one, of one
EXACT = 1e-9  # the same for figures that rest on no more than places and times
OFF_M = 1e-4  # by how much all parts of a flight together may be longer than time times speed


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
        off_m, named, net = np.maximum(0.0, late_m), self.inputs.legs, self.inputs.net
        fits = not named
        if given.plan_class == "roads":  # these are never early either
            hops, off_m = Hops(net, place[0], given), abs(late_m)
            legs = legs_on(time_s, place, hops.routes[: hops.legs], hops.nodes)
            fits = legs is not None and are_flown(named, legs, time_s, net)
            watched = [i for leg in legs or () for i in leg.parts]
            most = min(most, RoadBound(self, hops).reward())
        elif named and self.inputs.law is not None:
            legs = legs_named(named, time_s, place, net)
            at_height_s = time_s[np.argmax(place != place[0]) - 1 :]
            fits = legs is not None and are_flown(named, legs, at_height_s, net)
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
        given, (time_s, place), law = self.given, self.route, self.inputs.law
        ever = (0.0, max(given.horizon_s, given.found_by_s or 0))
        waits, begin_s, sees_m = Route(np.zeros(1), place[:1]), time_s[:1], given.radius_m
        if law is not None:  # it climbs first, and may be beside its line at corners
            begin_s = begin_s + law.climb_s
            sees_m += law.corner_m if np.isfinite(law.corner_m) else 0.0
        met_s = self.seen(waits, ever, begin_s, sees_m, given.speed_mps)
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
    given = (f"{key} {value!r}," for key, value in asdict(run.given).items())
    print("assumed:", *given, f"take-off {run.route.time_s[0]} s at {run.route.place[0]:.1f}")
    print(
        "not checked: evaluated",
        *(f"{key} {run.inputs.unchecked[key]}" for key in run.inputs.unchecked),
        sep=", ",
    )
    return _told(claims, TOLERANCE)


def _odds(folder: Path, particles: Path) -> int:
    """Check the figures of a plan on the particles that it was made on."""
    try:
        return _told(list(odds_claims(folder, particles)), EXACT)
    except RefusedError as error:
        print(f"verify.py: {str(folder)!a}: {one_line(error)}", file=sys.stderr)
        return 2


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
