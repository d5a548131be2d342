"""Fleets in the middle of a mission: who flies on from where, who is lost, and who joins."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.survival import Searched, survival
from planner.errors import InputError, ScenarioError
from planner.export.flyable import against
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.mission.joined import Joined
from planner.mission.news_values import Setting
from planner.mission.news_words import heard
from planner.mission.online import Mission, Remembering
from planner.mission.opening import open_scenario
from planner.mission.planning import budget_of, problem_of, problems_of
from planner.mission.resume import Resumed
from planner.mission.standing import OfUav, Standing
from planner.search.fleet import fleet
from planner.search.methods import method_named
from planner.search.state import SearchState
from planner.streams import stream

RATE = method_named("rate")
FEW = ("search.particles=40", "search.work=500", "sensor.detects=0.5", "search.horizon_s=2000")
THREE = (
    "uav=[{start={x_m=-9000,y_m=0}},{start={x_m=20000,y_m=0},speed_mps=80},"
    "{start={x_m=0,y_m=9000},take_off_s=300}]"
)
RELAY = (
    'uav=[{start={x_m=-2000,y_m=0},return_to="start",max_flight_time_s=300,sorties=3,swap_s=60},'
    "{start={x_m=20000,y_m=0},speed_mps=80}]"
)
AT_S = 250.0  # two of the three fly, one is still on the ground


def flying(fleet_said: str) -> Mission:
    recorder = Remembering(open_scenario("figure3", overrides=(*FEW, fleet_said)), workers=1)
    mission = Mission(recorder, Plan("", (), ()), RATE)
    mission.plan = mission.made().plan
    return mission


@pytest.fixture(scope="module", autouse=True)
def _few_suffice() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("planner.mission.recorder.ENOUGH", 5)  # no more is driven
        yield


@pytest.fixture(scope="module")
def three() -> Mission:
    return flying(THREE)


@pytest.fixture(scope="module")
def relay() -> Mission:
    return flying(RELAY)


def again(mission: Mission) -> Mission:
    """Return a mission of its own, which stands as another one does."""
    return Mission(mission.recorder, mission.plan, mission.method)


def expected_s(mission: Mission, going_on: Resumed) -> float:
    """Return what a whole mission is worth by what was flown, and by what is left of it."""
    before = mission.recorder.planning().futures
    after = mission.recorder.now(going_on.opened).planning().futures
    sensor, objective = mission_problem(mission).sensor, mission_problem(mission).objective
    flown, at_s = [*going_on.flown.values()], going_on.at_s
    past = evaluate(flown, before, sensor, Objective(at_s))
    rest = evaluate(going_on.incumbent.tracks, after, sensor, objective)
    left = 1.0 - past.detection_probability
    return past.expected_detection_time_s + left * (rest.expected_detection_time_s - at_s)


def mine(plan: Plan, uav: int = 0) -> list[Track]:
    """Return the flights of one UAV."""
    return [track for track, one in zip(plan.tracks, plan.flights, strict=True) if one.uav == uav]


def mission_problem(mission: Mission) -> Any:
    return problem_of(mission.opened, mission.recorder.planning().futures)


def whole_s(mission: Mission) -> float:
    problem = mission_problem(mission)
    found = evaluate(mission.tracks, problem.futures, problem.sensor, problem.objective)
    return found.expected_detection_time_s


@pytest.mark.parametrize("at_s", [40.0, AT_S, 700.25])
def test_the_past_and_the_rest_of_a_fleet_add_up(three: Mission, at_s: float) -> None:
    going_on = three.heard(Standing(at_s))
    assert sorted(going_on.flown) == [uav for uav in range(3) if at_s > 300.0 or uav < 2]
    assert expected_s(three, going_on) == pytest.approx(whole_s(three), rel=1e-9)
    later = again(three)
    later.goes_on(going_on, going_on.incumbent)
    assert len(later.tracks) == 3
    problem = mission_problem(three)
    found = evaluate(later.tracks, problem.futures, problem.sensor, problem.objective)
    assert found.expected_detection_time_s == pytest.approx(whole_s(three), rel=1e-9)


def test_without_news_the_plan_there_was_goes_on(three: Mission) -> None:
    going_on = three.heard(Standing(AT_S))
    found = three.planned(going_on, method=method_named("wait"))  # which is no better
    assert found.is_kept
    assert found.attempt.plan is going_on.incumbent
    assert [one.uav for one in found.attempt.plan.flights] == [0, 1, 2]
    found = three.planned(going_on)
    assert found.is_kept or found.lead.share > 0.0


def test_who_is_left_is_planned_with_what_the_lost_one_has_seen(three: Mission) -> None:
    """The same as planning for two UAVs alone, where three have missed particles before."""
    lost = Standing(AT_S, uavs={0: OfUav(lost_s=AT_S - 50.0)})
    going_on = three.heard(lost)
    assert going_on.opened.scenario.uav.sorties == 0
    assert going_on.flown[0].end_s == AT_S - 50.0
    assert [one.uav for one in going_on.incumbent.flights] == [1, 2]
    later = Mission(three.recorder.now(going_on.opened), three.plan, RATE)
    made = later.made().plan
    everybody = three.recorder.planning().futures
    sensor = mission_problem(three).sensor
    flown = [Searched(track, sensor) for track in going_on.flown.values()]
    miss = survival(everybody, flown).at(AT_S)
    nobody = np.full(len(everybody), np.inf)
    (_, second, third) = three.plan.tracks
    problems = problems_of(three.opened, everybody)[1:]
    starts = [(AT_S, *second.xy(AT_S).tolist()), (300.0, *third.xy(300.0).tolist())]
    twins = [
        problem.replace(uav=problem.uav.resumed(*start), start=SearchState(*start, miss, nobody))
        for problem, start in zip(problems, starts, strict=True)
    ]
    rng = stream(three.opened.scenario.search.seed, "planner", "rate")
    budget = budget_of(three.opened)
    twin = fleet(twins, RATE.load(), budget=budget, rng=rng, together=False).plan
    assert [[leg.leg for leg in legs] for legs in made.legs] == [
        [leg.leg for leg in legs] for legs in twin.legs
    ]
    for one, other in zip(made.tracks, twin.tracks, strict=True):
        assert np.allclose(one.time_s, other.time_s)


def test_uavs_keep_their_numbers_when_one_is_lost(three: Mission) -> None:
    later = again(three)
    going_on = later.heard(Standing(AT_S, uavs={1: OfUav(lost_s=AT_S)}))
    later.goes_on(going_on, later.planned(going_on).attempt.plan)
    assert later.plan.names == ("UAV 1", "UAV 3")
    assert len(later.tracks) == 3
    with pytest.raises(InputError, match="UAV 2 flies no more"):
        later.heard(Standing(AT_S + 50.0, uavs={1: OfUav(late_s=5.0)}))
    going_on = later.heard(Standing(AT_S + 100.0, uavs={2: OfUav(lost_s=AT_S + 50.0)}))
    assert 2 not in going_on.flown  # lost on the ground
    alone = later.planned(going_on)
    assert [one.uav for one in alone.attempt.plan.flights] == [0]


def test_one_that_joins_takes_part_from_when_it_is_ready(three: Mission) -> None:
    who = Joined(AT_S + 60.0, {"start": {"x_m": 16_000.0, "y_m": 0.0}, "max_flight_time_s": 900.0})
    going_on = three.heard(Standing(AT_S, joined=(who,)))
    joined = going_on.opened.scenario.uavs[3]
    first = going_on.opened.scenario.uav
    assert joined.speed_mps == first.speed_mps  # which it does not say
    heights = [uav.altitude_m for uav in going_on.opened.scenario.uavs]
    assert min(abs(a - b) for k, a in enumerate(heights) for b in heights[:k]) >= 15.0
    found = three.planned(going_on)
    assert not found.is_kept
    assert found.lead.share > 0.0
    (track,) = mine(found.attempt.plan, 3)
    assert (track.time_s[0], track.x_m[0], track.y_m[0]) == (AT_S + 60.0, 16_000.0, 0.0)
    assert track.end_s <= AT_S + 960.0 + 1e-6


def test_a_delay_and_a_place_are_those_of_the_uav_that_is_named(three: Mission) -> None:
    here = (5_000.0, 5_000.0)
    said = {0: OfUav(late_s=20.0), 1: OfUav(xy_m=here, left_s=400.0)}
    going_on = three.heard(Standing(AT_S, uavs=said))
    first, second, third = going_on.incumbent.tracks
    assert first.xy(AT_S + 100.0) == pytest.approx(three.plan.tracks[0].xy(AT_S + 80.0))
    assert (second.x_m[0], second.y_m[0]) == here
    assert second.end_s <= AT_S + 400.0 + 1e-6
    assert np.array_equal(third.time_s, three.plan.tracks[2].time_s)


@pytest.mark.parametrize("where", ["in the first", "between", "in the second"])
def test_sorties_go_on_in_the_air_and_on_the_ground(relay: Mission, where: str) -> None:
    first, second, third = mine(relay.plan)
    between_s = first.end_s + 30.0
    at_s = {"in the first": 100.0, "between": between_s}.get(where, second.end_s - 100.0)
    going_on = relay.heard(Standing(at_s))
    assert expected_s(relay, going_on) == pytest.approx(whole_s(relay), rel=1e-9)
    section = going_on.opened.scenario.uav
    assert section.sorties == (3 if where == "in the first" else 2)
    assert (section.in_air is None) == (where == "between")
    left = mine(going_on.incumbent)
    assert left[-1].end_s == third.end_s
    tracks = mine(Mission(relay.recorder.now(going_on.opened), relay.plan, RATE).made().plan)
    assert len(tracks) == len(left) == section.sorties
    begins_s = (first if where == "in the first" else second).time_s[0]
    assert tracks[0].end_s <= begins_s + 300.0 + 1e-6
    for earlier, later in pairwise(tracks):
        assert later.time_s[0] >= earlier.end_s + 60.0 - 1e-6  # a new battery
        assert (later.x_m[0], later.y_m[0]) == (-2000.0, 0.0)
        assert 150.0 < later.end_s - later.time_s[0] <= 300.0 + 1e-6


def test_flights_that_come_too_near_are_no_new_plan(
    three: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    who = Joined(AT_S, {"start": {"x_m": 16_000.0, "y_m": 0.0}})
    going_on = three.heard(Standing(AT_S, joined=(who,)))
    assert against(going_on.opened, three.planned(going_on).attempt.plan) == []
    scenario = going_on.opened.scenario
    low = tuple(uav.model_copy(update={"altitude_m": 150.0}) for uav in scenario.others)
    opened = replace(going_on.opened, scenario=replace(scenario, others=low))
    (track, *_), (legs, *_) = going_on.incumbent.tracks, going_on.incumbent.legs
    both = Plan("", (track, track), (legs, legs))
    (said,) = against(opened, both)
    assert said.startswith("UAV 1 and UAV 2 may be nearer than 15 m in height and 50 m beside")
    monkeypatch.setattr("planner.mission.replan.meetings_of", lambda *_: iter([(0, 1, AT_S)]))
    assert three.planned(going_on).is_kept


@pytest.mark.parametrize(
    ("standing", "fault"),
    [
        ({"uavs": {3: OfUav(late_s=5.0)}}, "there is no UAV 4; they are UAV 1 to UAV 3"),
        ({"late_s": 5.0}, "uav: is missing; say which of the 3 UAVs"),
        (
            {"uavs": {k: OfUav(lost_s=AT_S) for k in range(3)}},
            "without UAV 1 and UAV 2 and UAV 3 nobody flies any more",
        ),
        ({"uavs": {0: OfUav(xy_m=(0.0, 0.0), left_s=0.0)}}, r"uav\[0\].in_air.left_s"),
        ({"joined": (Joined(0.0, {}),)}, "joined.start: is missing; give"),
        ({"joined": (Joined(9e3, {"start": {"x_m": 0, "y_m": 0}}),)}, "is not after take-off"),
        (
            {"joined": (Joined(0.0, {"start": {"node": "Z"}}),)},
            "joined.start.node: Z is not a node of the network",
        ),
        ({"at_s": 99_999.0}, "the flight is over at"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(
    three: Mission, standing: Mapping[str, Any], fault: str
) -> None:
    with pytest.raises(InputError, match=fault) as told:
        three.heard(Standing(**{"at_s": AT_S, **standing}))
    assert "\n" not in str(told.value)


def test_the_only_uav_cannot_be_lost() -> None:
    mission = flying("uav=[{start={x_m=-9000,y_m=0}}]")
    with pytest.raises(InputError, match="without UAV 1 nobody flies any more"):
        mission.heard(Standing(AT_S, uavs={0: OfUav(lost_s=AT_S)}))


def test_lines_of_news_name_uavs(three: Mission) -> None:
    here = Setting(three.opened.network, None, AT_S)
    lines: list[dict[str, Any]] = [
        {"kind": "delay", "lasts": 20, "uav": 2},
        {"kind": "uav", "uav": "UAV 2", "battery": "9min"},
        {"kind": "delay", "lasts": 10, "uav": "uav 2"},
        {"kind": "lost", "uav": 1, "at": "-1min"},
        {"kind": "joined", "place": {"x_m": 1, "y_m": 2}, "ready": 400, "speed_mps": 30.0},
    ]
    all_of_it = heard(lines[0], here)
    for line in lines[1:]:
        all_of_it = all_of_it.then(heard(line, here))
    standing = all_of_it.standing_at(AT_S)
    assert standing.uavs[1] == OfUav(late_s=30.0, left_s=540.0)
    assert standing.uavs[0] == OfUav(lost_s=AT_S - 60.0)
    (who,) = standing.joined
    assert who == Joined(400.0, {"start": {"x_m": 1.0, "y_m": 2.0}, "speed_mps": 30.0})


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ({"kind": "lost"}, "uav: is missing; say which UAV is lost"),
        ({"kind": "lost", "uav": 0}, "uav: 0 is no UAV; they are counted from 1"),
        ({"kind": "lost", "uav": 1, "at": 900}, "at: 0:15:00 is still to come"),
        ({"kind": "joined"}, "place: should be a place in words"),
        ({"kind": "joined", "place": "A", "in_air": {}}, "in_air: is no key of news of kind"),
    ],
)
def test_a_line_that_means_nothing_is_told(
    three: Mission, line: dict[str, Any], fault: str
) -> None:
    with pytest.raises(InputError, match=fault):
        heard(line, Setting(three.opened.network, None, AT_S))


def test_a_scenario_in_which_nobody_flies_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"uav.sorties: is 0, and no UAV flies"):
        open_scenario("figure3", overrides=(THREE, "uav.sorties=0"))


def test_a_place_of_who_is_on_the_ground_is_refused() -> None:
    early = Standing(-1.0, uavs={1: OfUav(xy_m=(0.0, 0.0))})
    with pytest.raises(InputError, match=r"uav: UAV 2 is on the ground at .*; leave out what is"):
        flying("uav=[{start={x_m=0,y_m=0}},{start={x_m=9,y_m=0}}]").heard(early)
