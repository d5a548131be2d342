"""The rest of a flight: it earns what the whole does, and changes for news alone."""

from typing import Any

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.errors import InputError
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.mission.follow import contact
from planner.mission.online import Mission, Remembering
from planner.mission.opening import open_scenario
from planner.mission.planning import problem_of
from planner.mission.replan import with_news
from planner.mission.resume import resumed
from planner.mission.standing import Standing
from planner.scenario.news import ReportNews
from planner.search.methods import method_named

SMALL = ("search.particles=256", "search.work=4000", "search.sampling=sobol")


@pytest.fixture(scope="module")
def recorder() -> Remembering:
    return Remembering(open_scenario("grid5x5", overrides=SMALL), workers=1)


@pytest.fixture(scope="module")
def plan(recorder: Remembering) -> Plan:
    mission = Mission(recorder, Plan("", (), ()), method_named("beam"))
    return mission.made().plan


@pytest.fixture
def mission(recorder: Remembering, plan: Plan) -> Mission:
    return Mission(recorder, plan, method_named("beam"))


def expected_s(mission: Mission, track: Track, futures: Any = None) -> float:
    problem = problem_of(mission.opened, mission.recorder.planning().futures)
    targets = problem.futures if futures is None else futures
    found = evaluate((track,), targets, problem.sensor, problem.objective)
    return found.expected_detection_time_s


def report(mission: Mission, sure: float = 0.7) -> ReportNews:
    """What somebody says who has seen the target that the plan finds last."""
    futures = mission.recorder.planning().futures
    problem = problem_of(mission.opened, futures)
    found = evaluate(mission.plan.tracks, futures, problem.sensor, problem.objective)
    x_m, y_m = futures.positions(650.0)[int(np.argmax(found.time_s))].tolist()
    said = {"at_s": 650.0, "heard_s": 700.0, "sure": sure, "sd_m": 1000.0}
    where = {"x_m": x_m, "y_m": y_m}
    return ReportNews.model_validate({"kind": "report", "place": where, **said})


@pytest.mark.parametrize("at_s", [700.0, 905.25, 1000.0])
def test_a_flight_cut_anywhere_is_worth_the_same(mission: Mission, at_s: float) -> None:
    """Of all: those found by then cost what they cost, all others what the rest makes of them."""
    (track,) = mission.plan.tracks
    whole = expected_s(mission, track)
    going_on = mission.heard(Standing(at_s))
    before = mission.recorder.planning().futures
    problem = problem_of(mission.opened, before)
    seen_at = evaluate((track,), before, problem.sensor, problem.objective).seen_at
    early = seen_at <= at_s
    after = mission.recorder.now(going_on.opened).planning().futures
    (rest,) = going_on.incumbent.tracks
    later_s = evaluate((rest,), after, problem.sensor, problem.objective)
    share = float(before.weight[~early].sum())
    parts_s = float(before.weight[early] @ seen_at[early])
    assert parts_s + share * later_s.expected_detection_time_s == pytest.approx(whole, rel=1e-9)
    assert expected_s(mission, going_on.flown[0].then(rest)) == pytest.approx(whole, rel=1e-9)


def test_without_news_little_changes_and_one_report_changes_the_plan(
    mission: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner.mission.recorder.ENOUGH", 5)  # no more is driven
    everybody = mission.recorder.planning().futures
    before_s = expected_s(mission, mission.track, everybody)
    going_on = mission.heard(Standing(650.0))
    silent = mission.planned(going_on)
    news = report(mission)
    mission.goes_on(going_on, silent.attempt.plan)
    assert expected_s(mission, mission.track, everybody) <= 1.003 * before_s
    told = mission.planned(mission.heard(Standing(700.0), [news]))
    assert not told.is_kept
    assert told.lead.share > 0.02


def test_the_plan_there_was_goes_on_unless_the_new_one_is_better(mission: Mission) -> None:
    going_on = mission.heard(Standing(1000.0))
    worse = mission.planned(going_on, method=method_named("wait"))
    assert worse.is_kept
    assert worse.attempt.plan is going_on.incumbent


def test_a_delay_of_nothing_changes_nothing(mission: Mission) -> None:
    one, other = (mission.heard(Standing(1000.0, late_s=late_s)) for late_s in (0.0, 120.0))
    (track,) = mission.plan.tracks
    again = mission.heard(Standing(1000.0, late_s=0.0))
    assert np.array_equal(one.incumbent.tracks[0].time_s, again.incumbent.tracks[0].time_s)
    assert one.incumbent.tracks[0].xy(1500.0) == pytest.approx(track.xy(1500.0))
    assert other.incumbent.tracks[0].xy(1620.0) == pytest.approx(track.xy(1620.0 - 120.0))
    assert other.incumbent.tracks[0].xy(1000.0) == pytest.approx(track.xy(880.0))
    assert other.flown[0].xy(950.0) == pytest.approx(track.xy(880.0))


def test_the_uav_flies_on_from_where_it_is_and_comes_home_in_time() -> None:
    overrides = (*SMALL, "uav.max_flight_time_s=4000", 'uav.return_to="start"')
    recorder = Remembering(open_scenario("grid5x5", overrides=overrides), workers=1)
    mission = Mission(recorder, Plan("", (), ()), method_named("rate"))
    mission.plan = mission.made().plan
    here = (9000.0, -9000.0)
    going_on = mission.heard(Standing(1200.0, xy_m=here, left_s=1500.0))
    (rest,) = going_on.incumbent.tracks
    assert (rest.x_m[0], rest.y_m[0], rest.time_s[0]) == (*here, 1200.0)
    assert rest.end_s <= 2700.0 + 1e-6
    home = mission.opened.landings_m[0]
    assert (rest.x_m[-1], rest.y_m[-1]) == pytest.approx(home)
    new = mission.planned(going_on).attempt.plan.tracks[0]
    assert new.end_s <= 2700.0 + 1e-6
    assert (new.x_m[-1], new.y_m[-1]) == pytest.approx(home)


def test_before_take_off_only_the_belief_changes(mission: Mission, plan: Plan) -> None:
    early = ReportNews.model_validate(
        {**report(mission).model_dump(), "at_s": 0.0, "heard_s": 0.0, "sd_m": 9e4}
    )
    going_on = resumed(mission.opened, plan, Standing(-1.0), [early])
    assert going_on.incumbent is plan
    assert going_on.opened.scenario.uav.in_air is None
    assert going_on.opened.news == (early,)


def test_a_flight_that_is_over_is_refused(mission: Mission) -> None:
    with pytest.raises(InputError, match="the flight is over at"):
        mission.heard(Standing(99_999.0))


def test_the_same_source_replaces_its_report(mission: Mission) -> None:
    first, second = report(mission), report(mission, 0.9)
    assert with_news([first], [second], same_source=True) == (second,)
    assert with_news([first], [second], same_source=False) == (first, second)
    with pytest.raises(InputError, match="no earlier report"):
        with_news([], [second], same_source=True)


def test_contact_is_what_is_left_of_the_time_to_find_it_again(mission: Mission) -> None:
    problem = problem_of(mission.opened, mission.recorder.planning().futures)
    found = evaluate(mission.plan.tracks, problem.futures, problem.sensor, problem.objective)
    seconds = found.expected_detection_time_s
    assert contact(found, every_s=seconds) == pytest.approx(0.5)
