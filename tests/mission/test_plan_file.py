"""A plan file holds all that its figures follow from."""

import json
from pathlib import Path

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import InputError
from planner.flight.uav import Uav
from planner.mission.plan_file import plan_content, read_plan, write_plan
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from support.drawn_streets import drawn
from support.instances import figure3, physics_futures


def written(path: Path, *, transit: bool, by_s: float | None = None) -> dict[str, object]:
    network = figure3()
    routes = [["AB", "BC", "CE"], ["AB", "BD", "DG"], ["AB", "BC", "CF"]]
    futures = physics_futures(
        network, routes, [0.0] * 3, [12.0, 20.0, 25.0], horizon_s=1e5, gone=False
    )
    uav = Uav(x_m=-30_000.0, y_m=0.0, take_off_s=0.0, speed_mps=100.0)
    asked = Problem(network, futures, uav, Sensor(200.0, transit), Objective(3_600.0))
    plan = plan_of_legs(asked, "by hand", [0, 5, 2, 9])
    evaluation = evaluate(plan.tracks, futures, asked.sensor, Objective(asked.horizon_s, by_s))
    content = plan_content(
        plan, network, sensor=asked.sensor, planned=evaluation, evaluated=evaluation, seed=1
    )
    write_plan(path, content)
    return content


@pytest.mark.parametrize("transit", [True, False])
def test_the_file_alone_reproduces_the_figures(tmp_path: Path, transit: bool) -> None:
    content = written(tmp_path / "plan.json", transit=transit)
    stored = read_plan(tmp_path / "plan.json", figure3())
    futures = physics_futures(
        figure3(), [["AB", "BC", "CE"], ["AB", "BD", "DG"], ["AB", "BC", "CF"]],
        [0.0] * 3, [12.0, 20.0, 25.0], horizon_s=1e5, gone=False,
    )  # fmt: skip
    again = evaluate(stored.plan.tracks, futures, stored.sensor, stored.objective)
    planned = content["planned"]
    assert isinstance(planned, dict)
    assert again.expected_detection_time_s == planned["expected_detection_time_s"]
    assert [leg.leg for leg in stored.plan.legs[0]] == [0, 5, 2, 9]
    windows = len(stored.plan.tracks[0].sensor_on)
    assert windows == 1 if transit else windows > 1


def test_the_objective_stands_beside_its_value(tmp_path: Path) -> None:
    timed = written(tmp_path / "plan.json", transit=True)["evaluated"]
    assert isinstance(timed, dict)
    assert timed["objective"] == "time"
    assert "found_by_s" not in timed
    assert read_plan(tmp_path / "plan.json", figure3()).objective.by_s is None
    content = written(tmp_path / "plan.json", transit=True, by_s=400.0)
    for part in ("planned", "evaluated"):
        figures = content[part]
        assert isinstance(figures, dict)
        assert (figures["objective"], figures["found_by_s"]) == ("probability", 400.0)
        assert 0 < figures["found_by_probability"] < figures["detection_probability"]
    assert read_plan(tmp_path / "plan.json", figure3()).objective.by_s == 400.0


def test_legs_name_roads_and_nodes_in_flying_direction(tmp_path: Path) -> None:
    written(tmp_path / "plan.json", transit=True)
    uav = json.loads((tmp_path / "plan.json").read_text())["uavs"][0]
    names = [(leg["road"], leg["from_node"], leg["to_node"]) for leg in uav["legs"]]
    assert names[:2] == [("AB", "A", "B"), ("BD", "D", "B")]
    times = np.array(uav["waypoints"])[:, 0]
    assert times[0] == 0.0
    assert all(leg["end_s"] in times for leg in uav["legs"])


def test_what_is_no_plan_is_told_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    with pytest.raises(InputError, match="is missing"):
        read_plan(path, figure3())
    for text in ("[", "[]", '{"schema": "other"}', '{"schema": "planner.plan/1", "uavs": 3}'):
        path.write_text(text)
        with pytest.raises(InputError, match=r"plan\.json: ") as caught:
            read_plan(path, figure3())
        assert "\n" not in str(caught.value)
    written(path, transit=True)
    path.write_text(path.read_text().replace('"AB"', '"ZZ"'))
    with pytest.raises(InputError, match="ZZ"):
        read_plan(path, figure3())


def test_of_a_loop_the_way_tells_in_which_direction_it_was_flown(tmp_path: Path) -> None:
    square = [(2e3, 0.0), (2e3, 2e3), (0.0, 2e3)]
    nodes = {"A": (0.0, 0.0), "B": (-3e3, 0.0)}
    network, _ = drawn(nodes, {"AA": ("A", "A", square), "AB": ("A", "B", ())})
    uav = Uav(x_m=0.0, y_m=-500.0, take_off_s=0.0, speed_mps=100.0)
    nobody = physics_futures(network, [], 0.0, 1.0)
    asked = Problem(network, nobody, uav, Sensor(200.0), Objective(3_600.0))
    for order in ([0, 2], [1, 2]):
        plan = plan_of_legs(asked, "by hand", order)
        evaluation = evaluate(plan.tracks, nobody, asked.sensor, asked.objective)
        figures = {"planned": evaluation, "evaluated": evaluation, "seed": 1}
        content = plan_content(plan, network, sensor=asked.sensor, **figures)
        write_plan(tmp_path / "plan.json", content)
        again = read_plan(tmp_path / "plan.json", network)
        assert [leg.leg for leg in again.plan.legs[0]] == order
