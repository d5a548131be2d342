"""Whose keys a scenario's [uav] has where it says nothing: a profile's, a file's, the ideal's."""

import json
from pathlib import Path

import pytest

from planner.errors import InputError, ScenarioError
from planner.scenario.aircraft_file import KEYS, SHIPPED, shipped_aircraft
from planner.scenario.draft import read_scenario
from planner.scenario.uav import UavSection

STREETS = """
[network]
net = "town.net.xml"
[target]
start = "anywhere"
[uav]
start = { x_m = 1, y_m = -2.5 }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "town.net.xml").write_text("<net/>")
    (tmp_path / "scenario.toml").write_text(STREETS)
    return tmp_path


def uav(place: Path | str, *overrides: str) -> UavSection:
    return read_scenario(place, overrides=overrides).uav


def test_on_streets_a_multicopter_flies_if_nothing_is_said(folder: Path) -> None:
    found = uav(folder)
    assert (found.aircraft, found.is_real) == ("multicopter", True)
    assert (found.speed_mps, found.acceleration_mps2, found.corner_m) == (15.0, 1.4, 2.0)
    assert (found.max_flight_time_s, found.kept_s) == (1500.0, 300.0)


def test_a_scenario_s_own_keys_come_first(folder: Path) -> None:
    found = uav(folder, "uav.speed_mps=12", "uav.reserve_s=60")
    assert (found.speed_mps, found.kept_s, found.climb_mps) == (12.0, 60.0, 2.5)


def test_the_ideal_aircraft_has_no_keys_but_its_own(folder: Path) -> None:
    found = uav(folder, "uav.aircraft=ideal")
    assert (found.is_real, found.speed_mps, found.max_flight_time_s) == (False, 100.0, None)
    assert uav(folder, "uav.aircraft=ideal", "uav.climb_mps=3").is_real


def test_on_abstract_nets_nothing_said_is_the_ideal_aircraft() -> None:
    scenario = read_scenario("grid5x5")
    assert not scenario.uav.is_real
    assert "aircraft" not in scenario.as_dict()["uav"]
    assert uav("grid5x5", "uav.aircraft=multicopter").acceleration_mps2 == 1.4


@pytest.mark.parametrize("name", shipped_aircraft())
def test_profiles_that_come_with_the_package_are_sound(folder: Path, name: str) -> None:
    found = uav(folder, f"uav.aircraft={name}")
    assert found.is_real
    assert found.can_hover == (name == "multicopter")
    assert ("UNTESTED" in (SHIPPED / f"{name}.toml").read_text()) == (name != "multicopter")


def test_a_file_beside_the_scenario(folder: Path) -> None:
    (folder / "mine.toml").write_text("[uav]\nspeed_mps = 9\nclimb_mps = 4\n")
    found = uav(folder, "uav.aircraft=mine.toml")
    assert (found.speed_mps, found.climb_mps, found.acceleration_mps2) == (9.0, 4.0, None)


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("uav.aircraft=multikopter", "uav.aircraft: multikopter: is no file and no aircraft"),
        ("uav.aircraft=multikopter", "did you mean multicopter"),
        ("uav.aircraft=3", "uav.aircraft: should be a name in quotes, not 3; known: fixed-wing"),
        ("uav.aircraft=wrong.toml", "uav.aircraft: wrong.toml: uav.speed is no key of an aircraft"),
        ("uav.climb_mps=0", "or leave it out"),
        ("uav.acceleration_mps2=0", "or leave it out"),
        ("uav.corner_m=0", "or leave it out"),
        ("uav.descend_mps=0", "or leave it out"),
        ("uav.link_m=0", "or leave it out"),
        ("uav.min_speed_mps=20", "uav.min_speed_mps: is more than uav.speed_mps, 15 m/s"),
        ("uav.hover=false", "uav.min_speed_mps: is missing"),
    ],
)
def test_faults(folder: Path, override: str, said: str) -> None:
    (folder / "wrong.toml").write_text("[uav]\nspeed = 9\n")
    with pytest.raises((InputError, ScenarioError)) as caught:
        uav(folder, override)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)  # nothing is missing because it is faulty


def test_what_a_run_keeps_is_its_aircraft_whatever_becomes_of_profiles(folder: Path) -> None:
    for given in (("uav.aircraft=fixed-wing",), ("uav.aircraft=ideal",)):
        scenario = read_scenario(folder, overrides=given)
        record = {"scenario": scenario.as_dict(), "scenario_path": str(scenario.path)}
        if given == ("uav.aircraft=ideal",):
            del record["scenario"]["uav"]["aircraft"]  # as runs were before there were profiles
        (folder / "run.json").write_text(json.dumps(record))
        again = uav(folder / "run.json")
        assert {key: getattr(again, key) for key in KEYS} == {
            key: getattr(scenario.uav, key) for key in KEYS
        }
    with pytest.raises(ScenarioError, match="name the scenario in place of the run"):
        uav(folder / "run.json", "uav.aircraft=vtol")
