"""Two targets of whom the same is believed: a find of one tells nothing of how to go on."""

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.several import first_and_last
from planner.errors import InputError
from planner.mission.news import given
from planner.mission.online import Remembering
from planner.mission.opening import open_scenario
from planner.mission.standing import Standing
from planner.paper.in_flight import Flight
from planner.scenario.news import FoundNews, NothingNews, ReportNews
from planner.scenario.uav_values import PointStart

ONE = "{start={AB=1.0},distance_m={constant=0},speed_mps={list=[8,14,20,26]}}"
ALIKE = f"target=[{ONE},{ONE}]"


@pytest.fixture(scope="module")
def flight() -> Flight:
    recorder = Remembering(open_scenario("figure3", overrides=[ALIKE]), 1)
    return Flight.planned(recorder, recorder.planning().futures, "exact")


@pytest.mark.parametrize("found_s", [400.0, 450.0])
def test_the_plan_there_was_goes_on_after_a_find(flight: Flight, found_s: float) -> None:
    mission = flight.mission()
    going_on = mission.heard(Standing(found_s), [FoundNews(kind="found", target=0)])
    found = mission.planned(going_on)
    assert going_on.opened.sought == found.problem.objective.sought == 1
    assert set(found.problem.futures.target.tolist()) == {1}
    mission.goes_on(going_on, found.attempt.plan)
    other = flight.targets.take(flight.targets.target == 1)
    expected_s = [flight.expected_s(one, other) for one in (flight.plan.tracks[0], mission.track)]
    assert expected_s[1] == pytest.approx(expected_s[0], rel=1e-3)


def test_both_are_found_alike(flight: Flight) -> None:
    sensor, objective = flight.problem.sensor, flight.problem.objective
    found = evaluate(flight.plan.tracks, flight.targets, sensor, objective)
    times_s = [one.expected_detection_time_s for one in found.each.values()]
    assert times_s[0] == pytest.approx(times_s[1])
    first, last = first_and_last(found)
    assert first.expected_s < times_s[0] < last.expected_s


def test_a_report_is_of_one_of_them(flight: Flight) -> None:
    opened, futures = flight.recorder.opened, flight.targets
    place_m = futures.positions(300.0)[0].tolist()
    report = ReportNews(
        kind="report",
        place=PointStart(x_m=place_m[0], y_m=place_m[1]),
        at_s=300.0,
        heard_s=300.0,
        sure=0.7,
        radius_m=500.0,
        target=1,
    )
    after = given(futures, [report], opened.network, speed_mps=100.0)
    mine = futures.target == 1
    assert after.weight[~mine].tolist() == futures.weight[~mine].tolist()
    assert not np.allclose(after.weight[mine], futures.weight[mine])
    assert after.weight[mine].sum() == pytest.approx(1.0)


def test_who_is_found_has_been_seen_after_all(flight: Flight) -> None:
    x_m, y_m = flight.targets.positions(0.0)[0].tolist()
    whole = {"x_m": x_m, "y_m": y_m}
    nobody = NothingNews(
        kind="nothing", place=PointStart(**whole), from_s=0.0, to_s=1.0, sure=1.0, radius_m=1e5
    )
    network, alone = flight.problem.network, flight.targets.take(flight.targets.target == 0)
    with pytest.raises(InputError, match="nothing that is believed of the target agrees"):
        given(alone, [nobody], network, speed_mps=100.0)
    found = FoundNews(kind="found", target=0)
    with pytest.raises(InputError, match="every target that it is found"):
        given(alone, [nobody, found], network, speed_mps=100.0)
