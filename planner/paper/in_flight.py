"""What planning anew in flight is worth: after a report, after false alarms, and without any news.

Expectations given what was heard are taken over all fresh targets, not over one truth each: what is
independent is not simulated.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.futures.none import NO_TARGETS
from planner.mission.news import given
from planner.mission.online import Mission, Remembering
from planner.mission.planning import problem_of
from planner.mission.resume import Resumed
from planner.mission.standing import Standing
from planner.scenario.news import ReportNews
from planner.scenario.uav_values import PointStart
from planner.search.methods import Method, method_named
from planner.search.problem import Problem

SURE, SD_M, OLD_S = 0.7, 1000.0, 300.0  # of a report, when it arrives


class Flight(NamedTuple):
    """A plan that is flown, and the fresh targets that judge what becomes of it."""

    recorder: Remembering
    plan: Plan
    targets: Futures
    method: Method

    @classmethod
    def planned(cls, recorder: Remembering, targets: Futures, method: str = "best") -> "Flight":
        """Return the flight that a method plans at take-off."""
        planner = method_named(method)
        made = Mission(recorder, Plan("", (), ()), planner).made()
        return cls(recorder, made.plan, targets, planner)

    @property
    def problem(self) -> Problem:
        """What it is planned for, without particles."""
        return problem_of(self.recorder.opened, NO_TARGETS)

    def mission(self, plan: Plan | None = None) -> Mission:
        """Return the mission at its take-off, with this plan or another one."""
        return Mission(self.recorder, self.plan if plan is None else plan, self.method)

    def expected_s(self, track: Track, targets: Futures | None = None) -> float:
        """Return the expected detection time of a flight, on its targets or on others."""
        judges = self.targets if targets is None else targets
        problem = self.problem
        found = evaluate((track,), judges, problem.sensor, problem.objective)
        return found.expected_detection_time_s

    @property
    def whole_s(self) -> float:
        """The expected detection time if it is flown as planned."""
        return self.expected_s(self.plan.tracks[0])


class Heard(NamedTuple):
    """The expected time still to come after something was heard."""

    as_planned_s: float
    anew_s: float


def reported(
    flight: Flight, arrival_s: float, reports: int, rng: np.random.Generator
) -> Iterator[Heard]:
    """Yield the time still to come after each of some reports, which arrive at the same time.

    They are of targets as they are believed in then, and judged as if they were calibrated: each
    is true with the probability that is said of it.
    """
    silent = flight.mission().heard(Standing(arrival_s))
    believed = _believed(flight, silent)
    seen_m = believed.positions(arrival_s - OLD_S)
    for k in rng.choice(len(believed), reports, p=believed.weight / believed.weight.sum()):
        report = report_of(seen_m[k] + rng.normal(0.0, SD_M, 2), arrival_s)
        mission = flight.mission()
        going_on = mission.heard(Standing(arrival_s), [report], insist=True)
        new, judges = mission.planned(going_on).attempt.plan, _believed(flight, going_on)
        old_s, new_s = (
            flight.expected_s(one.tracks[0], judges) for one in (going_on.incumbent, new)
        )
        yield Heard(old_s - arrival_s, new_s - arrival_s)


def report_of(place_m: Floats, arrival_s: float) -> ReportNews:
    """Return the report that somebody has seen the target at a place, (2,) metres."""
    x_m, y_m = place_m.tolist()
    return ReportNews(
        kind="report",
        place=PointStart(x_m=x_m, y_m=y_m),
        at_s=arrival_s - OLD_S,
        heard_s=arrival_s,
        sure=SURE,
        sd_m=SD_M,
    )


def _believed(flight: Flight, going_on: Resumed) -> Futures:
    """Return a flight's targets as they are believed in once something is heard."""
    opened, speed_mps = going_on.opened, flight.problem.uav.speed_mps
    return given(flight.targets, opened.news, opened.network, speed_mps=speed_mps)


def with_no_news(flight: Flight, *at_s: float) -> Track:
    """Return the whole flight if it is planned anew at some times without having heard anything."""
    mission = flight.mission()
    for one_s in at_s:
        going_on = mission.heard(Standing(one_s))
        mission.goes_on(going_on, mission.planned(going_on).attempt.plan)
    return mission.track


def afresh(flight: Flight, at_s: float) -> Track:
    """Return the whole flight if its rest is planned afresh, without the plan that there was."""
    mission = flight.mission()
    going_on = mission.heard(Standing(at_s))
    mission.recorder = mission.recorder.now(going_on.opened)
    (rest,) = mission.made().plan.tracks
    return going_on.flown[0].then(rest) if going_on.flown else rest
