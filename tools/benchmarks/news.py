"""What planning anew with news gains, and that it gains nothing without any.

On the 5 x 5 grid, detects .9. Expectations given what was heard are taken over all fresh targets,
not over one truth each: what is independent is not simulated. Intervals are over reports, or over
sequences of alarms.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from benchmarks.figures import Figure
from planner import (
    Futures,
    OpenScenario,
    Particles,
    Plan,
    RoadNetwork,
    Track,
    evaluate,
    method_named,
    open_scenario,
    plan_of_legs,
    problem_of,
    sample,
    stream,
)
from planner.futures.none import NO_TARGETS
from planner.intervals import student_interval
from planner.mission.alarms import Alarms, Compared, compared, with_alarms
from planner.mission.news import given
from planner.mission.online import Mission, Remembering
from planner.mission.resume import Standing
from planner.scenario.news import ReportNews
from planner.scenario.uav_values import PointStart

GRID, SEED, TARGETS = "grid5x5", 1001, 65_536
DETECTS = 0.9
ARRIVALS_S = (1000.0, 2000.0, 4000.0)
SURE, SD_M, OLD_S, REPORTS = 0.7, 1000.0, 300.0, 200
ALARMS, SEQUENCES = Alarms(every_s=600.0, lasts_s=120.0), 64
REPORT_AIMS = {60: 20.0, 120: 22.0, 300: 22.0}  # percent, lower limits
LATE_AIMS, SLOWED_AIM = {60: 15.0, 120: 8.0}, 4.0
NO_NEWS_S, NO_NEWS = (1000.0, 2000.0, 4000.0), 0.3
Moved = Callable[[RoadNetwork, Particles], Futures]


class Flight:
    """A plan for the grid from one distance, and the targets that judge what becomes of it."""

    def __init__(self, u0_km: int, moved: Moved, targets: int = TARGETS, *extra: str) -> None:
        overrides = (f"uav.start.distance_m={1000 * u0_km}", f"sensor.detects={DETECTS}", *extra)
        self.opened = open_scenario(GRID, overrides=overrides)
        self.recorder, self.method = Remembering(self.opened, 1), method_named("best")
        self.targets = fresh(self.opened, targets, moved)
        self.problem = problem_of(self.opened, NO_TARGETS)
        self.plan = self.mission(Plan("", (), ())).made().plan

    def mission(self, plan: Plan | None = None) -> Mission:
        """Return a mission at its take-off."""
        return Mission(self.recorder, self.plan if plan is None else plan, self.method)

    def expected_s(self, track: Track, targets: Futures | None = None) -> float:
        """Return what a flight is worth on targets."""
        judges = self.targets if targets is None else targets
        found = evaluate((track,), judges, self.problem.sensor, self.problem.objective)
        return found.expected_detection_time_s


def fresh(opened: OpenScenario, many: int, moved: Moved) -> Futures:
    """Return fresh targets, independent draws, the same whatever was planned."""
    horizon_s, rng = opened.scenario.search.horizon_s, stream(SEED, "evaluation")
    drawn = sample(opened.prior, opened.network, many, rng, sampling="iid", horizon_s=horizon_s)
    return moved(opened.network, drawn)


def report_rows(flight: Flight, aim: float, reports: int = REPORTS) -> Iterator[Figure]:
    """Measure what one report saves of the time still to come, at three times of arrival."""
    saved: list[float] = []
    whole: list[float] = []
    for arrival_s in ARRIVALS_S:
        gains = [*_reported(flight, arrival_s, reports)]
        left, gained = np.array(gains).T
        saved, whole = [*saved, *gained], [*whole, *left]
        share = 100.0 * gained.sum() / left.sum()
        yield Figure(f"report at {arrival_s:,.0f} s: remaining time less by", "%", (share,))
    share, low, _ = _ratio(saved, whole)
    yield Figure("reports: remaining time less by", "%", (share,))
    yield Figure("reports: the same, lower 95 % limit", "%", (low,), at_least=aim)


def _reported(flight: Flight, arrival_s: float, reports: int) -> Iterator[tuple[float, float]]:
    """Yield the time still to come with the old plan, and what a new one saves, per report."""
    rng = stream(SEED, "reports", f"{arrival_s:g}")
    silent = flight.mission().heard(Standing(arrival_s)).opened
    speed_mps = flight.problem.uav.speed_mps
    believed = given(flight.targets, silent.news, silent.network, speed_mps=speed_mps)
    weight = believed.weight / believed.weight.sum()
    seen_m = believed.positions(arrival_s - OLD_S)
    for k in rng.choice(len(weight), reports, p=weight).tolist():
        x_m, y_m = (seen_m[k] + rng.normal(0.0, SD_M, 2)).tolist()
        report = ReportNews(
            kind="report",
            place=PointStart(x_m=x_m, y_m=y_m),
            at_s=arrival_s - OLD_S,
            heard_s=arrival_s,
            sure=SURE,
            sd_m=SD_M,
        )
        mission = flight.mission()
        going_on = mission.heard(Standing(arrival_s), [report], insist=True)
        new = mission.planned(going_on).attempt.plan
        opened = going_on.opened
        judges = given(flight.targets, opened.news, opened.network, speed_mps=speed_mps)
        old_s, new_s = (
            flight.expected_s(one.tracks[0], judges) for one in (going_on.incumbent, new)
        )
        yield old_s - arrival_s, old_s - new_s


def alarm_rows(
    flight: Flight, slowed: Flight, aim: float, sequences: int = SEQUENCES
) -> Iterator[Figure]:
    """Measure planning anew after false alarms against the plan flown late, and a slowed one."""
    horizon_s = flight.problem.objective.horizon_s
    gaps = [ALARMS.gaps_s(horizon_s, stream(SEED, "alarms", k)) for k in range(sequences)]
    found = compared(flight.mission(), flight.targets, gaps, ALARMS.lasts_s)
    order = [leg.leg for leg in slowed.plan.legs[0]]
    route = plan_of_legs(flight.problem, "slowed", order)
    fixed_s = tuple(
        flight.expected_s(
            with_alarms(flight.mission(route), one.tolist(), ALARMS.lasts_s, anew=False)
        )
        for one in gaps
    )
    yield Figure("alarms: E flown late", "s", (float(np.mean(found.late_s)),))
    yield Figure("alarms: E planned anew", "s", (float(np.mean(found.anew_s)),))
    for name, one, least in (
        ("flown late", found, aim),
        ("the fixed plan for the slowed UAV", Compared(fixed_s, found.anew_s), SLOWED_AIM),
    ):
        yield Figure(f"alarms: less than {name}", "%", (100.0 * one.saved,))
        low = 100.0 * one.interval[0]
        yield Figure(f"alarms: less than {name}, lower limit", "%", (low,), at_least=least)


def silence_rows(flight: Flight) -> Iterator[Figure]:
    """Measure how much planning anew without news changes, and fresh plans without the old one."""
    before_s = flight.expected_s(flight.plan.tracks[0])
    mission = flight.mission()
    for at_s in NO_NEWS_S:
        going_on = mission.heard(Standing(at_s))
        mission.goes_on(going_on, mission.planned(going_on).attempt.plan)
    change = 100.0 * abs(flight.expected_s(mission.track) / before_s - 1.0)
    yield Figure("no news: E changes by", "%", (change,), at_most=NO_NEWS)
    ends_s = flight.plan.tracks[0].end_s
    worst = max(_afresh(flight, share * ends_s) for share in (0.25, 0.5, 0.75))
    yield Figure("no news, the old plan withheld: worse by", "%", (worst,), at_most=1.0)


def _afresh(flight: Flight, at_s: float) -> float:
    """Return by how much a plan made afresh in flight is worse than the one there was, percent."""
    mission = flight.mission()
    going_on = mission.heard(Standing(at_s))
    mission.recorder = mission.recorder.now(going_on.opened)
    (rest,) = mission.made().plan.tracks
    whole_s = flight.expected_s(going_on.flown[0].then(rest))
    return 100.0 * (whole_s / flight.expected_s(flight.plan.tracks[0]) - 1.0)


def news_rows(
    moved: Moved,
    distances_km: Sequence[int] = (60, 120, 300),
    *,
    targets: int = TARGETS,
    reports: int = REPORTS,
    sequences: int = SEQUENCES,
) -> Iterator[tuple[str, Figure]]:
    """Yield all figures on news, each with its section.

    Parameters
    ----------
    moved
        Moves particles at constant speed, without SUMO.
    """
    for u0_km in distances_km:
        flight, section = Flight(u0_km, moved, targets), f"{u0_km} km, news"
        yield from ((section, row) for row in silence_rows(flight))
        yield from ((section, row) for row in report_rows(flight, REPORT_AIMS[u0_km], reports))
        if u0_km in LATE_AIMS:
            share = ALARMS.lasts_s / ALARMS.every_s
            slower = f"uav.speed_mps={100.0 / (1.0 + share)}"
            slowed = Flight(u0_km, moved, 1000, slower)
            rows = alarm_rows(flight, slowed, LATE_AIMS[u0_km], sequences)
            yield from ((section, row) for row in rows)


def _ratio(gained: Sequence[float], whole: Sequence[float]) -> tuple[float, float, float]:
    """Return a ratio of two means and its 95 % interval, percent; linearised about it."""
    share = sum(gained) / sum(whole)
    apart = [one - share * all_of for one, all_of in zip(gained, whole, strict=True)]
    low, high = student_interval(apart)
    mean = sum(whole) / len(whole)
    return 100.0 * share, 100.0 * (share + low / mean), 100.0 * (share + high / mean)
