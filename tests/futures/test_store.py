"""Futures on disk: what is written is read, what is broken is told in one line."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from planner.errors import InputError
from planner.futures import store
from planner.futures.record import record
from planner.futures.store import describe, read_recording, recorded, write_recording
from planner.network.road_network import RoadNetwork
from support.instances import figure3, physics_futures
from support.sumo_instances import grid5x5, walkers


@pytest.fixture
def written(tmp_path: Path) -> tuple[Path, RoadNetwork]:
    network = grid5x5()
    particles = walkers(network, 5, np.random.default_rng(1), start="r0c0-r0c1", roads=3)
    futures = record(network, particles, horizon_s=1_500.0, workers=1)
    write_recording(tmp_path, futures, particles, network, describe(network, {"seed": 1}))
    return tmp_path / "futures.parquet", network


def test_what_is_written_is_read(written: tuple[Path, RoadNetwork]) -> None:
    path, network = written
    particles = walkers(network, 5, np.random.default_rng(1), start="r0c0-r0c1", roads=3)
    recording = read_recording(path, network)
    expected = record(network, particles, horizon_s=1_500.0, workers=1)
    for column in ("time_s", "x_m", "y_m", "edge", "first_knot", "weight", "gone"):
        np.testing.assert_array_equal(
            getattr(recording.futures, column), getattr(expected, column), err_msg=column
        )
    assert recording.speed_mps == tuple(particles.speed_mps[particles.first_edge[:-1]])
    assert recording.route[2].split() == [network.edge_ids[e] for e in particles.route(2)]


def test_columns_types_and_metadata_are_as_promised(written: tuple[Path, RoadNetwork]) -> None:
    path, network = written
    schema = pq.read_schema(path)
    assert schema.names == ["particle", "time_s", "x_m", "y_m", "edge"]
    assert [str(schema.field(i).type) for i in range(4)] == ["int32", "double", "double", "double"]
    assert pa.types.is_dictionary(schema.field("edge").type)
    assert pq.read_schema(path.with_name("particles.parquet")).names == (
        ["particle", "weight", "target", "at_end", "depart_s", "speed_mps", "route", "seed"]
    )
    metadata = schema.metadata
    assert metadata[b"net_sha256"].decode() == network.sha256
    assert set(metadata) >= {b"schema", b"units", b"sumo_version", b"scenario"}


def test_without_particles_weights_are_equal_and_all_stay(
    written: tuple[Path, RoadNetwork],
) -> None:
    path, network = written
    path.with_name("particles.parquet").unlink()
    futures = read_recording(path, network).futures
    np.testing.assert_array_equal(futures.weight, np.full(5, 0.2))
    assert not futures.gone.any()


def test_sumo_runs_once_per_belief(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    network = grid5x5()
    particles = walkers(network, 4, np.random.default_rng(2), start="r0c0-r0c1", roads=2)
    first = recorded(network, particles, horizon_s=900.0, scenario={"a": 1}, workers=1)
    assert (empty_cache / "futures").is_dir()
    monkeypatch.setattr(store, "record", lambda *_, **__: pytest.fail("recorded again"))
    again = recorded(network, particles, horizon_s=900.0, scenario={"a": 1})
    np.testing.assert_array_equal(again.futures.time_s, first.futures.time_s)


def test_another_horizon_or_particle_is_recorded_anew(empty_cache: Path) -> None:
    network = grid5x5()
    rng = np.random.default_rng(3)
    one, other = (walkers(network, 2, rng, start="r0c0-r0c1", roads=2) for _ in range(2))
    ends = [
        recorded(network, particles, horizon_s=horizon_s, scenario={}, workers=1).futures.end_s
        for particles, horizon_s in ((one, 300.0), (one, 600.0), (other, 600.0))
    ]
    assert ends[0].max() < ends[1].min()
    assert len(list((empty_cache / "futures").iterdir())) == 3


def changed(path: Path, name: str, values: list[object]) -> None:
    table = pq.read_table(path)
    place = table.column_names.index(name)
    pq.write_table(table.set_column(place, name, pa.array(values)), path)


def test_broken_files_are_told_in_one_line(written: tuple[Path, RoadNetwork]) -> None:
    path, network = written
    rows = len(pq.read_table(path))
    times = pq.read_table(path)["time_s"].to_pylist()
    numbers = pq.read_table(path)["particle"].to_pylist()
    beside = path.with_name("particles.parquet")
    faults = [
        (path, "time_s", [float("nan"), *times[1:]], "NaN"),
        (path, "time_s", times[::-1], "sorted"),
        (path, "x_m", ["east"] * rows, "numbers"),
        (path, "edge", ["nowhere"] * rows, "'nowhere'"),
        (path, "particle", [*numbers[:-1], 7], "particle 7"),
        (beside, "weight", [0.5] * 5, "sum to 2.5"),
        (beside, "at_end", ["leaves"] * 5, "at_end"),
    ]
    for file, name, values, told in faults:
        content = file.read_bytes()
        changed(file, name, values)
        with pytest.raises(InputError, match=told) as caught:
            read_recording(path, network)
        assert "\n" not in str(caught.value)
        assert file.name in str(caught.value)
        file.write_bytes(content)
    read_recording(path, network)


def test_files_that_are_none(tmp_path: Path) -> None:
    network = figure3()
    with pytest.raises(InputError, match="no such file"):
        read_recording(tmp_path / "futures.parquet", network)
    (tmp_path / "futures.parquet").write_text("knots")
    with pytest.raises(InputError, match="no readable Parquet"):
        read_recording(tmp_path / "futures.parquet", network)
    empty = {"particle": [], "time_s": [], "x_m": [], "y_m": []}
    pq.write_table(pa.table(empty), tmp_path / "futures.parquet")
    with pytest.raises(InputError, match="no row"):
        read_recording(tmp_path / "futures.parquet", network)


def test_futures_from_elsewhere_need_no_edges(tmp_path: Path) -> None:
    network = figure3()
    futures = physics_futures(network, [["AB", "BC"]], [0.0], [10.0], horizon_s=1e4, gone=False)
    columns = {
        "particle": np.zeros(len(futures.time_s), dtype=int),
        "time_s": futures.time_s,
        "x_m": futures.x_m,
        "y_m": futures.y_m,
    }
    pq.write_table(pa.table(columns), tmp_path / "mine.parquet")
    read = read_recording(tmp_path / "mine.parquet", network).futures
    np.testing.assert_array_equal(read.x_m, futures.x_m)
    assert (read.edge == -1).all()
