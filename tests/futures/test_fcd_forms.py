"""All forms in which SUMO itself writes the same drive are the same futures."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.futures.futures import Futures
from planner.futures.store import read_recording
from planner.network.build import build_net
from planner.network.read import read_net
from planner.network.road_network import RoadNetwork
from planner.network.sumo import binary, sumo_environment
from support.instances import edge_of_knots
from support.sumo_instances import grid5x5, town

NODES = "".join(
    f'<node id="{name}" x="{x}" y="{y}"/>'
    for name, x, y in (("a", 0, 0), ("b", 900, 0), ("c", 900, 700), ("d", 0, 700))
)
EDGES = "".join(
    f'<edge id="{one}{two}" from="{one}" to="{two}" numLanes="1" speed="14" {more}/>'
    for one, two, more in (
        ("a", "b", 'allow="passenger pedestrian"'),
        ("b", "c", 'allow="passenger"'),
        ("a", "c", 'allow="bicycle"'),
        ("c", "d", 'allow="passenger bicycle"'),
    )
)
ROUTES = """<routes>
<vType id="car" sigma="0" speedFactor="1" speedDev="0" maxSpeed="12"/>
<vType id="bike" vClass="bicycle"/>
{more}
<vehicle id="v" type="car" depart="5" departSpeed="max"><route edges="ab bc cd"/></vehicle>
<vehicle id="w" type="car" depart="20" departSpeed="max"><route edges="ab bc"/></vehicle>
</routes>"""
PEOPLE = """<person id="p" depart="0"><walk edges="ab"/></person>
<container id="k" depart="0"><tranship edges="ab" speed="1"/></container>"""
BIKES = """<vehicle id="only" type="bike" depart="0"><route edges="ac"/></vehicle>
<vehicle id="both" type="bike" depart="1"><route edges="ac cd"/></vehicle>"""


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> RoadNetwork:
    folder = tmp_path_factory.mktemp("block")
    (folder / "b.nod.xml").write_text(f"<nodes>{NODES}</nodes>")
    (folder / "b.edg.xml").write_text(f"<edges>{EDGES}</edges>")
    return read_net(build_net(folder / "b.nod.xml", folder / "b.edg.xml", abstract=False))


def recorded(
    network: RoadNetwork, folder: Path, name: str, *options: str, more: str = ""
) -> Futures:
    (folder / "r.rou.xml").write_text(ROUTES.format(more=more))
    sumo_environment()
    fixed = ["-n", str(network.path), "-r", "r.rou.xml", "--fcd-output", name, "--no-step-log"]
    subprocess.run([binary("sumo"), *fixed, *options], cwd=folder, check=True, capture_output=True)
    return read_recording(folder / name, network).futures


def same(one: Futures, other: Futures, off_m: float) -> None:
    assert len(one) == len(other)
    for time_s in (0.0, 6.0, 30.0, 77.5, 100.0, 110.3, 1e6):
        np.testing.assert_allclose(one.positions(time_s), other.positions(time_s), atol=off_m)


FORMS = [
    ("f.xml", ()),
    ("f.xml.gz", ()),
    ("f.csv", ()),
    ("f.csv.gz", ()),
    ("f.parquet", ("--human-readable-time",)),
    ("f.xml", ("--human-readable-time",)),
    ("f.csv", ("--human-readable-time",)),
    ("f.csv", ("--fcd-output.attributes", "x,y,lane,pos,speed")),
    ("f.parquet", ("--fcd-output.attributes", "all")),
]


@pytest.mark.parametrize(("name", "options"), FORMS)
def test_the_same_drive(
    block: RoadNetwork, tmp_path: Path, name: str, options: tuple[str, ...],
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    plain = recorded(block, tmp_path, "plain.parquet")
    same(recorded(block, tmp_path, name, *options), plain, 0.05)
    assert caplog.text == ""


@pytest.mark.parametrize("name", ["f.xml", "f.csv", "f.parquet"])
def test_less_is_read_and_never_far_off(block: RoadNetwork, tmp_path: Path, name: str) -> None:
    plain = recorded(block, tmp_path, "plain.parquet")
    same(recorded(block, tmp_path, name, "--fcd-output.attributes", "x,y"), plain, 2.0)
    same(recorded(block, tmp_path, name, "--device.fcd.period", "5"), plain, 60.0)  # not to the end


def test_days_are_read(block: RoadNetwork, tmp_path: Path) -> None:
    late = ROUTES.format(more="").replace('depart="5"', 'depart="90005"')
    path = tmp_path / "late.rou.xml"
    path.write_text(late.replace('depart="20"', 'depart="90020"'))
    plain = recorded(block, tmp_path, "plain.parquet")
    options = ["--human-readable-time", "--begin", "90000", "--no-step-log"]
    fixed = ["-n", str(block.path), "-r", "late.rou.xml", "--fcd-output", "day.xml"]
    sumo_environment()
    subprocess.run(
        [binary("sumo"), *fixed, *options], cwd=tmp_path, check=True, capture_output=True
    )
    assert '"1:01:00:05"' in (tmp_path / "day.xml").read_text()
    same(read_recording(tmp_path / "day.xml", block, begin_s=90_000.0).futures, plain, 0.05)


@pytest.mark.parametrize("name", ["f.xml", "f.csv", "f.parquet"])
def test_people_are_left_out_with_a_line(
    block: RoadNetwork, tmp_path: Path, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    plain = recorded(block, tmp_path, "plain.parquet")
    same(recorded(block, tmp_path, name, more=PEOPLE), plain, 0.05)
    said = [record.getMessage() for record in caplog.records]
    assert said == [
        f"{tmp_path / name}: left out: persons and containers, which are no vehicles (2, the "
        "first 'k')"
    ]


@pytest.mark.parametrize("name", ["f.xml", "f.csv", "f.parquet"])
def test_edges_that_are_not_for_cars(
    block: RoadNetwork, tmp_path: Path, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    futures = recorded(block, tmp_path, name, more=BIKES)
    assert len(futures) == 3  # v, w and the bicycle that comes onto a road for cars
    assert "edges only that are not for cars (1 of 4, the first 'only')" in caplog.text
    assert "drive on others too (1 of 4, the first 'both')" in caplog.text
    edges = {int(edge) for edge in edge_of_knots(futures)}
    assert edges == {-1, *(block.edge_index[name] for name in ("ab", "bc", "cd"))}


@pytest.mark.parametrize("name", ["f.xml", "f.csv", "f.parquet"])
def test_meso_is_read_by_edge(
    block: RoadNetwork, tmp_path: Path, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    more = "" if name == "f.csv" else PEOPLE
    futures = recorded(block, tmp_path, name, "--mesosim", "--begin", "5", more=more)
    assert len(futures) == 2
    edges = [block.edge_ids[edge] for edge in edge_of_knots(futures)[: futures.first_knot[1]]]
    assert list(dict.fromkeys(edges)) == ["ab", "bc", "cd"]
    # It is known to be somewhere on 100 m.
    assert futures.xy(0, 40.0)[0] == pytest.approx(12 * 35.0, abs=20.0)
    moved_m = np.hypot(np.diff(futures.x_m), np.diff(futures.y_m))[: futures.first_knot[1] - 1]
    assert (moved_m / np.diff(futures.time_s)[: len(moved_m)]).max() < 16.0


def test_another_net_is_told_by_name(block: RoadNetwork, tmp_path: Path) -> None:
    recorded(block, tmp_path, "f.xml")
    for other in (town(), grid5x5()):
        with pytest.raises(InputError, match="edge 'ab' is not in the scenario's net"):
            read_recording(tmp_path / "f.xml", other)
    (tmp_path / "f.csv").write_text("timestep_time;vehicle_id\n0;a\n")
    with pytest.raises(InputError, match="has no column 'vehicle_x'; it has timestep_time, vehi"):
        read_recording(tmp_path / "f.csv", block)
    (tmp_path / "f.csv").write_text("timestep_time;vehicle_id;vehicle_x;vehicle_y\n0;a;1;b\n")
    with pytest.raises(InputError, match=r"is no floating car data .*'b'") as caught:
        read_recording(tmp_path / "f.csv", block)
    assert "\n" not in str(caught.value)
