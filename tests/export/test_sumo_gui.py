"""The plan as sumo-gui shows it."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import shapely
from lxml import etree

from planner.clock import clock
from planner.errors import OutputError
from planner.export.sumo_gui import write_overlay
from planner.flight.airspace import Airspace
from planner.flight.pieces import along, pieces
from planner.flight.plan import Plan
from planner.network.sumo import binary, sumo_home
from planner.search.plan import plan_of_legs, plan_of_wait, plan_of_waypoints
from support.grid_instance import grid_futures, grid_problem
from support.instances import figure3

PROBLEM = grid_problem(grid_futures(3, np.random.default_rng(1)), distance_m=60000.0)


@pytest.fixture(scope="module")
def schema() -> etree.XMLSchema:
    return etree.XMLSchema(etree.parse(str(sumo_home() / "data" / "xsd" / "additional_file.xsd")))


def shapes(tree: etree._ElementTree, kind: str) -> list[list[list[float]]]:
    return [
        [[float(number) for number in point.split(",")] for point in line.get("shape").split()]
        for line in tree.iter("poly")
        if line.get("type") == kind
    ]


@pytest.mark.parametrize(
    "plan",
    [
        plan_of_legs(PROBLEM, "greedy", [0, 3, 40]),
        plan_of_legs(PROBLEM, "greedy", []),
        plan_of_wait(PROBLEM, "wait", 75000.0, -75000.0),
    ],
    ids=["legs", "no legs", "wait"],
)
def test_it_is_valid_by_sumo_s_schema(tmp_path: Path, schema: etree.XMLSchema, plan: Plan) -> None:
    write_overlay(tmp_path / "plan.add.xml", plan, PROBLEM.network)
    schema.assertValid(etree.parse(str(tmp_path / "plan.add.xml")))


def test_the_schema_would_object(schema: etree.XMLSchema) -> None:
    assert not schema.validate(etree.fromstring('<additional><poly id="a"/></additional>'))


def test_lines_follow_the_flight(tmp_path: Path) -> None:
    network = figure3()
    problem = PROBLEM.replace(network=network)
    order = [network.road_ids.index("AB") * 2, network.road_ids.index("CE") * 2 + 1]
    write_overlay(tmp_path / "p.add.xml", plan_of_legs(problem, "greedy", order), network)
    tree = etree.parse(str(tmp_path / "p.add.xml"))
    away_m = 60000 / np.sqrt(2)
    assert shapes(tree, "road") == [[[0, 0], [5000, 0]], [[15000, 8000], [10000, 4000]]]
    ways = np.array(shapes(tree, "way"))
    assert np.allclose(ways, [[[-away_m, away_m], [0, 0]], [[5000, 0], [15000, 8000]]], atol=0.01)
    numbers = {
        poi.get("name"): (float(poi.get("x")), float(poi.get("y"))) for poi in tree.iter("poi")
    }
    assert numbers["1"] == (2500, 0)
    assert numbers["2"] == (12500, 6000)
    times = [float(param.get("value")) for param in tree.iter("param") if "_s" in param.get("key")]
    flown = np.cumsum([600, 50, np.hypot(100, 80), np.hypot(50, 40)])
    assert np.allclose(times, np.repeat([0, *flown], [1, 2, 2, 2, 1]), atol=0.01)


def test_arrows_point_ahead(tmp_path: Path) -> None:
    network = figure3()
    order = [network.road_ids.index("AB") * 2, network.road_ids.index("CE") * 2 + 1]
    plan = plan_of_legs(PROBLEM.replace(network=network), "greedy", order)
    write_overlay(tmp_path / "p.add.xml", plan, network)
    arrows = np.array(shapes(etree.parse(str(tmp_path / "p.add.xml")), "direction"))
    flown = pieces(plan)
    assert len(arrows) == len(flown) == 4
    for piece, (tip, *tail) in zip(flown, arrows, strict=True):
        (first, last), ahead = piece.xy_m[[0, -1]], tip - np.mean(tail, axis=0)
        assert np.allclose(tip, first + 0.8 * (last - first), atol=0.01)
        assert np.allclose(ahead / np.linalg.norm(ahead), along(piece.xy_m, 0.8)[1], atol=1e-3)


def test_off_the_roads_clocks_stand_where_there_is_room(tmp_path: Path) -> None:
    start = (PROBLEM.uav.x_m, PROBLEM.uav.y_m)
    there_and_back = [start, (0.0, 0.0), (5.0, 0.0), (10.0, 0.0), start]
    stops = np.column_stack([there_and_back, np.zeros(5)])
    plan = plan_of_waypoints(PROBLEM, "spiral", stops)
    write_overlay(tmp_path / "p.add.xml", plan, PROBLEM.network)
    tree = etree.parse(str(tmp_path / "p.add.xml"))
    assert len(shapes(tree, "way")) == 4
    assert len(shapes(tree, "direction")) == 2
    first, near = tree.xpath("//poi[@type='time']")  # of the way back the middle is taken
    times_s = plan.tracks[0].time_s
    assert first.xpath("param/@value") == [clock(times_s[:2].mean())]
    assert near.xpath("param/@value") == [clock(times_s[1:3].mean())]
    assert float(first.get("x")) == pytest.approx(start[0] / 2, abs=0.01)
    assert float(near.get("x")) == pytest.approx(2.5)


def test_areas_are_outlines(tmp_path: Path, schema: etree.XMLSchema) -> None:
    hole = shapely.box(0, 0, 90, 90).difference(shapely.box(40, 40, 50, 50))
    airspace = Airspace(no_fly=shapely.union_all([hole, shapely.box(200, 0, 210, 10)]))
    plan = plan_of_legs(PROBLEM, "greedy", [0])
    write_overlay(tmp_path / "p.add.xml", plan, PROBLEM.network, airspace)
    tree = etree.parse(str(tmp_path / "p.add.xml"))
    schema.assertValid(tree)
    areas = sorted(shapely.Polygon(shape).area for shape in shapes(tree, "no_fly"))
    assert areas == [100, 100, 8100]


def test_sumo_loads_it(tmp_path: Path) -> None:
    """The bare program reads the overlay beside a net of its own making."""
    write_overlay(tmp_path / "p.add.xml", plan_of_legs(PROBLEM, "greedy", [0, 3]), PROBLEM.network)
    net = tmp_path / "any.net.xml"
    environment = {**os.environ, "SUMO_HOME": str(sumo_home())}  # where its schemas lie
    generate = [str(binary("netgenerate")), "--grid", "--grid.number=2", f"-o={net}"]
    subprocess.run(generate, check=True, capture_output=True, env=environment)
    run = [str(binary("sumo")), f"-n={net}", f"-a={tmp_path / 'p.add.xml'}", "--end=1"]
    run += ["--xml-validation=always"]
    done = subprocess.run(run, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write_overlay(
            tmp_path / "file" / "p.add.xml",
            plan_of_legs(PROBLEM, "greedy", [0]),
            PROBLEM.network,
        )
