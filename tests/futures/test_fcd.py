"""Floating car data that the bare sumo program wrote becomes the same futures."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from planner.errors import InputError
from planner.futures.edges_driven import NO_EDGE
from planner.futures.fcd import read_samples
from planner.futures.store import read_recording
from planner.network.road_network import RoadNetwork
from planner.network.sumo import binary, sumo_environment
from support.instances import edge_of_knots
from support.sumo_instances import grid5x5, town

ROUTES = """<routes><vType id="t" sigma="0" speedFactor="1" speedDev="0" maxSpeed="{speed}"/>
<vehicle id="late" type="t" depart="30" departSpeed="desired"><route edges="{a}"/></vehicle>
<vehicle id="later" type="t" depart="60" departSpeed="desired"><route edges="{b}"/></vehicle>
</routes>"""


def sumo_fcd(network: RoadNetwork, folder: Path, name: str, *, step_s: float = 1.0) -> Path:
    routes = {"a": "r0c0-r0c1 r0c1-r0c2", "b": "r0c0-r1c0", "speed": 25}
    if "r0c0-r0c1" not in network.edge_index:
        routes = {"a": "nw-n n-centre centre-s", "b": "w-sw sw-s", "speed": 12}
    (folder / "two.rou.xml").write_text(ROUTES.format(**routes))
    sumo_environment()
    options = ["--fcd-output", name, "--step-length", str(step_s)]
    subprocess.run(
        [binary("sumo"), "-n", network.path, "-r", "two.rou.xml", *options, "--no-step-log"],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    return folder / name


def test_xml_and_parquet_give_the_same_futures(tmp_path: Path) -> None:
    network = town()
    futures = [
        read_recording(sumo_fcd(network, tmp_path, name), network).futures
        for name in ("fcd.xml", "fcd.xml.gz", "fcd.parquet")
    ]
    for other in futures[1:]:
        # SUMO writes whole centimetres as XML and all digits as Parquet.
        np.testing.assert_allclose(futures[0].time_s, other.time_s, atol=1e-3)
        np.testing.assert_allclose(futures[0].x_m, other.x_m, atol=0.01)
        np.testing.assert_array_equal(edge_of_knots(futures[0]), edge_of_knots(other))


def test_a_vehicle_is_nowhere_before_it_departs_and_rests_where_it_was_last_seen(
    tmp_path: Path,
) -> None:
    network = grid5x5()
    futures = read_recording(sumo_fcd(network, tmp_path, "fcd.parquet"), network).futures
    assert futures.time_s[futures.first_knot[:-1]].tolist() == [30.0, 60.0]
    assert np.isnan(futures.xy(0, 29.0)).all()
    assert futures.xy(0, 1e6)[0] == pytest.approx(30_000.0, abs=30.0)


def test_ten_second_samples_do_not_cut_the_corner(tmp_path: Path) -> None:
    network = grid5x5()
    path = sumo_fcd(network, tmp_path, "fcd.parquet", step_s=10.0)
    futures = read_recording(path, network).futures
    knots = slice(futures.first_knot[0], futures.first_knot[1])
    node = network.node_xy_m[network.node_index["r0c1"]]
    off = np.hypot(futures.x_m[knots] - node[0], futures.y_m[knots] - node[1])
    assert off.min() < 1.0


def test_what_is_no_fcd_is_told_in_one_line(tmp_path: Path) -> None:
    network = grid5x5()
    (tmp_path / "a.xml").write_text("<fcd-export><timestep time=")
    (tmp_path / "b.xml").write_text("<fcd-export></fcd-export>")
    (tmp_path / "c.xml").write_text(
        '<fcd-export><timestep time="0"><vehicle id="v" x="a" y="0"/></timestep></fcd-export>'
    )
    for name in "abc":
        with pytest.raises(InputError, match=rf"{name}\.xml: .*--fcd-output") as caught:
            read_recording(tmp_path / f"{name}.xml", network)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="is not in"):
        read_recording(sumo_fcd(town(), tmp_path, "town.xml"), network)


def test_nulls_are_unknown(tmp_path: Path) -> None:
    network = grid5x5()
    path = tmp_path / "some.parquet"
    columns = {
        "timestep_time": [0, 1, 2],
        "vehicle_id": ["v", "v", None],
        "vehicle_x": [5.0, 6.0, None],
        "vehicle_y": [0.0, 0.0, None],
        "vehicle_speed": [None, 1.5, None],
        "vehicle_pos": [5.0, None, None],
        "vehicle_lane": ["r0c0-r0c1_0", None, None],
    }
    pyarrow.parquet.write_table(pyarrow.table(columns), path)
    samples = read_samples(path, network)
    assert samples.time_s.tolist() == [0.0, 1.0]
    np.testing.assert_array_equal(samples.speed_mps, [np.nan, 1.5])
    np.testing.assert_array_equal(samples.along_m, [5.0, np.nan])
    assert samples.edge.tolist() == [network.edge_index["r0c0-r0c1"], NO_EDGE]


def test_pandas_is_not_loaded(tmp_path: Path) -> None:
    network = town()
    path = sumo_fcd(network, tmp_path, "fcd.parquet")
    code = f"""
import sys
from pathlib import Path
from planner.futures.fcd import read_samples
from planner.network.read import read_net
read_samples(Path({str(path)!r}), read_net(Path({str(network.path)!r})))
sys.exit("pandas" in sys.modules)
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
