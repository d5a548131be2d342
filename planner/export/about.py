"""`flight.txt`: what a pilot has to know before a flight file is flown."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from math import inf, isfinite
from typing import Any, NamedTuple

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.export.checks import remarks
from planner.export.directions import HEADING
from planner.export.formats import Wanted
from planner.export.from_run import RunFlight
from planner.export.parameters import lean_note, parameters
from planner.export.sections import Section, told_once
from planner.messages import percent, plain
from planner.mission.plan_file import figures

NOT_CERTIFIED = (
    "This is research software, not certified for anything. Who flies this answers for it: check "
    "the flight on a map, obstacles, the airspace, the law and the weather."
)
PAGE_WIDTH = 80  # characters of a line that goes on below its words
OF_ALL = ("as_planned", "as_written", "line_alone")  # what all flights together are worth
BY_S = (300.0, 600.0, 1200.0, 1800.0)  # when the odds are told


def height_line(runs: Sequence[RunFlight], wanted: Wanted) -> str:
    """Return what the heights in the files are measured from."""
    heights = " or ".join(f"{h:g} m" for h in sorted({run.flight.height_m for run in runs}))
    if wanted.frame == "terrain":
        return (
            f"Autopilots keep {heights} above the terrain that they know of; all other files "
            "have the height above the launch point, and assume flat ground."
        )
    return (
        f"The height, {heights}, is above the launch point, and flat ground is assumed: over "
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
    def sections(self) -> list[Section]:
        """What ``flight.txt`` has of it, in order."""
        run = self.run
        credit = run.flight.attribution
        wrong = Section(_listed(self.wrong), "Wrong with it:")
        return [
            Section([plain(run.flight.name), self._times, _clock_line(run)]),
            Section(self._figures, whole=True),
            wrong if self.wrong else Section(["Nothing was found wrong."]),
            Section(_listed(self._remarks), "To know:"),
            Section(self._legs, whole=True),
            _parameters(run, self.wanted),
            self._vehicle,
            Section([f"Roads: {plain(credit)}"] if credit else []),
        ]

    @property
    def printed(self) -> list[Section]:
        """What is printed of it, the most important first."""
        return [
            Section([self._times]),
            Section([*self._figures, ""], whole=True),
            Section([f"wrong: {line}" for line in self.wrong]),
            Section(self._remarks),
            Section(["", *self._legs, ""] if self._legs else [], whole=True),
            self._vehicle,
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
            found /= self.worth.line.evaluation.objective.sought
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
            one.evaluation.found_by_probability(horizon_s) / one.evaluation.objective.sought
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
    def _vehicle(self) -> Section:
        """How the vehicle's parameters differ from those that the times rest on."""
        if self.vehicle is None:
            return Section([])
        if not self.vehicle:
            return Section(["The vehicle's parameters are those that the times rest on."])
        return Section(_listed(self.vehicle), "The vehicle's parameters differ:")

    @property
    def _figures(self) -> list[str]:
        """How well the plan, and the flight that is written, find the same fresh targets."""
        pair = (self.worth.planned.evaluation, self.worth.written.evaluation)
        horizon_s, by_s = pair[1].objective.horizon_s, pair[1].objective.by_s or inf
        objective = pair[0].objective
        what = "expected detection time" if objective.sought == 1 else "sum of detection times"
        times = [f"{one.expected_detection_time_s:,.0f} s" for one in pair]
        rows = [
            ("", "as planned", "by hand" if self.run.by_hand else "as written"),
            (what, *times),
        ]
        for time_s in sorted({*(s for s in (*BY_S, by_s) if s < horizon_s), horizon_s}):
            shares = [objective.number_found(one.found_by_probability(time_s)) for one in pair]
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


@dataclass(frozen=True, eq=False)
class About:
    """All flights that are written, of one UAV or of several."""

    flights: tuple[Summary, ...]

    @property
    def text(self) -> str:
        """The text of ``flight.txt``."""
        shared, own = told_once([one.sections for one in self.flights])
        sections = [Section(self._first), *shared, *chain.from_iterable(own)]
        return "\n\n".join("\n".join(one.all_lines) for one in sections if one.lines) + "\n"

    def lines(self, names: Sequence[str]) -> list[str]:
        """Return what is printed; of several flights, each line of one's own with its name."""
        shared, own = told_once([one.printed for one in self.flights])
        said = [*self._first, "", *(line for section in shared for line in section.all_lines)]
        for name, sections in zip(names, own, strict=True):
            said += (line for section in sections for line in section.named(name))
        return said

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data: of one flight all there is, of several what all share first."""
        first, *others = (one.as_dict() for one in self.flights)
        if not others:
            return first
        shared = {key: first[key] for key in OF_ALL}
        each = [{k: v for k, v in one.items() if k not in OF_ALL} for one in (first, *others)]
        return {**shared, "flights": each}

    @property
    def _first(self) -> list[str]:
        """What nobody may overlook."""
        runs = [one.run for one in self.flights]
        return [height_line(runs, self.flights[0].wanted), NOT_CERTIFIED]


def _listed(lines: Sequence[str]) -> list[str]:
    return [f"- {line}" for line in lines]


def _clock_line(run: RunFlight) -> str:
    take_off_s = float(run.track.time_s[0])
    moment = run.flight.utc(take_off_s)
    since = f"{clock(take_off_s)} after the target was last seen"
    return f"Lift-off is {since}{'' if moment is None else f', at {moment}'}."


def _parameters(run: RunFlight, wanted: Wanted) -> Section:
    """Return a line for each parameter; what the aircraft does at once has none."""
    who = "PX4" if wanted.autopilot == "px4" else "ArduPilot"
    lines = [one.line for one in parameters(run.aircraft.law, wanted.autopilot)]
    if not lines:
        return Section(["Which parameters of an aircraft on wings the times rest on is not known."])
    note = lean_note(run.aircraft.law)
    head = f"The times rest on these parameters of {who}; set them:"
    return Section([*lines, *([note] if note else [])], head)
