"""A flight planned anew from where the UAV is, with all that has come in since.

Before the find a flight learns nothing but "not seen yet", which its plan has reckoned with from
the start: without news, and flown as planned, the best plan stays the best. So the plan there is
goes on unless a new one is better on the same particles.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.clock import clock
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.paired import Ahead, ahead
from planner.errors import InputError, NotApplicableError
from planner.flight.plan import ROUNDING_S, Plan
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.futures.none import NO_TARGETS
from planner.mission.news import refuse_unlikely, search_of
from planner.mission.opening import OpenScenario
from planner.mission.planning import problem_of
from planner.mission.recorder import Recorder
from planner.mission.trial import Attempt, attempted
from planner.scenario.faults import faults_of
from planner.scenario.news import MOST_NEWS, News, NewsSection, ReportNews
from planner.scenario.uav_values import InAir
from planner.search.anneal_waypoints import waypoints_of
from planner.search.methods import Method
from planner.search.plan import plan_of_legs, plan_of_waypoints
from planner.search.problem import Budget, Problem
from planner.search.sightings import holdout_value


@dataclass(frozen=True)
class Standing:
    """Where a UAV is in the middle of its flight."""

    at_s: float  # now, seconds on the target's clock
    late_s: float = 0.0  # for how long it has stood still until now
    xy_m: tuple[float, float] | None = None  # where it is, metres; None: where its plan has it
    left_s: float | None = None  # how long it can be in the air from now on; None: as planned


@dataclass(frozen=True, eq=False)
class Resumed:
    """A mission from now on."""

    opened: OpenScenario  # where the UAV is, and what is known now
    incumbent: Plan  # what is left of the plan there was
    at_s: float  # from when on
    flown: Track | None = None  # since that plan began; None: it has not taken off


@dataclass(frozen=True, eq=False)
class Replanned:
    """What comes of planning anew."""

    resumed: Resumed
    problem: Problem
    attempt: Attempt  # the better plan of both
    is_kept: bool  # whether that is the one there was
    # how much of the time to come the new plan saves, on particles that had no part in making it
    lead: Ahead
    holdout: Futures | None  # these particles, if there were any


def resumed(
    opened: OpenScenario, plan: Plan, standing: Standing, news: Sequence[News] = ()
) -> Resumed:
    """Return a mission as it goes on from where the UAV is.

    What the UAV has flown without finding the target is news like any other's search.

    Parameters
    ----------
    opened
        The scenario that the plan is for.
    news
        All of the target that has come in, with what was known when the plan was made.

    Raises
    ------
    InputError
        If the flight is over, or the plan is for several UAVs.
    """
    refuse_fleet(plan)
    (track,) = plan.tracks
    problem = problem_of(opened, NO_TARGETS)
    climbs_s = 0.0 if problem.uav.aircraft is None else problem.uav.aircraft.law.climb_s
    begins_s, up_s = float(track.time_s[0]), float(track.time_s[0]) + climbs_s
    if standing.at_s <= begins_s:
        known = _with(opened, opened.scenario.uav.in_air, news)
        return Resumed(known, plan, standing.at_s)
    if standing.at_s >= track.end_s and standing.xy_m is None:
        raise InputError(
            f"the flight is over at {clock(track.end_s)}; give an earlier time, or where the UAV is"
        )
    at_s = max(standing.at_s, up_s)
    paused_s = max(up_s, at_s - standing.late_s)
    flown = track.until(paused_s)
    if paused_s < at_s:
        flown = flown.then(hovering(flown, at_s))
    x_m, y_m = flown.xy(at_s).tolist() if standing.xy_m is None else standing.xy_m
    left_s = standing.left_s
    if left_s is None and np.isfinite(problem.uav.landing_s):
        left_s = max(1.0, problem.uav.landing_s - (standing.at_s - at_s) - at_s)
    there = _in_air({"place": {"x_m": x_m, "y_m": y_m}, "at_s": at_s, "left_s": left_s})
    own = search_of(flown, problem.sensor, problem.uav.speed_mps)
    after = _with(opened, there, (*news, own))
    rest = _rest(problem_of(after, NO_TARGETS), plan, paused_s, standing.xy_m is not None)
    return Resumed(after, rest, at_s, flown)


def refuse_long_delay(opened: OpenScenario, plan: Plan, standing: Standing) -> None:
    """Do nothing if a UAV has been at its height for as long as it is said to have stood still.

    Raises
    ------
    InputError
        If it has not: so long a delay cannot be all of this flight's.
    """
    aircraft = problem_of(opened, NO_TARGETS).uav.aircraft
    up_s = plan.take_off_s + (0.0 if aircraft is None else aircraft.law.climb_s)
    most_s = max(0.0, standing.at_s - up_s)
    if standing.late_s > most_s:
        raise InputError(
            f"--delay {standing.late_s:g}: at {clock(standing.at_s)} the UAV has been at its "
            f"height for {most_s:g} s; give at most that"
        )


def refuse_fleet(plan: Plan) -> None:
    """Do nothing if a plan is for one UAV.

    Raises
    ------
    InputError
        If it is for several.
    """
    if len(plan.tracks) != 1:
        raise InputError("plan.json: is for several UAVs; plan each one anew by itself")


def replanned(
    mission: Resumed,
    recorder: Recorder,
    method: Method,
    planning: Futures,
    *,
    holdout: Futures | None = None,
    budget: Budget | None = None,
) -> Replanned:
    """Return the better of a new plan and what is left of the old one.

    Parameters
    ----------
    recorder, planning, holdout
        Of the scenario as it is now.
    """
    made = attempted(method, recorder, planning, holdout=holdout, budget=budget)
    problem = problem_of(mission.opened, planning, method=method)
    judged = problem.replace(holdout=holdout)
    judges = planning if holdout is None else holdout
    new, old = (
        evaluate(one.tracks, judges, problem.sensor, problem.objective)
        for one in (made.plan, mission.incumbent)
    )
    is_kept = holdout_value(judged, made.plan) <= holdout_value(judged, mission.incumbent)
    if is_kept:
        kept = replace(made, result=replace(made.result, plan=mission.incumbent))
        made = replace(kept, planned=kept.evaluated_on(planning))
    return Replanned(mission, problem, made, is_kept, sooner(new, old, mission.at_s), holdout)


def with_news(news: Sequence[News], more: Sequence[News], *, same_source: bool) -> tuple[News, ...]:
    """Return news with more of it.

    Parameters
    ----------
    same_source
        Whether a report among them is from who gave the last one, which it replaces.
    """
    kept = list(news)
    reports = [k for k, one in enumerate(kept) if isinstance(one, ReportNews)]
    if same_source and any(isinstance(one, ReportNews) for one in more):
        if not reports:
            raise InputError("--same-source: there is no earlier report; leave it out")
        del kept[reports[-1]]
    if len(kept) + len(more) > MOST_NEWS:
        raise InputError(
            f"news: {len(kept) + len(more):,} pieces are more than {MOST_NEWS}; leave out those "
            "that say least"
        )
    return (*kept, *more)


def refuse_unlikely_reports(opened: OpenScenario, futures: Futures, news: Sequence[News]) -> None:
    """Do nothing if all reports may be true by what is believed otherwise.

    Parameters
    ----------
    futures
        Particles of the belief before any news.

    Raises
    ------
    InputError
        If one is not.
    """
    speed_mps = opened.scenario.uav.speed_mps
    for one in news:
        if isinstance(one, ReportNews):
            refuse_unlikely(futures, one, opened.news, opened.network, speed_mps=speed_mps)


def without_news(opened: OpenScenario) -> OpenScenario:
    """Return a scenario as if nothing had been heard."""
    return replace(opened, scenario=replace(opened.scenario, news=NewsSection()))


def sooner(new: Evaluation, old: Evaluation, at_s: float) -> Ahead:
    """Return how far one plan is ahead of another, of the time that is still to come."""
    to_come_s = old.expected_detection_time_s - old.objective.sought * at_s
    lead, left_s = ahead(new, old), to_come_s
    if new.objective.by_s is not None or left_s <= 0.0:
        return lead
    return Ahead(*(old.expected_detection_time_s / left_s * one for one in lead))


def hovering(flown: Track, until_s: float) -> Track:
    """Return a flight that stands still where another one has ended, until a time."""
    x_m, y_m = float(flown.x_m[-1]), float(flown.y_m[-1])
    time_s = np.array([flown.end_s, until_s])
    return Track(time_s, np.full(2, x_m), np.full(2, y_m), time_s[None, :])


def _in_air(table: Mapping[str, Any]) -> InAir:
    """Return where a UAV is, or refuse a place, time or battery that no scenario may hold."""
    there, errors = InAir.checked(table)
    if there is None:
        raise InputError(str(next(iter(faults_of("uav.in_air", InAir, errors)))))
    return there


def _with(opened: OpenScenario, there: InAir | None, news: Sequence[News]) -> OpenScenario:
    scenario = opened.scenario
    uav = scenario.uav.model_copy(update={"in_air": there})
    section = NewsSection(heard=tuple(news) or None)
    return replace(opened, scenario=replace(scenario, uav=uav, news=section))


def _rest(problem: Problem, plan: Plan, paused_s: float, is_elsewhere: bool) -> Plan:
    """Return what is left of a plan, as far as the battery lasts."""
    uav = problem.uav
    kept_s = 0.0 if uav.aircraft is None else uav.aircraft.reserve_s
    rest = plan.after(paused_s).later(uav.take_off_s - paused_s)
    if not is_elsewhere and rest.end_s <= uav.landing_s - kept_s + ROUNDING_S:
        return rest
    try:
        return plan_of_waypoints(problem, plan.method, waypoints_of(problem, rest))
    except NotApplicableError:  # the sensor only looks along roads
        return plan_of_legs(problem, plan.method, [leg.leg for leg in rest.legs[0]])
