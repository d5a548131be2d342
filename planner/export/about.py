"""`flight.txt`: what a pilot has to know before a flight file is flown."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, NamedTuple

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.export.checks import remarks
from planner.export.formats import Wanted
from planner.export.from_run import RunFlight
from planner.flight.law import FlightLaw
from planner.messages import plain
from planner.mission.plan_file import figures

NOT_CERTIFIED = (
    "This is research software, not certified for anything. Who flies this answers for it: check "
    "the flight on a map, obstacles, the airspace, the law and the weather."
)
BY_S = (300.0, 600.0, 1200.0, 1800.0)  # when the odds are told
LEAN_DEG = ((10.0, 30), (15.0, 45))  # speeds in m/s that recorded flights reached at a lean limit


def height_line(run: RunFlight, wanted: Wanted) -> str:
    """Return what the heights in the files are measured from."""
    height_m = run.flight.height_m
    if wanted.frame == "terrain":
        return (
            f"Autopilots keep {height_m:g} m above the terrain that they know of; all other files "
            "have the height above the launch point, and assume flat ground."
        )
    return (
        f"The height, {height_m:g} m, is above the launch point, and flat ground is assumed: over "
        "higher ground the aircraft is lower above it."
    )


class Flown(NamedTuple):
    """What a flight achieves on fresh targets."""

    evaluation: Evaluation
    lasts_s: float  # how long it is in the air


@dataclass(frozen=True, eq=False)
class Summary:
    """All that is told of a flight that is written, beside the files for machines."""

    run: RunFlight
    wanted: Wanted
    wrong: tuple[str, ...]  # with the flight, as `planner.export.checks.faults` has it
    planned: Flown  # on the same targets as
    written: Flown

    @property
    def text(self) -> str:
        """The text of ``flight.txt``."""
        run = self.run
        parts = [
            [height_line(run, self.wanted), NOT_CERTIFIED],
            [plain(run.flight.name), self._times, _clock_line(run)],
            self._figures,
            ["Wrong with it:" if self.wrong else "Nothing was found wrong.", *_listed(self.wrong)],
            ["To know:", *_listed([*remarks(run)])],
            _parameters(run, self.wanted),
        ]
        if run.flight.attribution:
            parts.append([f"Roads: {plain(run.flight.attribution)}"])
        return "\n\n".join("\n".join(lines) for lines in parts) + "\n"

    @property
    def blocks(self) -> list[str]:
        """What is printed, the most important first."""
        return [
            height_line(self.run, self.wanted),
            NOT_CERTIFIED,
            "\n".join(["", self._times, *self._figures, ""]),
            *(f"wrong: {line}" for line in self.wrong),
            *remarks(self.run),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "height_m": self.run.flight.height_m,
            "waypoints": len(self.run.flight.waypoints),
            "in_the_air_s": self.written.lasts_s,
            "as_planned": figures(self.planned.evaluation),
            "as_written": figures(self.written.evaluation),
            "wrong": list(self.wrong),
        }

    @property
    def _figures(self) -> list[str]:
        """How well the plan, and the flight that is written, find the same fresh targets."""
        pair = (self.planned.evaluation, self.written.evaluation)
        horizon_s, by_s = pair[1].objective.horizon_s, pair[1].objective.by_s or inf
        times = [f"{one.expected_detection_time_s:,.0f} s" for one in pair]
        rows = [("", "as planned", "as written"), ("expected detection time", *times)]
        for time_s in sorted({*(s for s in (*BY_S, by_s) if s < horizon_s), horizon_s}):
            shares = [f"{one.found_by_probability(time_s):.1%}" for one in pair]
            rows.append((f"found by {clock(time_s)}", *shares))
        return [f"{name:<24}{one:>12}{other:>12}" for name, one, other in rows]

    @property
    def _times(self) -> str:
        longer_s = self.written.lasts_s - self.planned.lasts_s
        against = f"{abs(longer_s):,.0f} s {'longer' if longer_s > 0 else 'less'} than planned"
        lasts = clock(self.written.lasts_s)
        said = [f"{len(self.run.flight.waypoints)} waypoints, in the air for {lasts}, {against}"]
        battery = self.run.battery
        if isfinite(battery.lasts_s):
            kept = f", of which {clock(battery.reserve_s)} are kept" if battery.reserve_s else ""
            said.append(f"the battery lasts for {clock(battery.lasts_s)}{kept}")
        return "; ".join(said) + "."


def _listed(lines: Sequence[str]) -> list[str]:
    return [f"- {line}" for line in lines]


def _clock_line(run: RunFlight) -> str:
    take_off_s = float(run.track.time_s[0])
    moment = run.flight.utc(take_off_s)
    since = f"{clock(take_off_s)} after the target was last seen"
    return f"Lift-off is {since}{'' if moment is None else f', at {moment}'}."


def _parameters(run: RunFlight, wanted: Wanted) -> list[str]:
    """Return a line for each parameter; what the aircraft does at once has none."""
    law = run.aircraft.law
    who, named = ("ArduPilot", _ardupilot(law))
    if wanted.autopilot == "px4":
        who, named = "PX4", _px4(law)
    lines = [f"{name:<20}{value:>8g}  {unit}" for name, value, unit in named if isfinite(value)]
    return [f"The times rest on these parameters of {who}; set them:", *lines]


def _ardupilot(law: FlightLaw) -> Iterator[tuple[str, float, str]]:
    yield "WPNAV_SPEED", round(100 * law.speed_mps), "cm/s"
    yield "WPNAV_ACCEL", 100 * law.acceleration_mps2, "cm/s2 at least"
    yield "WPNAV_SPEED_UP", 100 * law.climb_mps, "cm/s"
    yield "WPNAV_SPEED_DN", 100 * law.descend_mps, "cm/s"
    yield "RTL_ALT", round(100 * law.altitude_m), "cm, to come home at this height"
    lean = next((degrees for mps, degrees in LEAN_DEG if law.speed_mps <= mps), None)
    if lean is None:
        yield "ANGLE_MAX", 100 * LEAN_DEG[-1][1], "hundredths of a degree; it may need more: try it"
    else:
        yield "ANGLE_MAX", 100 * lean, "hundredths of a degree at least: with less it is slower"


def _px4(law: FlightLaw) -> Iterator[tuple[str, float, str]]:
    yield "MPC_XY_CRUISE", law.speed_mps, "m/s"
    yield "MPC_ACC_HOR", law.acceleration_mps2, "m/s2 at least"
    yield "MPC_Z_VEL_MAX_UP", law.climb_mps, "m/s"
    yield "MPC_Z_VEL_MAX_DN", law.descend_mps, "m/s"
    yield "RTL_RETURN_ALT", law.altitude_m, "m, to come home at this height"
