"""`planner export`: every file, read back by other programs; and what it refuses."""

import csv
import io
import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import geojson
import gpxpy
import numpy as np
import pytest
from fastkml.validator import validate
from lxml import etree
from pymavlink import mavwp

from planner.cli import export as command
from planner.cli import main
from planner.export.formats import ABOUT, FILES
from planner.network.sumo import sumo_home
from support.command_line import TOWN, Commands, Said
from support.town_on_earth import CREDIT, SETS, on_earth

SMALL = ("--method", "rate", "--set", "search.particles=20", "--targets", "30")
SHORT = ("--set", "search.horizon_s=1800", "--set", "sensor.radius_m=60")
ORIGIN = ("--origin", "49.6,6.1")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.fixture(scope="module")
def town_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in the town, which does not say where it lies, for a real aircraft."""
    folder = tmp_path_factory.mktemp("town") / "run"
    assert main(["plan", TOWN, *SMALL, *SETS, *SHORT, "-o", str(folder), "--json"]) == 0
    return folder


def planned(run: Commands, folder: Path, scenario: object, *options: str) -> Path:
    said = run("plan", scenario, *SMALL, *options, "-o", folder)
    assert said.code == 0, said.err
    return folder


def refused(said: Said, *lines: str) -> None:
    assert said.code == 2
    assert len(said.err.splitlines()) == len(lines), said.err
    for got, line in zip(said.err.splitlines(), lines, strict=True):
        assert line in got


def test_all_files_are_what_their_programs_read(run: Commands, tmp_path: Path) -> None:
    directory = planned(run, tmp_path / "run", on_earth(tmp_path), *SETS, *SHORT)
    said = run("export", directory)
    assert said.code == 0, said.err
    assert said.out.startswith("The height, 120 m, is above the launch point, and flat ground")
    assert "research software, not certified" in said.out
    folder = directory / "flight"
    assert {path.name for path in folder.iterdir()} == {*FILES.values(), ABOUT}
    table = list(csv.DictReader(io.StringIO((folder / "flight.csv").read_text())))
    degrees = np.array([(float(row["lat"]), float(row["lon"])) for row in table])
    assert degrees[0] == pytest.approx((49.6, 6.15), abs=0.1)

    items = json.loads((folder / "flight.plan").read_text())["mission"]["items"]
    flown = [item["params"][4:6] for item in items if item["command"] == 16]
    assert np.allclose(flown, degrees[1:-1], atol=1e-7)
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(folder / "flight.waypoints")) == len(items) + 1
    route = gpxpy.parse((folder / "flight.gpx").read_text()).routes[0]
    assert np.allclose([(p.latitude, p.longitude) for p in route.points], degrees)
    assert validate(file_to_validate=folder / "flight.kml")
    read = geojson.loads((folder / "flight.geojson").read_text())
    assert read.is_valid
    kinds = [one["properties"]["kind"] for one in read["features"]]
    assert {"flight", "waypoint", "road", "targets not found"} == set(kinds)
    for name, schema in (("fcd", "fcd_file.xsd"), ("edgedata", "meandata_file.xsd")):
        rules = etree.XMLSchema(etree.parse(str(sumo_home() / "data" / "xsd" / schema)))
        rules.assertValid(etree.parse(str(folder / FILES[name])))
    points = gpxpy.parse((folder / "flight.gpx").read_text()).tracks[0].segments[0].points
    assert (points[0].elevation, points[-1].elevation) == (0.0, 0.0)  # from the ground, to it
    assert max(point.elevation for point in points) == 120.0

    for name in ("flight.kml", "flight.gpx", "flight.geojson", ABOUT):
        assert CREDIT in (folder / name).read_text(encoding="utf-8")
    assert "drew it" in (folder / "flight.fcd.xml").read_text(encoding="utf-8")
    text = (folder / ABOUT).read_text(encoding="utf-8")
    assert text.startswith("The height, 120 m, is above the launch point, and flat ground")
    assert "at 2026-05-01T12:05:00.000Z" in text
    for parameter in ("WPNAV_SPEED ", "WPNAV_ACCEL ", "WPNAV_SPEED_UP ", "RTL_ALT ", "ANGLE_MAX "):
        assert parameter in text


def test_the_figures_are_those_of_the_plan_and_of_what_is_written(
    run: Commands, tmp_path: Path, town_run: Path
) -> None:
    options = ("--json", "--tolerance", "0", "-o", tmp_path)
    told = run("export", town_run, *ORIGIN, *options).json
    stored = json.loads((town_run / "plan.json").read_text())["evaluated"]
    of_plan, of_flight = told["as_planned"], told["as_written"]
    assert of_plan["expected_detection_time_s"] == stored["expected_detection_time_s"]
    assert of_flight["detection_probability"] == pytest.approx(stored["detection_probability"])
    assert of_flight["expected_detection_time_s"] == pytest.approx(
        stored["expected_detection_time_s"], abs=2.0
    )
    assert told["wrong"] == []
    assert all(Path(name).is_file() for name in told["files"])


def test_the_same_bytes_and_nothing_overwritten(
    run: Commands, tmp_path: Path, town_run: Path
) -> None:
    for folder in ("a", "b"):
        assert run("export", town_run, *ORIGIN, "-o", tmp_path / folder).code == 0
    for name in (*FILES.values(), ABOUT):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    again = run("export", town_run, *ORIGIN, "-o", tmp_path / "a")
    assert again.code == 2
    assert "--force" in again.err
    px4 = ("--autopilot", "px4", "--frame", "terrain", "--force")
    said = run("export", town_run, *ORIGIN, "-o", tmp_path / "a", *px4)
    assert said.out.startswith("Autopilots keep 120 m above the terrain")
    assert not (tmp_path / "a" / "flight.waypoints").exists()
    assert "MPC_XY_CRUISE" in (tmp_path / "a" / ABOUT).read_text()
    mission = json.loads((tmp_path / "a" / "flight.plan").read_text())["mission"]
    assert {item["frame"] for item in mission["items"]} == {2, 10}
    one = run("export", town_run, *ORIGIN, "-o", tmp_path / "c", "--format", "gpx")
    assert one.code == 0
    assert {path.name for path in (tmp_path / "c").iterdir()} == {"flight.gpx", ABOUT}


def test_no_flight_of_an_earlier_plan_is_left_beside_another(run: Commands, tmp_path: Path) -> None:
    folder = planned(run, tmp_path / "run", TOWN, *SETS, *SHORT)
    assert run("export", folder, *ORIGIN, "--format", "plan").code == 0
    (folder / "flight" / "flight-1.waypoints").touch()
    (folder / "flight" / "notes.txt").touch()  # the pilot's own
    again = run("plan", TOWN, *SMALL, *SETS, *SHORT, "-o", folder, "--force")
    assert again.code == 0, again.err
    assert [path.name for path in (folder / "flight").iterdir()] == ["notes.txt"]


def test_parts_and_a_vehicle_s_parameters(run: Commands, tmp_path: Path, town_run: Path) -> None:
    (tmp_path / "v.param").write_text("WPNAV_SPEED,1000\n")
    split = ("--split", "--max-waypoints", "4", "--params", tmp_path / "v.param")
    said = run("export", town_run, *ORIGIN, "-o", tmp_path / "a", *split)
    assert said.code == 0, said.err
    assert "- WPNAV_SPEED: is 1000, not 1500 cm/s" in said.out
    assert "autopilots' files are in" in said.out
    many = len(list((tmp_path / "a").glob("flight-*.plan")))
    assert many > 1
    parts = [tmp_path / "a" / f"flight-{number}.plan" for number in range(1, many + 1)]
    assert many == len(list((tmp_path / "a").glob("flight-*.waypoints")))
    assert not (tmp_path / "a" / "flight.plan").exists()
    ends, begins = [], []
    for part in parts:
        items = json.loads(part.read_text())["mission"]["items"]
        flown = [item["params"][4:6] for item in items if item["command"] == 16]
        begins.append(flown[0])
        ends.append(flown[-1])
    assert begins[1:] == ends[:-1]
    assert run("export", town_run, *ORIGIN, "-o", tmp_path / "a").code == 2  # parts are there
    assert run("export", town_run, *ORIGIN, "-o", tmp_path / "a", "--force").code == 0
    assert list((tmp_path / "a").glob("flight-*")) == []
    one = ("--split", "--max-waypoints", "1")
    refused(run("export", town_run, *ORIGIN, *one), "--max-waypoints: a part has two at least")
    (tmp_path / "v.param").write_text("{}")
    bad = ("--params", tmp_path / "v.param", "-o", tmp_path / "b")
    refused(run("export", town_run, *ORIGIN, *bad), "line 1: is no parameter and its value")
    assert not (tmp_path / "b").exists()
    nameless = ("--by-hand", "5", "-o", tmp_path / "b")
    refused(run("export", town_run, *ORIGIN, *nameless), "--by-hand 5: no street with a name")
    both = (*nameless, "--tolerance", "5")
    refused(run("export", town_run, *ORIGIN, *both), "--tolerance: is for an autopilot's flight")


def test_a_plan_for_the_ideal_aircraft(run: Commands, tmp_path: Path) -> None:
    directory = planned(run, tmp_path / "run", "figure3", "--set", 'uav.start={node="A"}')
    refused(run("export", directory, *ORIGIN), "uav: the plan is for an ideal aircraft")
    assert not (directory / "flight").exists()
    said = run("export", directory, *ORIGIN, "--aircraft", "multicopter", "--check")
    assert said.code == 0, said.err
    assert "the battery ends the search at" in said.out
    assert "it does not land where it took off" in said.out


def test_the_grid_whose_start_is_far_away(run: Commands, tmp_path: Path) -> None:
    directory = planned(run, tmp_path / "run", "grid5x5")
    options = (*ORIGIN, "--aircraft", "multicopter")
    refused(run("export", directory, *options), "the first waypoint is ")
    assert not (directory / "flight").exists()
    said = run("export", directory, *options, "--check")
    assert said.code == 0, said.err
    assert "wrong: the first waypoint is " in said.out
    assert "- the first waypoint is " in (directory / "flight" / ABOUT).read_text()


def test_each_refusal_is_a_line(run: Commands, tmp_path: Path, town_run: Path) -> None:
    refused(
        run("export", town_run),
        "--origin: is needed, as the net of this run does not say where on the Earth it lies; give "
        "--origin LAT,LON",
    )
    assert ".net.xml" not in run("export", town_run).err
    refused(
        run("export", town_run, *ORIGIN, "--max-waypoints", "3", "--aircraft", _fast(tmp_path)),
        "uav.speed_mps: 25 m/s is more than the 20 m/s",
        "waypoints are more than --max-waypoints 3",
    )
    refused(run("export", town_run, *ORIGIN, "--format", "dji"), "--format dji: is not a format")
    refused(run("export", town_run, "--origin", "95,6"), "should be a latitude and a longitude")
    refused(run("export", town_run, "--tolerance", "-1"), "should be metres from 0 on")
    refused(run("export", tmp_path), "holds no run")
    refused(run("export", town_run, *ORIGIN, "--aircraft", "no.toml"), "no.toml: is no file")
    assert not (town_run / "flight").exists()


def _fast(folder: Path) -> Path:
    (folder / "fast.toml").write_text("[uav]\nspeed_mps = 25\n")
    return folder / "fast.toml"


def test_a_take_off_that_has_passed_today_is_said() -> None:
    sighted_at = datetime(2026, 5, 1, 14, 0, tzinfo=UTC)
    track = SimpleNamespace(time_s=np.array([60.0]))
    flights: Any = [SimpleNamespace(flight=SimpleNamespace(sighted_at=sighted_at), track=track)]
    assert command._late_line(flights, sighted_at + timedelta(seconds=59)) == ""
    assert "planned for 9 min ago" in command._late_line(
        flights, sighted_at + timedelta(minutes=10)
    )
    assert command._late_line(flights, sighted_at + timedelta(days=3)) == ""
    flights[0].flight.sighted_at = None
    assert command._late_line(flights, sighted_at + timedelta(minutes=10)) == ""
