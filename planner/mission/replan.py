"""Flights planned anew from where the UAVs are, with all that has come in since.

Before the find a flight learns nothing but "not seen yet", which its plan has reckoned with from
the start: without news, and flown as planned, the best plan stays the best. So the plan there is
goes on unless a new one is better on the same particles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.paired import Ahead, ahead
from planner.errors import InputError
from planner.flight.separation import meetings_of
from planner.futures.futures import Futures
from planner.mission.news import refuse_unlikely
from planner.mission.opening import OpenScenario
from planner.mission.planning import problem_of
from planner.mission.recorder import Recorder
from planner.mission.resume import Resumed
from planner.mission.trial import Attempt, attempted
from planner.scenario.news import MOST_NEWS, News, NewsSection, ReportNews
from planner.search.methods import Method
from planner.search.problem import Budget, Problem
from planner.search.sightings import holdout_value


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

    A new plan whose flights may come too near each other is none.

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
    is_kept = is_kept or any(meetings_of(made.plan, problem.uavs))
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
