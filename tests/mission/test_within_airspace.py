"""Scenarios with an airspace: every method keeps to it, and its faults are told."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.errors import InputError, NotApplicableError, ScenarioError
from planner.mission.areas import airspace_of
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.planning import make_plan, problem_of
from planner.mission.recorder import Recorder
from planner.mission.trial import try_method
from planner.network.georeference import lonlat
from planner.scenario.draft import read_scenario
from planner.scenario.sections import AirspaceSection
from planner.search.methods import METHODS, method_named
from support.command_line import Commands

BOX = "airspace.no_fly=[[6000,-1000],[9000,-1000],[9000,1000],[6000,1000]]"
FENCE = "airspace.fence=[[-31000,-7000],[16000,-7000],[16000,9000],[-31000,9000]]"
SMALL = ("search.particles=40", "search.work=2000")
CLOSED = {"BC", "BD", "DG"}  # of figure3, by these two


@cache
def opened(*overrides: str) -> OpenScenario:
    return open_scenario("figure3", overrides=(*SMALL, *overrides))


def faults(*overrides: str) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        open_scenario("figure3", overrides=overrides)
    return [str(fault) for fault in caught.value.faults]


@pytest.mark.parametrize("name", [method.name for method in METHODS])
@pytest.mark.parametrize("home", [False, True])
def test_every_method_keeps_to_the_airspace(name: str, home: bool) -> None:
    more = ("uav.return_to=start", "uav.max_flight_time_s=2000") if home else ()
    scenario = opened(BOX, FENCE, *more)
    assert scenario.airspace is not None
    recorder = Recorder(scenario, 1)
    futures = recorder.planning().futures
    try:
        plan = make_plan(method_named(name), scenario, recorder, futures).plan
    except NotApplicableError as error:
        pytest.skip(str(error))
    (track,) = plan.tracks
    scenario.airspace.refuse(track)
    names = [scenario.network.road_ids[leg.road] for leg in plan.legs[0]]
    assert not CLOSED & {*names}
    for leg in plan.legs[0]:
        along = scenario.network.shape(leg.road)[:: 1 - 2 * (leg.leg % 2)]
        assert np.allclose(track.xy(np.array([leg.start_s, leg.end_s])), along[[0, -1]])
    if home:
        assert plan.end_s <= 2000.0 + 1e-6
        assert np.allclose([track.x_m[-1], track.y_m[-1]], scenario.starts_m[0])


def test_a_real_aircraft_comes_home_around_the_areas() -> None:
    real = ("acceleration_mps2=2", "corner_m=10", "climb_mps=5", "descend_mps=5")
    overrides = [f"uav.{one}" for one in (*real, "max_flight_time_s=1300", "return_to=start")]
    between = "airspace.no_fly=[[-20000,-1000],[-10000,-1000],[-10000,1500],[-20000,1500]]"
    scenario = opened(between, *overrides)
    assert scenario.airspace is not None
    recorder = Recorder(scenario, 1)
    plan = make_plan(method_named("rate"), scenario, recorder, recorder.planning().futures).plan
    (track,) = plan.tracks
    scenario.airspace.refuse(track)
    assert track.x_m.max() > 0.0  # beyond the area
    assert plan.end_s <= 1300.0 * 0.8 + 1e-6
    assert np.allclose([track.x_m[-1], track.y_m[-1]], scenario.starts_m[0])


def test_figures_are_those_of_the_flight_around() -> None:
    scenario = opened(BOX)
    recorder = Recorder(scenario, 1)
    futures = recorder.planning().futures
    trial = try_method(method_named("rate"), recorder, futures, recorder.evaluation(40).futures)
    problem = problem_of(scenario, futures)
    again = evaluate(trial.plan.tracks, futures, problem.sensor, problem.objective)
    assert trial.planned.expected_detection_time_s == again.expected_detection_time_s


def test_roads_outside_are_not_searched() -> None:
    scenario = opened("airspace.within=[[-1,-5000],[10001,-5000],[10001,5000],[-1,5000]]")
    recorder = Recorder(scenario, 1)
    plan = make_plan(method_named("random"), scenario, recorder, recorder.planning().futures).plan
    assert {scenario.network.road_ids[leg.road] for leg in plan.legs[0]} == {"AB", "BC", "BD"}


def test_free_flights_stay_within() -> None:
    within = "airspace.within=[[-1,-5000],[10001,-5000],[10001,5000],[-1,5000]]"
    scenario = opened(within, "search.work=500")
    recorder = Recorder(scenario, 1)
    futures = recorder.planning().futures
    (track,) = make_plan(method_named("anneal-waypoints"), scenario, recorder, futures).plan.tracks
    place = np.stack([track.x_m, track.y_m], axis=1)[1:]
    assert np.all((place >= [-1.0, -5000.0]) & (place <= [10_001.0, 5000.0]))


def test_faults_of_the_airspace() -> None:
    assert faults("airspace.no_fly=[[-31000,-1],[-29000,-1],[-30000,500]]") == [
        "uav.start: lies in a no-fly area or at its edge; start elsewhere, or correct [airspace]"
    ]
    assert faults("airspace.fence=[[0,0],[1,0],[1,1]]")[0].startswith("uav.start: lies outside the")
    home = ("uav.return_to={x_m=7500,y_m=0}", BOX)
    assert faults(*home)[0].startswith("uav.return_to: lies in a no-fly area or at its edge; land")
    ring = "[[[-50000,-50000],[50000,-50000],[50000,50000],[-50000,50000]]]"
    assert faults("airspace.within=[[0,20000],[9,20000],[9,20009]]") == [
        "airspace: leaves no road to be searched; correct its areas"
    ]
    assert faults("airspace.within=5")[0].startswith("airspace.within: should be the path of a Geo")
    assert faults("airspace.no_fly=no.geojson")[0].startswith("airspace.no_fly: there is no file ")
    assert faults("airspace.no_fly=scenario.toml")[0].startswith(
        "airspace.no_fly: scenario.toml: GeoJSON has degrees, and the net has no projection; give"
    )
    assert faults("airspace.no_flying=[]")[0].endswith("did you mean no_fly?")
    assert faults("airspace.fence=[[0,0],[9,9],[9,0],[0,9]]", "search.depth=0")[1].startswith(
        "airspace.fence: a polygon crosses itself"
    )
    assert open_scenario("figure3", overrides=[f"airspace.within={ring}"]).airspace is not None


def test_a_landing_that_is_cut_off() -> None:
    moat = "[[-100,-9000],[100,-9000],[100,9000],[-100,9000]]"
    fence = "[[-31000,-8000],[16000,-8000],[16000,8000],[-31000,8000]]"
    told = faults(
        "uav.return_to={x_m=9000,y_m=3000}", f"airspace.no_fly={moat}", f"airspace.fence={fence}"
    )
    assert told[0].startswith("uav.return_to: cannot be flown to within [airspace]; land")


def test_nothing_is_said_of_no_airspace() -> None:
    assert opened().airspace is None
    assert "airspace" not in read_scenario("figure3").as_dict()
    kept = read_scenario("figure3", overrides=["airspace.fence=[[0,0],[1,0],[1,1]]"])
    assert kept.as_dict()["airspace"] == {"fence": [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]]}


def test_a_file_is_named_once(tmp_path: Path, berlin: OpenScenario) -> None:
    (tmp_path / "park.geojson").write_text("")
    section = AirspaceSection(no_fly="park.geojson")
    _, (fault,) = airspace_of(section, tmp_path, berlin.network)
    assert str(fault).startswith("airspace.no_fly: park.geojson: is not JSON")


def test_geojson_beside_the_scenario(tmp_path: Path, berlin: OpenScenario) -> None:
    corners = np.array([[700.0, 700.0], [900.0, 700.0], [900.0, 1500.0], [700.0, 700.0]])
    ring = lonlat(berlin.network, corners).tolist()
    (tmp_path / "park.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    (tmp_path / "scenario.toml").write_text(
        '[network]\nnet = "sumo:tools/game/DRT/osm.net.xml"\n[target]\nstart = "anywhere"\n'
        '[uav]\nstart = { x_m = 600, y_m = 700 }\n[airspace]\nno_fly = "park.geojson"\n'
    )
    airspace = open_scenario(tmp_path).airspace
    assert airspace is not None
    assert airspace.no_fly.bounds == pytest.approx((700.0, 700.0, 900.0, 1500.0), abs=0.01)
    (tmp_path / "park.geojson").unlink()
    with pytest.raises(InputError, match=r"no_fly: there is no file .*park\.geojson"):
        open_scenario(tmp_path)


def test_the_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = Commands(capsys)
    small = ("--set", "search.particles=40", "--targets", "40", "--method", "rate")
    assert run("plan", "figure3", *small, "--set", BOX, "-o", tmp_path / "run").code == 0
    assert run("fly", tmp_path / "run", "--targets", "5").code == 0
    told = run("certify", tmp_path / "run", "--work", "5")
    assert told.code == 2
    assert "no bound yet on flights within [airspace]" in told.err
    assert run("plan", tmp_path / "run" / "run.json", *small, "-o", tmp_path / "again").code == 0
    plans = [(tmp_path / name / "plan.json").read_bytes() for name in ("run", "again")]
    assert plans[0] == plans[1]
