"""A plan file holds all that its figures follow from."""

import json
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import jsonschema
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
from support import plan_schema
from support.drawn_streets import drawn
from support.instances import figure3, physics_futures

OLD = Path(__file__).parent / "plan_1.json"  # of figure3, by the program before schema 2
ON_EARTH = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"


def written(
    path: Path, *, transit: bool, by_s: float | None = None, projection: str | None = None
) -> dict[str, Any]:
    network = replace(figure3(), projection=projection)
    routes = [["AB", "BC", "CE"], ["AB", "BD", "DG"], ["AB", "BC", "CF"]]
    futures = physics_futures(
        network, routes, [0.0] * 3, [12.0, 20.0, 25.0], horizon_s=1e5, gone=False
    )
    uav = Uav(
        x_m=-30_000.0, y_m=0.0, take_off_s=0.0, speed_mps=100.0,
        altitude_m=120.0, return_to_m=(0.0, 500.0),
    )  # fmt: skip
    asked = Problem(network, futures, uav, Sensor(200.0, transit), Objective(3_600.0))
    plan = plan_of_legs(asked, "by hand", [0, 5, 2, 9])
    evaluation = evaluate(plan.tracks, futures, asked.sensor, Objective(asked.horizon_s, by_s))
    content = plan_content(
        plan, asked, planned=evaluation, evaluated=evaluation, seed=1,
        sighted_at=datetime.fromisoformat("2026-05-01T14:05:00+02:00"),
    )  # fmt: skip
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
    for text in ("[", "[]", '{"schema": "other"}', '{"schema": "planner.plan/2", "uavs": 3}'):
        path.write_text(text)
        with pytest.raises(InputError, match=r"plan\.json: ") as caught:
            read_plan(path, figure3())
        assert "\n" not in str(caught.value)
    written(path, transit=True)
    path.write_text(path.read_text().replace('"AB"', '"ZZ"'))
    with pytest.raises(InputError, match="ZZ"):
        read_plan(path, figure3())


def test_the_file_alone_is_enough_to_export(tmp_path: Path) -> None:
    content = written(tmp_path / "plan.json", transit=True)
    assert content["sighted_at"] == "2026-05-01T14:05:00+02:00"
    assert content["network"]["sha256"] == figure3().sha256
    assert content["network"]["projection"] is None
    (uav,) = content["uavs"]
    assert (uav["altitude_m"], uav["speed_mps"], uav["max_flight_time_s"]) == (120.0, 100.0, None)
    assert uav["start"] == {"x_m": -30_000.0, "y_m": 0.0}
    assert uav["landing"] == {"x_m": 0.0, "y_m": 500.0}
    assert uav["waypoints"][-1][1:] == [0.0, 500.0]


def test_on_a_net_with_a_projection_places_have_degrees(tmp_path: Path) -> None:
    content = written(tmp_path / "plan.json", transit=True, projection=ON_EARTH)
    (uav,) = content["uavs"]
    time_s, x_m, y_m, lon, lat = uav["waypoints"][0]
    assert uav["start"] == {"x_m": x_m, "y_m": y_m, "lon": lon, "lat": lat}
    assert (time_s, len(str(lon).partition(".")[2])) == (0.0, 8)
    assert {len(point) for point in uav["waypoints"]} == {5}
    flat = read_plan(tmp_path / "plan.json", figure3()).plan.tracks[0]
    assert flat.x_m.tolist() == [point[1] for point in uav["waypoints"]]


def test_a_plan_of_schema_1_is_read() -> None:
    network = figure3()
    content = json.loads(OLD.read_text(encoding="utf-8"))
    assert content["schema"] == "planner.plan/1"
    stored = read_plan(OLD, network)
    track = stored.plan.tracks[0]
    rows = np.stack([track.time_s, track.x_m, track.y_m], axis=1).tolist()
    assert rows == content["uavs"][0]["waypoints"]
    assert stored.objective.horizon_s == content["planned"]["horizon_s"]


@pytest.mark.parametrize("targets", ["many", 0, -5, 2.5, True, None])
def test_a_forged_number_of_targets_is_refused(tmp_path: Path, targets: object) -> None:
    content = json.loads(OLD.read_text(encoding="utf-8"))
    content["evaluated"]["targets"] = targets
    (tmp_path / "plan.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"plan\.json: is no plan .*evaluated on .* targets"):
        read_plan(tmp_path / "plan.json", figure3())


@pytest.mark.parametrize("key", ["depart_s", "start_s", "end_s"])
@pytest.mark.parametrize("time_s", [None, "soon", [1.0], 1e300, -1e300])
def test_a_leg_when_nobody_flies_is_refused(tmp_path: Path, key: str, time_s: object) -> None:
    content = json.loads(OLD.read_text(encoding="utf-8"))
    content["uavs"][0]["legs"][0][key] = time_s
    (tmp_path / "plan.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"plan\.json: is no plan for this network"):
        read_plan(tmp_path / "plan.json", figure3())


def test_a_method_without_a_name_is_refused(tmp_path: Path) -> None:
    content = json.loads(OLD.read_text(encoding="utf-8")) | {"method": {"a": 1}}
    (tmp_path / "plan.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"plan\.json: .*the method is .* no name"):
        read_plan(tmp_path / "plan.json", figure3())


def test_a_plan_for_another_net_is_refused(tmp_path: Path) -> None:
    written(tmp_path / "plan.json", transit=True)
    other = replace(figure3(), sha256="0" * 64)
    with pytest.raises(InputError, match=r"plan\.json: is no plan for this network .*another one"):
        read_plan(tmp_path / "plan.json", other)


def put(*way: Any) -> Callable[[Any], None]:
    """The change of one value in a plan."""
    *keys, last, value = way

    def change(content: Any) -> None:
        for key in keys:
            content = content[key]
        content[last] = value

    return change


FORGED = {
    "another schema": put("schema", "planner.plan/1"),
    "a local time": put("sighted_at", "2026-05-01T14:05:00"),
    "no net": put("network", None),
    "a net without its digest": put("network", {"projection": None, "net_offset_m": [0, 0]}),
    "degrees without a projection": put(
        "uavs", 0, "start", dict.fromkeys(["x_m", "y_m", "lon", "lat"], 1)
    ),
    "lon alone": put("uavs", 0, "start", {"x_m": 0, "y_m": 0, "lon": 1}),
    "a waypoint in degrees": put("uavs", 0, "waypoints", 1, [0, 1, 2, 3, 4]),
    "a waypoint of two": put("uavs", 0, "waypoints", 1, [0, 1]),
    "a waypoint of texts": put("uavs", 0, "waypoints", 1, ["0", "1", "2"]),
    "no flight": put("uavs", []),
    "no speed": put("uavs", 0, "speed_mps", 0),
    "below the ground": put("uavs", 0, "altitude_m", -1),
    "a landing in words": put("uavs", 0, "landing", "start"),
    "a key of nobody's": put("uavs", 0, "camera", True),
    "a deadline beside a time": put("planned", "found_by_s", 5),
    "no deadline beside a probability": put("planned", "objective", "probability"),
    "more than certain": put("planned", "detection_probability", 1.5),
    "two bounds": put("certificate", {"lower_bound_s": 1, "upper_bound_probability": 1}),
}  # fmt: skip


@pytest.mark.parametrize("forged", FORGED)
def test_the_published_schema_refuses(tmp_path: Path, forged: str) -> None:
    content = json.loads(json.dumps(written(tmp_path / "plan.json", transit=True)))
    plan_schema.refuse(content)
    FORGED[forged](content)
    with pytest.raises(jsonschema.ValidationError):
        plan_schema.refuse(content)


def test_the_published_schema_asks_for_degrees_on_the_earth(tmp_path: Path) -> None:
    content = written(tmp_path / "plan.json", transit=True, projection=ON_EARTH)
    plan_schema.refuse(content)
    put("uavs", 0, "waypoints", 1, [0.0, 1.0, 2.0])(content)
    with pytest.raises(jsonschema.ValidationError):
        plan_schema.refuse(content)


def test_of_a_loop_the_way_tells_in_which_direction_it_was_flown(tmp_path: Path) -> None:
    square = [(2e3, 0.0), (2e3, 2e3), (0.0, 2e3)]
    nodes = {"A": (0.0, 0.0), "B": (-3e3, 0.0)}
    network, _ = drawn(nodes, {"AA": ("A", "A", square), "AB": ("A", "B", ())})
    uav = Uav(x_m=0.0, y_m=-500.0, take_off_s=0.0, speed_mps=100.0)
    somebody = physics_futures(network, [["AA"]], 0.0, 1.0)
    asked = Problem(network, somebody, uav, Sensor(200.0), Objective(3_600.0))
    for order in ([0, 2], [1, 2]):
        plan = plan_of_legs(asked, "by hand", order)
        evaluation = evaluate(plan.tracks, somebody, asked.sensor, asked.objective)
        figures = {"planned": evaluation, "evaluated": evaluation, "seed": 1}
        content = plan_content(plan, asked, **figures)
        write_plan(tmp_path / "plan.json", content)
        again = read_plan(tmp_path / "plan.json", network)
        assert [leg.leg for leg in again.plan.legs[0]] == order
