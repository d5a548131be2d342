"""Several UAVs from one end to the other: planned, written, flown, checked and exported."""

import csv
import json
import re
import shutil
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.cli import main
from planner.mission.opening import open_scenario
from support.command_line import Commands
from support.town_on_earth import SETS, on_earth

ON_FIGURE3 = "uav=[{start={x_m=-9000,y_m=0}},{start={x_m=20000,y_m=0}, speed_mps=80}]"
BESIDE = "uav=[{start={x_m=0,y_m=0}},{start={x_m=60,y_m=0}}]"
SMALL = ("--method", "rate", "--targets", "40", "--set", "search.particles=20")
QUICKLY = ("--set", "search.work=2000")  # where `best` plans anew


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two UAVs whose sensors may miss."""
    folder = tmp_path_factory.mktemp("two") / "run"
    misses = ("--set", "sensor.detects=0.7")
    plan = ["plan", "figure3", *SMALL, *QUICKLY, *misses, "--set", ON_FIGURE3, "-o", str(folder)]
    assert main(plan) == 0
    return folder


@pytest.fixture(scope="module")
def in_town(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two multicopters in a town."""
    folder = tmp_path_factory.mktemp("town")
    short = ("--set", "search.horizon_s=900", "--set", "sensor.radius_m=30")
    fleet = ("--set", BESIDE, *SETS, *short)
    plan = ["plan", str(on_earth(folder)), *SMALL, *fleet, "-o", str(folder / "run")]
    assert main(plan) == 0
    return folder / "run"


def test_a_plan_holds_a_flight_of_each(two: Path) -> None:
    content = json.loads((two / "plan.json").read_text())
    assert [(uav["uav"], uav["flight"]) for uav in content["uavs"]] == [(0, 0), (1, 0)]
    assert [uav["speed_mps"] for uav in content["uavs"]] == [100.0, 80.0]
    heights = [uav["altitude_m"] for uav in content["uavs"]]
    assert heights == [150.0, 165.0]


def test_the_odds_of_two_follow_from_their_waypoints_alone(
    run: Commands,
    two: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run("futures", two / "run.json", "-o", tmp_path).code == 0
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2] / "tools"), *sys.path])
    check = import_module("verify").main
    assert check([str(two), "--futures", str(tmp_path)]) == 0
    (two.parent / "one").mkdir()
    shutil.copy(two / "run.json", two.parent / "one")

    def forged(change: Callable[[Any], object]) -> str:
        content = json.loads((two / "plan.json").read_text())
        change(content)
        (two.parent / "one" / "plan.json").write_text(json.dumps(content))
        capsys.readouterr()
        assert check([str(two.parent / "one"), "--futures", str(tmp_path)]) in (1, 2)
        said = capsys.readouterr()
        return "".join(line for line in said.out.splitlines() if "WRONG" in line) + said.err

    assert "detection_probability" in forged(lambda plan: plan["uavs"].pop())
    uavs, on = lambda plan: plan["uavs"], lambda plan: plan["uavs"][0]["sensor_on"]
    assert "flies no more often" in forged(lambda plan: uavs(plan).append(uavs(plan)[0]))
    assert "not in the scenario" in forged(lambda plan: uavs(plan)[1].update(uav=2))
    assert "rising and disjoint" in forged(lambda plan: on(plan).append(on(plan)[0]))
    assert "radius_m of" in forged(lambda plan: plan["planned"].update(radius_m=1e6))
    assert "horizon_s of" in forged(lambda plan: plan["planned"].update(horizon_s=1.0))
    assert "no faster" in forged(lambda plan: uavs(plan)[0]["waypoints"][1].__setitem__(1, 1e6))
    nan = {"waypoints": [["nan", 0.0, 0.0]]}
    assert "rows of 3 numbers" in forged(lambda plan: uavs(plan)[0].update(nan))


def test_flights_are_told_one_by_one(run: Commands, two: Path) -> None:
    said = run("plan", "figure3", *SMALL, "--set", ON_FIGURE3)
    head = said.out[said.out.index("UAV") :].splitlines()
    assert sum(line.split()[:2] == [name, "1"] for line in head for name in ("1", "2")) == 2
    assert run("fly", two, "--targets", "50", "--force").code == 0
    with (two / "flights.csv").open() as file:
        found = [row["uav"] for row in csv.DictReader(file) if float(row["found"]) > 0.5]
    assert set(found) - {"UAV 1", "UAV 2"} == set()
    assert found


def test_what_is_for_one_uav_is_refused_at_once(run: Commands, two: Path) -> None:
    said = run("fly", "--alarms", "1/600", "--targets", 20, "--sequences", 1, two)
    assert said.code == 2
    assert "--alarms: are those of one UAV, and the plan is for several" in said.err
    said = run("replan", two, "--at", 30, "--lost-at", "A")
    assert said.code == 2
    assert "--lost-at: one of several UAVs has followed the target; say which one" in said.err
    for at_s, uav, fault in (
        (0, 2, "--lost-at: by its plan UAV 2 is on the ground at 0:00:00"),
        (30, 3, "uav: there is no UAV 3; they are UAV 1 to UAV 2"),
    ):
        who = ("--lost-at", "A", "--uav", uav, "--uav-at", "A")
        said = run("replan", two, "--at", at_s, *who)
        assert said.code == 2
        assert fault in said.err
    said = run("fly", two, "--track", two / "plan.json")
    assert said.code == 2
    assert "--track: is what one UAV recorded, and the plan is for several" in said.err


QUICK = ("--method", "rate", "--targets", 40, "-j", 1, "--json")


def test_a_fleet_searches_a_lost_target_from_where_all_are(run: Commands, tmp_path: Path) -> None:
    two, drawn = tmp_path / "run", ("--set", "search.sampling=sobol", "--set", ON_FIGURE3)
    assert run("plan", "figure3", *SMALL, *drawn, "-o", two).code == 0
    words = ("--lost-at", "A", "--gap", 30, "--uav", 2, "--uav-at", "A")
    said = run("replan", two, "--at", 60, *words, *QUICK, "-o", tmp_path / "again").json
    assert said["parent"]["at_s"] == 30.0  # since the loss
    assert said["evaluated"]["expected_detection_time_s"] < 1000.0
    one, other = json.loads((tmp_path / "again" / "plan.json").read_text())["uavs"]
    before = json.loads((two / "plan.json").read_text())["uavs"][0]["waypoints"]
    x_m = np.interp(60.0, [row[0] for row in before], [row[1] for row in before])
    assert one["waypoints"][0][:2] == pytest.approx([30.0, x_m])  # flies on from where it was
    node = open_scenario("figure3").network
    place = node.node_xy_m[list(node.node_ids).index("A")]
    assert other["waypoints"][0][:3] == pytest.approx([30.0, *place])


def test_who_is_left_flies_on_in_a_run_like_any(run: Commands, two: Path, tmp_path: Path) -> None:
    lost, more = tmp_path / "lost", tmp_path / "more"
    said = run("replan", two, "--at", 60, "--uav-lost", 1, *QUICK, "-o", lost).json
    assert said["understood"] == ["UAV 1 lost at 0:01:00"]
    (flight,) = json.loads((lost / "plan.json").read_text())["uavs"]
    assert (flight["uav"], flight["speed_mps"], flight["waypoints"][0][0]) == (1, 80.0, 60.0)
    page = (lost / "page.html").read_text()
    assert "1 drone, 80 m/s" in page
    words = ("--joined", "A", "--uav", 2, "--delay", 5)
    said = run("replan", lost, "--at", 90, *words, *QUICK, "-o", more).json
    assert said["parent"]["run"] == "lost"
    flights = json.loads((more / "plan.json").read_text())["uavs"]
    assert [one["uav"] for one in flights] == [1, 2]
    assert run("fly", more, "--targets", 20, "-j", 1).code == 0
    assert run("page", more, "-o", tmp_path / "p.html").code == 0
    assert run("where", more / "run.json", "--at", 100).code == 0


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("--uav-lost", 3), "there is no UAV 3; they are UAV 1 to UAV 2"),
        (("--uav-lost", 1, "--uav-lost", "uav 2"), "without UAV 1 and UAV 2 nobody flies"),
        (("--uav-lost", "x"), 'uav: "x" is no UAV; they are counted from 1: write 2'),
        (("--delay", 5), "uav: is missing; say which of the 2 UAVs it is, as uav 2"),
        (("--uav", 2), "--uav: goes with --delay, --uav-at or --battery"),
        (("--joined", "nowhere"), "is no place of this net"),
    ],
)
def test_what_is_said_of_nobody_is_refused_in_one_line(
    run: Commands, two: Path, tmp_path: Path, words: tuple[object, ...], fault: str
) -> None:
    said = run("replan", two, "--at", 60, *words, *QUICK, "-o", tmp_path / "rest")
    assert (said.code, said.out, said.err.count("\n")) == (2, "", 1)
    assert fault in said.err
    assert not (tmp_path / "rest").exists()


def test_live_lines_say_whose_they_are(run: Commands, two: Path, tmp_path: Path) -> None:
    news, out = tmp_path / "news.jsonl", tmp_path / "live.jsonl"
    lines = [
        {"kind": "lost", "uav": "UAV 1", "now": 60},
        {"kind": "delay", "lasts": 5, "uav": 1},
        {"kind": "joined", "place": "A"},
        {"kind": "found"},
    ]
    news.write_text("".join(json.dumps(line) + "\n" for line in lines))
    said = run("fly", two, "--live", news, "--auto", "-o", out, "-j", 1)
    assert said.code == 0
    assert "the plan there was stands: uav: UAV 1 flies no more" in said.out
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert {row["uav"] for row in rows} == {"UAV 2", "UAV 3"}
    assert all(row["flight"] == 0 for row in rows)


def test_a_page_knows_all(two: Path) -> None:
    text = (two / "page.html").read_text()
    assert "2 drones, 80 and 100 m/s" in text
    assert "Flight of drone 2" in text


def test_each_has_a_mission_of_its_own_and_maps_hold_all(
    run: Commands, in_town: Path, tmp_path: Path
) -> None:
    printed = run("export", in_town, "-o", tmp_path, "--check").out
    assert re.findall(r"^(UAV \d): \d+ waypoints, ", printed, re.MULTILINE) == ["UAV 1", "UAV 2"]
    assert not re.findall(r"^UAV \d: *$", printed, re.MULTILINE)
    written = (tmp_path / "flight.txt").read_text()
    for text in (" ".join(printed.split()), written):
        assert text.count("research software") == text.count("expected detection time") == 1
        assert "The height, 100 m or 115 m, is above the launch point" in text
    assert written.count("WPNAV_SPEED ") == 1
    assert written.count("RTL_ALT ") == 2
    said = run("export", in_town, "-o", tmp_path, "--check", "--json", "--force").json
    names = {Path(name).name for name in said["files"]}
    assert {"flight-uav1.plan", "flight-uav2.waypoints", "flight.kml", "flight.txt"} <= names
    features = json.loads((tmp_path / "flight.geojson").read_text())["features"]
    assert [one["id"] for one in features if one["id"].endswith("flight")] == [
        "uav0.flight",
        "uav1.flight",
    ]
    assert (tmp_path / "flight.gpx").read_text().count("<trk>") == 2
    fcd = (tmp_path / "flight.fcd.xml").read_text()
    assert 'id="uav0"' in fcd
    assert 'id="uav1"' in fcd
    assert not any("may be nearer" in line for one in said["flights"] for line in one["wrong"])


def test_flights_too_near_each_other_are_not_exported(
    run: Commands, in_town: Path, tmp_path: Path
) -> None:
    content = json.loads((in_town / "plan.json").read_text())
    content["uavs"][1]["waypoints"] = content["uavs"][0]["waypoints"]
    content["uavs"][1]["legs"] = content["uavs"][0]["legs"]
    (tmp_path / "run.json").write_bytes((in_town / "run.json").read_bytes())
    (tmp_path / "plan.json").write_text(json.dumps(content))
    said = run("export", tmp_path, "-o", tmp_path / "flight")
    assert said.code == 2
    assert "UAV 1 and UAV 2 may be nearer than 15 m in height and 50 m beside" in said.err


def test_a_fleet_whose_sensors_miss_is_certified(
    run: Commands, two: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The files prove the bound to a program of their own, and to `compare`."""
    folder = tmp_path / "run"
    shutil.copytree(two, folder)
    told = run("certify", folder, "--work", "40", "--json").json
    stored = json.loads((folder / "plan.json").read_text())["certificate"]
    assert [uav["speed_mps"] for uav in stored["uavs"]] == [100.0, 80.0]
    assert stored["rate_per_s"] > 0.0
    assert told["lower_bound_s"] == stored["lower_bound_s"]
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2] / "tools"), *sys.path])
    assert import_module("verify").main([str(folder)]) == 0
    again = run("certify", folder, "--work", "1", "--force")
    assert "the earlier bound is better and stays" in again.out
