"""`flight.txt`: what a pilot has to know before a flight file is flown."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, NamedTuple

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.export.checks import remarks
from planner.export.directions import HEADING
from planner.export.formats import Wanted
from planner.export.from_run import RunFlight
from planner.export.parameters import lean_note, parameters
from planner.messages import percent, plain
from planner.mission.plan_file import figures

NOT_CERTIFIED = (
    "This is research software, not certified for anything. Who flies this answers for it: check "
    "the flight on a map, obstacles, the airspace, the law and the weather."
)
PAGE_WIDTH = 80  # characters of a line that goes on below its words
BY_S = (300.0, 600.0, 1200.0, 1800.0)  # when the odds are told


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


class Worth(NamedTuple):
    """What flights achieve on the same fresh targets."""

    planned: Flown
    written: Flown
    line: Flown | None = None  # the line that is written, without holds; None: it has none


@dataclass(frozen=True, eq=False)
class Summary:
    """All that is told of a flight that is written, beside the files for machines."""

    run: RunFlight
    wanted: Wanted
    wrong: tuple[str, ...]  # with the flight, as `planner.export.checks.faults` has it
    worth: Worth
    vehicle: tuple[str, ...] | None = None  # how its parameters differ; None: not compared

    @property
    def text(self) -> str:
        """The text of ``flight.txt``."""
        run = self.run
        parts = [
            [height_line(run, self.wanted), NOT_CERTIFIED],
            [plain(run.flight.name), self._times, _clock_line(run)],
            self._figures,
            ["Wrong with it:" if self.wrong else "Nothing was found wrong.", *_listed(self.wrong)],
            ["To know:", *_listed(self._remarks)],
            self._legs,
            _parameters(run, self.wanted),
            self._vehicle,
        ]
        parts = [lines for lines in parts if lines]
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
            *self._remarks,
            *(["\n".join(["", *self._legs, ""])] if self._legs else []),
            *self._vehicle,
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "height_m": self.run.flight.height_m,
            "waypoints": len(self.run.flight.waypoints),
            "in_the_air_s": self.worth.written.lasts_s,
            "as_planned": figures(self.worth.planned.evaluation),
            "as_written": figures(self.worth.written.evaluation),
            "wrong": list(self.wrong),
            "line_alone": None if self.worth.line is None else figures(self.worth.line.evaluation),
            "by_hand": [one._asdict() for one in self.run.by_hand],
            "parameters_differ": None if self.vehicle is None else list(self.vehicle),
        }

    @property
    def _remarks(self) -> list[str]:
        """What a pilot has to know, though nothing is wrong."""
        said = [*remarks(self.run)]
        many = len(self.wanted.parts(self.run.flight))
        if many > 1:
            said.append(
                f"autopilots' files are in {many} parts: each ends in the air, and the next one "
                "goes on from there; the times do not allow for loading it"
            )
        if self.run.by_hand:
            said.append(self._lost)
        if self.worth.line is not None:
            horizon_s = self.worth.line.evaluation.objective.horizon_s
            found = self.worth.line.evaluation.found_by_probability(horizon_s)
            said.append(
                "apps that fly a line, such as DJI's with flight.kml, hold nowhere: scored without "
                f"holds, {percent(found)} are found by {clock(horizon_s)}"
            )
        return said

    @property
    def _lost(self) -> str:
        """What flying by hand costs, of the probability that the plan finds the target."""
        horizon_s = self.worth.written.evaluation.objective.horizon_s
        planned, by_hand = (
            one.evaluation.found_by_probability(horizon_s)
            for one in (self.worth.planned, self.worth.written)
        )
        points = round(100.0 * (planned - by_hand), 1)
        if points == 0.0:
            return f"flown by hand it finds as many as planned, {percent(planned)}"
        part = f", {percent((planned - by_hand) / planned, 0)} of it" if points > 0.0 else ""
        change = f"loses {points:.1f}" if points > 0.0 else f"gains {-points:.1f}"
        return f"flown by hand it {change} points of the {percent(planned)} planned{part}"

    @property
    def _legs(self) -> list[str]:
        """The legs of a pilot with a stick, in order; none for autopilots."""
        if not self.run.by_hand:
            return []
        legs = [
            textwrap.fill(
                f"{k:>3}.{plain(leg.line)}",
                PAGE_WIDTH,
                subsequent_indent=" " * (len(leg.line) - len(leg.phrase) + 4),
                break_on_hyphens=False,
            )
            for k, leg in enumerate(self.run.by_hand, 1)
        ]
        said = "By hand, at full speed, at rest to turn; hold nowhere; bearings from true north:"
        return [said, f"    {HEADING}", *legs]

    @property
    def _vehicle(self) -> list[str]:
        """How the vehicle's parameters differ from those that the times rest on."""
        if self.vehicle is None:
            return []
        if not self.vehicle:
            return ["The vehicle's parameters are those that the times rest on."]
        return ["The vehicle's parameters differ:", *_listed(self.vehicle)]

    @property
    def _figures(self) -> list[str]:
        """How well the plan, and the flight that is written, find the same fresh targets."""
        pair = (self.worth.planned.evaluation, self.worth.written.evaluation)
        horizon_s, by_s = pair[1].objective.horizon_s, pair[1].objective.by_s or inf
        times = [f"{one.expected_detection_time_s:,.0f} s" for one in pair]
        rows = [
            ("", "as planned", "by hand" if self.run.by_hand else "as written"),
            ("expected detection time", *times),
        ]
        for time_s in sorted({*(s for s in (*BY_S, by_s) if s < horizon_s), horizon_s}):
            shares = [percent(one.found_by_probability(time_s)) for one in pair]
            rows.append((f"found by {clock(time_s)}", *shares))
        return [f"{name:<24}{one:>12}{other:>12}" for name, one, other in rows]

    @property
    def _times(self) -> str:
        longer_s = round(self.worth.written.lasts_s - self.worth.planned.lasts_s)
        against = f"{abs(longer_s):,} s {'longer' if longer_s > 0 else 'less'} than planned"
        against = against if longer_s else "as planned"
        lasts = clock(self.worth.written.lasts_s)
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
    who = "PX4" if wanted.autopilot == "px4" else "ArduPilot"
    lines = [one.line for one in parameters(run.aircraft.law, wanted.autopilot)]
    if not lines:
        return ["Which parameters of an aircraft on wings the times rest on is not known."]
    note = lean_note(run.aircraft.law)
    return [
        f"The times rest on these parameters of {who}; set them:",
        *lines,
        *([note] if note else []),
    ]
