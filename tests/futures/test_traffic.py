"""The traffic of a user's own SUMO scenario: what it keeps, how its runs differ, who steers it."""

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from planner.errors import InputError, ScenarioError
from planner.futures import workers
from planner.futures.sumo_config import DEVICES, NAMES, read_config
from planner.futures.traffic import Permit, realisation_seed
from planner.mission.opening import open_scenario
from planner.network.sumo import binary
from planner.xml_guard import xml_elements
from support.data import data_file
from support.user_traffic import CONFIG, seen_of, told, traffic_at, write_traffic


@pytest.fixture
def fresh_workers() -> Iterator[None]:
    """Workers that begin in the folder where the test is."""
    workers.dismiss()
    yield
    workers.dismiss()


def test_a_scenario_is_kept_as_it_is(tmp_path: Path) -> None:
    folder = write_traffic(tmp_path / "own")
    before = seen_of(tmp_path)
    opened = traffic_at(folder)
    found = told(opened)
    assert seen_of(tmp_path) == before
    assert (found.time_s, found.step_s) == (60.0, 0.2)
    assert found.warm.vehicles > 5
    assert found.buses == 1
    assert found.persons >= 1
    assert found.on_loop > 0
    assert opened.traffic is not None
    assert dict(opened.traffic.options) == {
        "step-length": "0.2",
        "lateral-resolution": "0.8",
        "time-to-teleport": "120",
    }
    assert opened.traffic.left_out == ("end", "tripinfo-output", "log", "edgeData")


def test_realisations_repeat_and_differ(tmp_path: Path) -> None:
    opened = traffic_at(write_traffic(tmp_path))
    first, again, other = told(opened), told(opened), told(opened, 1)
    assert first == again
    assert first.places_m != other.places_m
    assert opened.traffic is not None
    seeds = [realisation_seed(opened.traffic, k) for k in range(1000)]
    assert len(set(seeds)) == 1000


def test_departures_can_be_moved(tmp_path: Path) -> None:
    folder = write_traffic(tmp_path)
    moved = open_scenario(folder, overrides=["traffic.depart_offset_s=30"])
    assert told(moved).places_m != told(traffic_at(folder)).places_m


def test_what_is_left_out_is_logged_in_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = write_traffic(tmp_path, config='<remote-port value="8813"/>')
    traffic_at(folder)
    (said,) = (one for one in caplog.records if "SUMO is not told of" in one.getMessage())
    assert said.levelname == "WARNING"  # as the motion may depend on it
    assert "end, tripinfo-output, log, remote-port, edgeData" in said.getMessage()


def test_routes_stand_for_a_configuration(tmp_path: Path) -> None:
    folder = write_traffic(tmp_path)
    text = (folder / "scenario.toml").read_text()
    named = 'routes = ["cars.rou.xml.gz", "bus.rou.xml"], additional = ["stops.add.xml"]'
    (folder / "scenario.toml").write_text(
        text.replace('net = "run.sumocfg"', 'net = "town.net.xml.gz"').replace(
            'sumocfg = "run.sumocfg"', named
        )
    )
    found = told(traffic_at(folder))
    assert found.step_s == 1.0
    assert found.buses == 1


def options_of_sumo(path: Path) -> dict[str, str]:
    """All options that SUMO has, each with its type."""
    words = [str(binary("sumo")), f"--save-template={path}"]
    subprocess.run(words, check=True, capture_output=True)
    return {str(one.tag): one.get("type", "") for one in xml_elements(path) if one.get("type")}


def test_options_that_are_taken_move_vehicles_and_nothing_else(tmp_path: Path) -> None:
    known = options_of_sumo(tmp_path / "template.xml")
    folder = tmp_path / "one.sumocfg"
    said = "".join(f'<{name} value="1"/>' for name in known if name != "mesosim")
    folder.write_text(f"<configuration>{said}</configuration>")
    found = read_config(folder)
    taken = {name for name, _ in found.options}
    assert taken | set(found.left_out) | set(found.files) == known.keys() - {"mesosim"}
    assert {name for name in taken if known[name] == "FILE"} == set()
    words = r"\b(output|save|load|log|port|seed|threads|validation|prefix|files?|gui|fcd|ssm)\b"
    assert {name for name in taken if re.search(words, name)} == set()
    assert "random" not in taken
    for name in ("step-length", "lateral-resolution", "default.speeddev", "scale", "tls.all-off"):
        assert name in taken
    assert len(taken) > 150
    assert taken >= set(NAMES)
    page = (Path(__file__).parents[2] / "docs" / "scenario.md").read_text()
    assert f"| devices | {', '.join(DEVICES)}: " in page


@pytest.mark.parametrize("file", ["cars.rou.xml.gz", "stops.add.xml", "bus.rou.xml", "more.xml"])
def test_another_byte_is_other_traffic(file: str, tmp_path: Path) -> None:
    folder = write_traffic(tmp_path, stops='<include href="more.xml"/>')
    (folder / "more.xml").write_text("<additional/>")
    before = traffic_at(folder).traffic
    with (folder / file).open("ab") as changed:
        changed.write(b"" if file.endswith(".gz") else b"<!-- -->\n")
    if file.endswith(".gz"):
        write_traffic(tmp_path, cars="<!-- -->", stops='<include href="more.xml"/>')
    after = traffic_at(folder).traffic
    assert before is not None
    assert after is not None
    assert before.digest != after.digest


def test_moved_traffic_is_the_same(tmp_path: Path) -> None:
    here = traffic_at(write_traffic(tmp_path / "here")).traffic
    write_traffic(tmp_path / "there")
    Path(tmp_path / "here" / "cars.rou.xml.gz").replace(tmp_path / "there" / "cars.rou.xml.gz")
    there = traffic_at(tmp_path / "there").traffic
    assert here is not None
    assert there is not None
    assert here.digest == there.digest


def test_every_name_of_an_option_is_its_own(tmp_path: Path) -> None:
    path = tmp_path / "a.sumocfg"
    path.write_text(
        '<c><n value="a.net.xml"/><r v="a.xml, b.xml"/><a value=""/><b value="60"/>'
        "<x>effort</x><more><scale value='2'/></more><t value='1'/></c>"
    )
    found = read_config(path)
    assert found.options == (("begin", "60"), ("weight-attribute", "effort"), ("scale", "2"))
    assert found.files["route-files"] == (tmp_path / "a.xml", tmp_path / "b.xml")
    assert found.files["additional-files"] == ()
    assert found.left_out == ("t",)


def test_the_net_is_that_of_the_scenario(tmp_path: Path) -> None:
    folder = write_traffic(tmp_path)
    (folder / "other.net.xml").write_text("<net/>")
    text = CONFIG.replace("town.net.xml.gz", "other.net.xml").replace("<!-- more -->", "")
    (folder / "other.sumocfg").write_text(text)
    with pytest.raises(InputError, match=r"its net, .*other.net.xml, is not that of \[network\]"):
        open_scenario(folder, overrides=["traffic.sumocfg=other.sumocfg"])


FAULTS = {
    "traffic={}": 'target.driving: "traffic" needs to know which; give [traffic] sumocfg',
    'traffic={ sumocfg="run.sumocfg" }': "traffic.at: is missing; give the traffic's own time",
    'traffic={ at=1, routes=["a.xml"] }': "traffic.routes[0]: there is no file",
    'traffic={ at=1, routes="a.xml" }': "traffic.routes: should be a list",
    "traffic={ at=1 }": "traffic: has no source; give sumocfg, or routes, or vehicles_per_hour",
    "traffic.vehicles_per_hour=9": "traffic: gives sumocfg and vehicles_per_hour; leave one",
    'traffic.additional=["stops.add.xml"]': "traffic.additional: goes with routes only",
    "traffic.realisations=0": "traffic.realisations: should be at least 1",
    "traffic.speed=3": "traffic.speed: is not a known key",
}


@pytest.mark.parametrize("override", FAULTS)
def test_a_faulty_section_is_one_line(override: str, tmp_path: Path) -> None:
    folder = write_traffic(tmp_path)
    with pytest.raises(ScenarioError) as refused:
        open_scenario(folder, overrides=[override])
    (line,) = str(refused.value).splitlines()
    assert FAULTS[override] in line


# Who steers

STEERED = """
calls = []
def stand(traci):
    calls.append(traci.simulation.getTime())
    for name in traci.vehicle.getIDList():
        traci.vehicle.setSpeed(name, 0.0 if len(calls) > 100 else -1)
def fails(traci):
    traci.vehicle.getSpeed("nobody")
def steps(traci):
    traci.simulationStep()
number = 3
"""


@pytest.mark.usefixtures("fresh_workers")
def test_a_function_steers_each_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = write_traffic(tmp_path / "own")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "steered_traffic.py").write_text(STEERED)
    opened = traffic_at(folder, Permit(control="steered_traffic:stand"))
    found = told(opened)
    assert found.warm.halting == found.warm.vehicles > 0
    assert opened.traffic is not None
    assert opened.traffic.files[-1][0].name == "steered_traffic.py"
    by_file = traffic_at(folder, Permit(control="steered_traffic.py:stand"))
    assert by_file.traffic is not None
    assert by_file.traffic.digest == opened.traffic.digest
    for function, said in (
        (
            "fails",
            "at 0 s: TraCIException: Vehicle 'nobody' is not known (line 8",
        ),
        ("steps", "takes SUMO on by itself; leave out its simulationStep"),
        ("number", "number is no function; write def function(traci): ..."),
        ("nobody", "has no function 'nobody'"),
    ):
        steered = traffic_at(folder, Permit(control=f"steered_traffic:{function}"))
        with pytest.raises(InputError, match=r"--control .*steered_traffic\.py") as refused:
            told(steered)
        assert said in str(refused.value)
    for control, said in (
        ("steered_traffic", "should be path.py:function, or module:function"),
        ("os; exit:f", "should be path.py:function, or module:function"),
        ("none.py:f", "none.py: cannot be read"),
        ("no_such_module:f", "there is no module no_such_module"),
        ("no_such.module:f", "No module named 'no_such'"),
    ):
        with pytest.raises(InputError, match="--control") as refused:
            traffic_at(folder, Permit(control=control))
        assert said in str(refused.value)


# A real town's rush hour


@pytest.mark.long
def test_bologna_runs_as_it_is(tmp_path: Path) -> None:
    config = data_file("bologna_acosta/run.sumocfg")
    before = seen_of(config.parent)
    (tmp_path / "scenario.toml").write_text(
        f'network = {{ net = "{config.as_posix()}" }}\n'
        'target = { start = "anywhere", driving = "traffic" }\n'
        "uav = { start = { x_m = 0, y_m = 0 } }\n"
        f'traffic = {{ sumocfg = "{config.as_posix()}", at = 900 }}\n'
    )
    found = told(traffic_at(tmp_path, Permit((config.parent,))))
    assert seen_of(config.parent) == before
    assert 500 < found.warm.vehicles < 700
    assert found.buses > 0


def test_paths_are_the_same_from_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_traffic(tmp_path / "own")
    monkeypatch.chdir(tmp_path)
    opened = traffic_at(Path("own"), Permit((Path(),)))
    assert opened.traffic is not None
    paths = [*opened.traffic.routes, *opened.traffic.allowed, opened.traffic.given_as]
    assert all(path.is_absolute() for path in (*paths, *dict(opened.traffic.files)))
