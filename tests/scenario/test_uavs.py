"""Several UAVs: one table [uav], or a list of tables [[uav]], each addressed by its number."""

import tomllib
from pathlib import Path

import pytest

from planner.errors import ScenarioError
from planner.mission.opening import open_scenario
from planner.scenario.draft import read_draft, read_scenario
from planner.scenario.fleet import APART_M, with_heights
from planner.scenario.toml_text import scenario_text

TWO = """
[network]
nodes = "n.nod.xml"
edges = "n.edg.xml"
abstract = true
[target]
start = "anywhere"
[[uav]]
start = { x_m = 1, y_m = -2.5 }
[[uav]]
start = { x_m = 500, y_m = 0 }
speed_mps = 30
take_off_s = 60
"""
FLEET = "uav=[{start={x_m=0,y_m=0}},{start={x_m=900,y_m=0},altitude_m=80}]"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("n.nod.xml", "n.edg.xml"):
        (tmp_path / name).write_text("<x/>")
    (tmp_path / "scenario.toml").write_text(TWO)
    return tmp_path


def faults(place: Path | str, *overrides: str) -> list[str]:
    return [str(fault) for fault in read_draft(place, overrides=overrides).faults]


def test_each_table_is_a_uav(folder: Path) -> None:
    scenario = read_scenario(folder)
    assert [uav.speed_mps for uav in scenario.uavs] == [100.0, 30.0]
    assert scenario.uav is scenario.uavs[0]
    assert scenario.take_off_s == 0.0


def test_a_list_of_one_is_the_same_scenario(folder: Path) -> None:
    one = folder / "one.toml"
    one.write_text(TWO[: TWO.rindex("[[uav]]")])
    single = read_scenario(one)
    one.write_text(one.read_text().replace("[[uav]]", "[uav]"))
    assert read_scenario(one).as_dict() == single.as_dict()
    assert isinstance(single.as_dict()["uav"], dict)


def test_an_override_is_for_one_uav_or_for_all(folder: Path) -> None:
    def speeds(*overrides: str) -> list[float]:
        return [uav.speed_mps for uav in read_scenario(folder, overrides=overrides).uavs]

    assert speeds("uav.speed_mps=20") == [20.0, 20.0]
    assert speeds("uav.1.speed_mps=20") == [100.0, 20.0]
    assert speeds("uav.speed_mps=20", "uav.0.speed_mps=25") == [25.0, 20.0]
    (one,) = read_scenario("grid5x5", overrides=["uav.0.speed_mps=20"]).uavs
    assert one.speed_mps == 20.0


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("uav.2.speed_mps=20", "uav.2.speed_mps: uav.2 is not in the list"),
        ("uav.1.speed_mps=0", "uav[1].speed_mps: should be greater than 0"),
        ("uav.1.sped_mps=9", "uav[1].sped_mps: is not a known key"),
        ("uav.1.corner_m=2", "uav[1].corner_m: says nothing without uav[1].acceleration_mps2"),
        ("uav.1.take_off_s=20000", "+ uav[1].take_off_s +"),
        ("uav.1.aircraft=glider", "uav[1].aircraft: glider: is no file"),
        ("uav.1.sorties=2", "uav[1].return_to: is missing"),
        ("uav.1.swap_s=20", "uav[1].swap_s: says nothing without uav[1].sorties"),
        ("uav=[]", "uav: is an empty list"),
        ("uav=[3, {start={x_m=0,y_m=0}}]", "uav[0]: should be a table, not 3"),
    ],
)
def test_a_fault_names_the_uav(folder: Path, override: str, said: str) -> None:
    assert any(said in fault for fault in faults(folder, override)), faults(folder, override)


def test_a_place_that_is_nowhere_is_named_by_its_uav() -> None:
    with pytest.raises(ScenarioError) as error:
        open_scenario("figure3", overrides=[FLEET, 'uav.1.start={node="nowhere"}'])
    assert [fault.key for fault in error.value.faults] == ["uav[1].start.node"]


def test_uavs_without_a_height_get_one_each(folder: Path) -> None:
    heights = [uav.altitude_m for uav in read_scenario(folder).uavs]
    assert heights == [150.0, 150.0 + APART_M]
    (first, second) = with_heights([{}, {"altitude_m": 155}], [{}, {"altitude_m": 155}], 150.0)
    assert (first["altitude_m"], second["altitude_m"]) == (180.0, 155)
    given = read_scenario(folder, overrides=["uav.altitude_m=60"])
    assert [uav.altitude_m for uav in given.uavs] == [60.0, 60.0]  # as the scenario says


def test_a_fleet_written_out_is_the_same_fleet(folder: Path) -> None:
    scenario = read_scenario(folder, overrides=["uav.0.link_m=200"])
    text = scenario_text(scenario)
    assert text.count("[[uav]]") == 2
    assert tomllib.loads(text)["uav"] == scenario.as_dict()["uav"]
    (folder / "again.toml").write_text(text)
    assert read_scenario(folder / "again.toml").as_dict() == scenario.as_dict()


def test_each_uav_starts_at_its_own_place() -> None:
    opened = open_scenario("figure3", overrides=[FLEET])
    assert opened.starts_m == ((0.0, 0.0), (900.0, 0.0))
    assert opened.starts_m[0] == (0.0, 0.0)
    assert opened.airspaces == (None, None)
