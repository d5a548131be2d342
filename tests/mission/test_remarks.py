"""How far a place lies from the roads, against points laid densely along them."""

import numpy as np
import pytest

from planner.mission.opening import open_scenario
from planner.mission.remarks import off_roads_m, scenario_remarks
from support.command_line import TOWN
from support.instances import town


def test_the_nearest_road_is_that_of_a_slow_look() -> None:
    network = town()
    roads = range(len(network.road_ids))
    points = np.concatenate(
        [network.xy(road, np.arange(0.0, network.road_length_m[road], 0.5)) for road in roads]
    )
    places = np.random.default_rng(1).uniform((-300, -300), (800, 700), (40, 2))
    for place in places:
        slow_m = float(np.linalg.norm(points - place, axis=1).min())
        assert off_roads_m(network, place) == pytest.approx(slow_m, abs=0.3)
    assert off_roads_m(network, network.node_xy_m[3]) == 0.0


def test_the_papers_drone_comes_from_afar() -> None:
    opened = open_scenario("grid5x5")
    assert scenario_remarks(opened) == ["uav.start: lies 60.0 km from the nearest road"]
    near = open_scenario("grid5x5", overrides=["uav.start.distance_m=500"])
    assert scenario_remarks(near) == []
    places = ("{ x_m = 0, y_m = 0 }", "{ x_m = 0, y_m = 30000 }")
    two = ", ".join(f"{{ start = {place}, speed_mps = 100 }}" for place in places)
    remarks = scenario_remarks(open_scenario("grid5x5", overrides=[f"uav=[{two}]"]))
    assert remarks == ["uav[1].start: lies 30.0 km from the nearest road"]


def test_few_particles_for_many_roads() -> None:
    overrides = ["uav.start.distance_m=500", "search.particles=1700"]
    (few,) = scenario_remarks(open_scenario("grid5x5", overrides=overrides))
    assert few.startswith("search.particles: 1,700 are few for 60 roads")
    assert "1,800 or more" in few
    (of_two,) = scenario_remarks(open_scenario("grid5x5-two", overrides=overrides))
    assert "3,600 or more" in of_two
    known = ["target.distance_m={ constant = 0 }", "target.speed_mps={ constant = 20 }"]
    every = [*overrides, *known, "search.sampling=all"]
    assert scenario_remarks(open_scenario("grid5x5", overrides=every)) == []


def test_what_export_will_refuse_is_told_before_anything_is_planned() -> None:
    def refused(*overrides: str) -> list[str]:
        told = scenario_remarks(open_scenario(TOWN, overrides=overrides))
        return [line.partition("refuse a plan: ")[2] for line in told if "refuse" in line]

    assert refused("uav.aircraft=multicopter", "uav.speed_mps=15") == []
    assert refused("uav.aircraft=multicopter", "uav.speed_mps=25")[0].startswith(
        "uav.speed_mps: 25 m/s is more than the 20 m/s that autopilots keep to"
    )
    assert refused("uav.aircraft=ideal")[0].startswith("uav: the plan is for an ideal aircraft")
    climbs = refused("uav.aircraft=ideal", "uav.climb_mps=2.5", "uav.speed_mps=15")
    assert climbs[0].startswith("uav.acceleration_mps2: is not given")
    two = "uav=[{ start = { x_m = 0, y_m = 0 } }, { start = { x_m = 9, y_m = 0 }, speed_mps = 25 }]"
    assert refused(two, "uav.aircraft=multicopter")[0].startswith("uav[1].speed_mps: 25 m/s")
