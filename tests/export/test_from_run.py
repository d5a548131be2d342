"""The flight that is written: timed by the law, home in time, checked."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely

from planner.errors import InputError, ScenarioError
from planner.export.checks import faults, remarks
from planner.export.flight_file import FlightFile
from planner.export.formats import Wanted, rings
from planner.export.from_run import RunFlight, line_alone, placed, run_flight
from planner.flight.airspace import Airspace
from planner.flight.law import timed
from planner.flight.plan import Plan
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.plan_file import StoredPlan
from planner.mission.planning import make_plan, problem_of
from planner.mission.recorder import Recorder
from planner.network.georeference import xy_of_lonlat
from planner.scenario.aircraft_file import with_aircraft
from planner.search.methods import method_named
from planner.search.plan import plan_of_wait
from support.command_line import TOWN

REAL = (
    "uav.speed_mps=15",
    "uav.acceleration_mps2=1.4",
    "uav.corner_m=2",
    "uav.climb_mps=2.5",
    "uav.descend_mps=1.5",
    "uav.max_flight_time_s=1500",
    "uav.return_to=start",
    "sensor.radius_m=60",
    "search.particles=20",
    "search.horizon_s=1800",
)
ORIGIN = (49.6, 6.1)


@cache
def town(*overrides: str) -> tuple[OpenScenario, StoredPlan]:
    opened = open_scenario(TOWN, overrides=(*REAL, *overrides))
    recorder = Recorder(opened, 1)
    futures = recorder.planning().futures
    return opened, stored(opened, make_plan(method_named("rate"), opened, recorder, futures).plan)


def stored(opened: OpenScenario, plan: Plan) -> StoredPlan:
    problem = problem_of(opened, Recorder(opened, 1).planning().futures)
    return StoredPlan(plan, problem.sensor, problem.objective, {})


def written(*overrides: str, tolerance_m: float | None = None) -> RunFlight:
    opened, plan = town(*overrides)
    return run_flight(opened, plan, origin=ORIGIN, tolerance_m=tolerance_m)


def told(run: RunFlight, most: int = 600) -> list[str]:
    return [*faults(run, most_waypoints=most)]


def places(run: RunFlight) -> np.ndarray:
    return np.array([(one.x_m, one.y_m) for one in run.flight.waypoints])


def test_it_is_timed_by_the_law_at_exactly_what_is_written() -> None:
    run = written()
    holds = np.array([one.hold_s for one in run.flight.waypoints])
    times = timed(places(run), holds, run.aircraft.law)
    arrives_s = [one.arrives_s for one in run.flight.waypoints]
    assert np.allclose(arrives_s, 48.0 + times.arrives_s)
    for one in run.flight.waypoints:
        assert np.allclose(run.track.xy(one.arrives_s), (one.x_m, one.y_m), atol=1e-6)
    assert run.track.end_s == pytest.approx(arrives_s[-1] + 120.0 / 1.5, abs=1e-6)
    assert np.all(holds == np.round(holds))


def test_without_tolerance_it_is_the_plan() -> None:
    _, plan = town()
    run = written(tolerance_m=0.0)
    (track,) = plan.plan.tracks
    assert run.track.end_s == pytest.approx(track.end_s, abs=2.0)  # whole seconds of hovering
    assert len(run.flight.waypoints) > len(written(tolerance_m=30.0).flight.waypoints)
    assert run.ended_s is None
    assert run.flight.comes_home
    assert told(run) == []


def test_degrees_are_those_of_the_places() -> None:
    run = written()
    degrees = np.array([(one.lon_deg, one.lat_deg) for one in run.flight.waypoints])
    assert np.allclose(xy_of_lonlat(run.network, degrees), places(run), atol=0.02)
    south = placed(open_scenario(TOWN).network, (-33.9, 18.4))
    assert np.allclose(xy_of_lonlat(south, np.array([18.4, -33.9])), 0.0, atol=1e-6)
    with pytest.raises(InputError, match="--origin"):
        placed(open_scenario(TOWN).network, None)
    with pytest.raises(InputError, match="says where it lies; leave it out"):
        placed(south, ORIGIN)


def test_another_aircraft_is_home_in_time(tmp_path_factory: pytest.TempPathFactory) -> None:
    opened, plan = town()
    file = tmp_path_factory.mktemp("aircraft") / "weak.toml"
    file.write_text('[uav]\nmax_flight_time_s = "0:06:00"\nreserve_s = 30\n')
    run = run_flight(opened, plan, uav=with_aircraft(opened.scenario.uav, file), origin=ORIGIN)
    assert run.lasts_s <= 330.0 + 1.0
    assert run.ended_s is not None
    assert (places(run)[-1] == opened.starts_m[0]).all()
    assert any("before the end of the plan" in line for line in remarks(run))
    assert told(run) == []


WINGS = (
    "uav.hover=false",
    "uav.speed_mps=14",
    "uav.min_speed_mps=12",
    "uav.acceleration_mps2=5",
    "uav.corner_m=20",
)


def test_an_aircraft_that_cannot_hover_flies_its_own_plan_and_no_other() -> None:
    opened, plan = town(*WINGS)
    run = run_flight(opened, plan, origin=ORIGIN)
    assert told(run) == []
    assert not any(one.hold_s for one in run.flight.waypoints)
    assert run.lasts_s <= 1201.0
    opened, plan = town()
    wings = with_aircraft(opened.scenario.uav, Path("fixed-wing"))
    (fault,) = told(run_flight(opened, plan, uav=wings, origin=ORIGIN))
    assert "for an aircraft that cannot hover" in fault
    assert "too tight; plan for it" in fault
    assert " 0 " not in fault


def test_another_aircraft_whose_radio_reaches_less_far(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    opened, plan = town()
    file = tmp_path_factory.mktemp("aircraft") / "weak.toml"
    file.write_text("[uav]\nlink_m = 600\n")
    run = run_flight(opened, plan, uav=with_aircraft(opened.scenario.uav, file), origin=ORIGIN)
    (fault,) = told(run)
    assert "farther from its start than uav.link_m" in fault


def test_waiting_over_the_launch_is_a_waypoint_with_a_hold() -> None:
    opened, _ = town()
    problem = problem_of(opened, Recorder(opened, 1).planning().futures)
    uav = replace(problem.uav, aircraft=None)
    plan = plan_of_wait(problem.replace(uav=uav), "wait", *opened.starts_m[0])
    uav_section = opened.scenario.uav
    run = run_flight(opened, stored(opened, plan), uav=uav_section, origin=ORIGIN)
    first, held, last = run.flight.waypoints
    assert (first.hold_s, last.hold_s) == (0.0, 0.0)
    assert held.hold_s > 900.0
    alone = line_alone(run)
    assert alone is not None
    assert alone.end_s < run.track.end_s - 900.0
    assert last.arrives_s == held.arrives_s + held.hold_s
    assert run.lasts_s <= 1201.0


def test_apps_that_fly_the_line_hold_nowhere() -> None:
    run = written()
    assert line_alone(replace(run, flight=_held(run, 0.0))) is None
    held = _held(run, 90.0)
    alone = line_alone(replace(run, flight=held))
    assert alone is not None
    assert alone.end_s <= run.track.end_s + 1e-6
    places = [alone.xy(alone.time_s[k]) for k in (0, -1)]
    assert np.allclose(places, [(held.waypoints[k].x_m, held.waypoints[k].y_m) for k in (0, -1)])


def _held(run: RunFlight, hold_s: float) -> FlightFile:
    held = [replace(one, hold_s=0.0) for one in run.flight.waypoints]
    held[2] = replace(held[2], hold_s=hold_s)
    return replace(run.flight, waypoints=tuple(held))


def test_the_ideal_aircraft_is_refused_in_one_line() -> None:
    ideal = open_scenario(TOWN, overrides=("search.particles=20",))
    _, plan = town()
    with pytest.raises(InputError, match="--aircraft multicopter") as caught:
        run_flight(ideal, plan, origin=ORIGIN)
    assert "\n" not in str(caught.value)


def test_what_the_ground_is_for_is_refused() -> None:
    opened, plan = town()
    low = opened.scenario.uav.model_copy(update={"altitude_m": 0.0})
    with pytest.raises(InputError, match=r"uav\.altitude_m: is 0"):
        run_flight(opened, plan, uav=low, origin=ORIGIN)


def test_faults_are_told_one_by_one() -> None:
    run = written()
    assert "more than --max-waypoints 3" in told(run, most=3)[0]
    law = replace(run.aircraft.law, speed_mps=25.0)
    fast = replace(run, aircraft=replace(run.aircraft, law=law))
    assert told(fast)[0].startswith("uav.speed_mps: 25 m/s is more than the 20 m/s")
    late = replace(run, battery=replace(run.battery, lasts_s=500.0))
    assert "and the battery lasts for 0:03:20 with its reserve kept" in told(late)[0]
    far = replace(run.flight.waypoints[0], x_m=run.flight.waypoints[1].x_m - 1000.0)
    away = replace(run, flight=replace(run.flight, waypoints=(far, *run.flight.waypoints[1:])))
    assert "from where it takes off, more than 900 m" in told(away)[0]
    first, second, *others = run.flight.waypoints
    near = replace(second, x_m=second.x_m + 1.0)
    close = replace(run.flight, waypoints=(first, second, near, *others))
    assert told(replace(run, flight=close))[0].startswith("1 piece shorter than uav.corner_m, 2 m")
    at_once = replace(run.aircraft.law, climb_mps=math.inf)
    jumps = replace(run, aircraft=replace(run.aircraft, law=at_once))
    assert told(jumps)[0].startswith(
        "uav.climb_mps: is not given, and no aircraft is at its height"
    )


def test_the_airspace_is_checked_between_waypoints_too() -> None:
    run = written()
    middle = places(run)[:2].mean(axis=0)
    over = replace(run, airspace=Airspace(no_fly=shapely.Point(middle).buffer(3.0)))
    assert told(over) == ["the flight leads through a no-fly area of [airspace]; plan again"]
    inside = replace(run, airspace=Airspace(fence=shapely.Point(places(run)[0]).buffer(50.0)))
    assert told(inside) == ["the flight leaves the fence of [airspace]; plan again"]


def test_simplified_it_keeps_to_the_airspace() -> None:
    around = "airspace.no_fly=[[-300,500],[-30,380],[-30,420],[-250,700]]"
    for tolerance_m in (0.0, 100.0, 200.0):
        run = written(around, "uav.max_flight_time_s=6000", tolerance_m=tolerance_m)
        assert told(run) == []
    assert told(written(around)) == []  # home by its battery, around the area


def test_a_fence_is_the_part_that_is_flown() -> None:
    run = written()
    home = shapely.Point(places(run)[0])
    hole = shapely.Point(0, 0).buffer(9.0, quad_segs=1)
    fence = home.buffer(5000.0, quad_segs=1).difference(hole)
    other = shapely.box(90_000.0, 0.0, 90_001.0, 1.0)
    no_fly = shapely.box(-9000.0, 0.0, -8999.0, 1.0)
    airspace = Airspace(fence=shapely.union_all([fence, other]), no_fly=no_fly)
    within, out = rings(replace(run, airspace=airspace))
    assert [len(ring) for ring in within] == [4]
    assert [len(ring) for ring in out] == [4, 4]
    assert within[0][0][0] == pytest.approx(49.6, abs=0.1)  # latitude first
    assert rings(replace(run, airspace=Airspace(no_fly=no_fly)))[0] == []
    assert rings(run) == ([], [])


def test_formats_are_chosen_by_name() -> None:
    assert "waypoints" not in Wanted.of(None, "px4", "relative").formats
    assert Wanted.of("kml, plan", "px4", "terrain").formats == ("plan", "kml")
    with pytest.raises(InputError, match=r"--format gpz: is not a format; did you mean gpx\?"):
        Wanted.of("gpz", "px4", "relative")
    with pytest.raises(InputError, match="for ArduPilot only"):
        Wanted.of("waypoints", "px4", "relative")
    assert len(Wanted.of(None, "ardupilot", "relative").files(written().flight)) == 9


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[uav]\nspeed = 3", "did you mean speed_mps?"),
        ("[uav]\nstart = 'anywhere'", "uav.start: is no key of an aircraft"),
        ("[aircraft]\nspeed_mps = 3", "aircraft: is not of an aircraft; known: uav"),
        ("[uav]", "uav: should be a table"),
        ("[uav]\nspeed_mps = 'quick'", "uav.speed_mps: should be a number"),
        ("[uav]\nacceleration_mps2 = 1", "uav.corner_m"),
        ("[uav\n", "is not TOML"),
    ],
)
def test_faults_of_an_aircraft_s_file(
    tmp_path_factory: pytest.TempPathFactory, content: str, said: str
) -> None:
    file = tmp_path_factory.mktemp("aircraft") / "mine.toml"
    file.write_text(content)
    with pytest.raises((InputError, ScenarioError)) as caught:
        with_aircraft(open_scenario(TOWN).scenario.uav, file)
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(file))


def test_aircraft_come_with_the_package(tmp_path_factory: pytest.TempPathFactory) -> None:
    uav = with_aircraft(open_scenario(TOWN).scenario.uav, Path("multicopter"))
    assert (uav.speed_mps, uav.acceleration_mps2, uav.kept_s) == (15.0, 1.4, 300.0)
    with pytest.raises(InputError, match="did you mean multicopter"):
        with_aircraft(uav, Path("multikopter"))
