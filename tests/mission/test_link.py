"""A UAV stays within reach of its radio: no method, no way home and no place leads beyond."""

import numpy as np
import pytest

from planner.errors import ScenarioError
from planner.mission.opening import open_scenario
from planner.mission.planning import make_plan
from planner.mission.recorder import Recorder
from planner.search.methods import method_named

SMALL = ("search.particles=20", "search.work=500")


@pytest.mark.parametrize("method", ["rate", "wait", "spiral"])
@pytest.mark.parametrize("aircraft", ["ideal", "multicopter", "fixed-wing"])
def test_no_flight_gets_farther_from_its_start(method: str, aircraft: str) -> None:
    link_m = 49_000 if aircraft == "fixed-wing" else 43_000  # with room for its circles of 4 km
    flown = (f"uav.aircraft={aircraft}", "uav.max_flight_time_s=1800", f"uav.link_m={link_m}")
    opened = open_scenario("figure3", overrides=[*SMALL, *flown])
    recorder = Recorder(opened, 1)
    plan = make_plan(method_named(method), opened, recorder, recorder.planning().futures).plan
    (track,) = plan.tracks
    away_m = np.hypot(track.x_m - opened.starts_m[0][0], track.y_m - opened.starts_m[0][1])
    assert away_m.max() <= link_m
    assert {opened.network.road_ids[leg.road] for leg in plan.legs[0]} <= {"AB", "BC", "BD"}


def faults(*overrides: str) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        open_scenario("figure3", overrides=overrides)
    return [str(fault) for fault in caught.value.faults]


def test_faults_of_the_link() -> None:
    assert faults("uav.link_m=5000") == [
        "uav.link_m: leaves no road to be searched; give more, or correct [airspace]"
    ]
    (fault,) = faults("uav.link_m=43000", "uav.return_to={x_m=20000,y_m=0}")
    assert fault.startswith("uav.return_to: lies beyond uav.link_m; land elsewhere")
    assert faults("uav.link_m=43000", "uav.start={node='nowhere'}")[0].startswith("uav.start.node")
