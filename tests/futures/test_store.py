"""Futures on disk: what is written is read, what is broken is told in one line."""

import shutil
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.parquet as pq
import pytest

from planner.belief.distribution import Listed, Normal, Uniform
from planner.belief.habits import Flees, Stops
from planner.belief.mixture import Mixture
from planner.belief.particles import Particles, Realisations
from planner.belief.prior import Prior, turn_probability
from planner.belief.recipe import Drawn, Given, OneTarget, Recipe
from planner.belief.stretches import Stretches
from planner.errors import InputError
from planner.futures import recording_name, store
from planner.futures.record import How, record
from planner.futures.recording_name import made_by
from planner.futures.store import (
    Request,
    describe,
    read_recording,
    recorded,
    recorded_in_turn,
    write_recording,
)
from planner.network.road_network import RoadNetwork
from support.instances import edge_of_knots, figure3, physics_futures
from support.sumo_instances import grid5x5, walkers


@pytest.fixture
def written(tmp_path: Path) -> tuple[Path, RoadNetwork]:
    network = grid5x5()
    particles = walkers(network, 5, np.random.default_rng(1), start="r0c0-r0c1", roads=3)
    futures = record(network, particles, horizon_s=1_500.0, workers=1)
    write_recording(tmp_path, futures, particles, network, describe(network, {"seed": 1}, 1.0))
    return tmp_path / "futures.parquet", network


def test_what_is_written_is_read(written: tuple[Path, RoadNetwork]) -> None:
    path, network = written
    particles = walkers(network, 5, np.random.default_rng(1), start="r0c0-r0c1", roads=3)
    recording = read_recording(path, network)
    expected = record(network, particles, horizon_s=1_500.0, workers=1)
    for column in ("time_s", "x_m", "y_m", "first_knot", "weight", "gone"):
        np.testing.assert_array_equal(
            getattr(recording.futures, column), getattr(expected, column), err_msg=column
        )
    for column in ("first_change", "time_s", "edge"):
        np.testing.assert_array_equal(
            getattr(recording.futures.edges, column), getattr(expected.edges, column)
        )
    assert recording.speed_mps == tuple(particles.speed_mps[particles.first_edge[:-1]])
    assert recording.route[2].split() == [network.edge_ids[e] for e in particles.route(2)]


def test_columns_types_and_metadata_are_as_promised(written: tuple[Path, RoadNetwork]) -> None:
    path, network = written
    schema = pq.read_schema(path)
    assert schema.names == ["particle", "time_s", "x_m", "y_m"]
    assert [str(schema.field(i).type) for i in range(4)] == ["int32", "double", "double", "double"]
    edges = pq.read_schema(path.with_name("edges.parquet"))
    assert edges.names == ["particle", "time_s", "edge"]
    assert [str(edges.field(i).type) for i in range(2)] == ["int32", "double"]
    assert pa.types.is_dictionary(edges.field("edge").type)
    assert edges.metadata == schema.metadata
    assert pq.read_schema(path.with_name("particles.parquet")).names == (
        ["particle", "weight", "target", "at_end", "depart_s", "speed_mps", "route", "seed"]
    )
    metadata = schema.metadata
    assert metadata[b"net_sha256"].decode() == network.sha256
    assert set(metadata) >= {b"schema", b"units", b"sumo_version", b"scenario", b"tolerance_m"}


def test_without_particles_weights_are_equal_and_all_stay(
    written: tuple[Path, RoadNetwork],
) -> None:
    path, network = written
    path.with_name("particles.parquet").unlink()
    futures = read_recording(path, network).futures
    np.testing.assert_array_equal(futures.weight, np.full(5, 0.2))
    assert not futures.gone.any()


def test_targets_are_read(written: tuple[Path, RoadNetwork]) -> None:
    path, network = written
    beside = path.with_name("particles.parquet")
    assert read_recording(path, network).futures.target.tolist() == [0] * 5
    changed(beside, "target", [0, 2, 1, 0, 2])
    assert read_recording(path, network).futures.target.tolist() == [0, 2, 1, 0, 2]
    for faulty in (-1, 0.5):
        changed(beside, "target", [0, 0, faulty, 0, 0])
        with pytest.raises(InputError, match="column 'target' must hold whole numbers"):
            read_recording(path, network)
    table = pq.read_table(beside)
    pq.write_table(table.drop_columns(["target"]), beside)
    assert read_recording(path, network).futures.target.tolist() == [0] * 5


def test_targets_are_recorded(tmp_path: Path) -> None:
    network = grid5x5()
    particles = walkers(network, 3, np.random.default_rng(1), start="r0c0-r0c1", roads=2)
    particles = replace(particles, target=np.array([2, 0, 1]))
    futures = record(network, particles, horizon_s=300.0, workers=1)
    write_recording(tmp_path, futures, particles, network, describe(network, {}, 1.0))
    again = read_recording(tmp_path / "futures.parquet", network).futures
    assert futures.target.tolist() == again.target.tolist() == [2, 0, 1]


def test_sumo_runs_once_per_belief(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    network = grid5x5()
    particles = walkers(network, 4, np.random.default_rng(2), start="r0c0-r0c1", roads=2)
    first = recorded(network, Given(particles, 900.0), scenario={"a": 1}, how=ALONE)
    assert (empty_cache / "futures").is_dir()
    monkeypatch.setattr(store, "record_in_turn", lambda *_, **__: pytest.fail("recorded again"))
    again = recorded(network, Given(particles, 900.0), scenario={"a": 1})
    np.testing.assert_array_equal(again.futures.time_s, first.futures.time_s)


def test_several_recordings_are_those_made_one_by_one(empty_cache: Path) -> None:
    network, rng = grid5x5(), np.random.default_rng(2)
    some = [walkers(network, many, rng, start="r0c0-r0c1", roads=2) for many in (3, 2, 4)]
    requests = [Request(Given(one, 900.0), {"of": len(one)}) for one in some]
    (alone,) = recorded_in_turn(network, requests[1:2], ALONE)
    right = files_of(alone)
    before = [*(empty_cache / "futures").iterdir()]
    several = [*recorded_in_turn(network, requests, ALONE)]
    assert [len(one.futures) for one in several] == [3, 2, 4]
    assert files_of(several[1]) == right
    assert len([*(empty_cache / "futures").iterdir()]) == len(before) + 2
    assert [*(empty_cache / "unfinished").iterdir()] == []


def files_of(made: store.Recording) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in made.path.parent.iterdir()}


def test_another_horizon_or_particle_is_recorded_anew(empty_cache: Path) -> None:
    network = grid5x5()
    rng = np.random.default_rng(3)
    one, other = (walkers(network, 2, rng, start="r0c0-r0c1", roads=2) for _ in range(2))
    ends = [
        recorded(network, Given(particles, horizon_s), scenario={}, how=ALONE).futures.end_s
        for particles, horizon_s in ((one, 300.0), (one, 600.0), (other, 600.0))
    ]
    assert ends[0].max() < ends[1].min()
    assert len(list((empty_cache / "futures").iterdir())) == 3


def test_another_tolerance_is_recorded_anew_and_stands_in_the_file(empty_cache: Path) -> None:
    network = grid5x5()
    particles = walkers(network, 2, np.random.default_rng(3), start="r0c0-r0c1", roads=2)
    said = []
    for tolerance_m in (None, 1.0, 7.5):
        how = How(tolerance_m, workers=1)
        made = recorded(network, Given(particles, 300.0), scenario={}, how=how)
        said.append((made.path, pq.read_schema(made.path).metadata[b"tolerance_m"]))
    assert said[0] == said[1]  # what holds on abstract nets
    assert [text for _, text in said[1:]] == [b"1.0", b"7.5"]
    assert len(list((empty_cache / "futures").iterdir())) == 2


ALONE = How(workers=1)


def drawn() -> Drawn:
    network = figure3()
    edges, turns = len(network.edge_ids), len(network.turn_edge)
    prior = Prior(
        edge_probability=np.full(edges, 1 / edges),
        distance_m=None,
        speed_mps=Uniform(15.0, 25.0),
        turn_probability=np.full(turns, 0.5),
        speed_per_road=False,
        driving="constant",
        gone=False,
        probability_present=1.0,
    )
    return Drawn(prior, 100, 900.0, 1, ("particles",))


# A value other than `drawn` has, for every field there is.
OTHER_DRAWN = {
    "prior": replace(drawn().prior, gone=True),
    "count": 101,
    "horizon_s": 901.0,
    "seed": 2,
    "stream": ("particles", 0),
    "sampling": "sobol",
    "realisations": Realisations(0, 8),
}
OTHER_PRIOR = {
    "edge_probability": np.roll(np.linspace(0, 1, len(figure3().edge_ids)), 1),
    "distance_m": Listed(np.zeros(1), np.ones(1)),
    "speed_mps": Uniform(15.0, np.nextafter(25.0, 26.0)),
    "turn_probability": np.linspace(0, 1, len(figure3().turn_edge)),
    "speed_per_road": True,
    "driving": "free",
    "gone": True,
    "probability_present": 0.5,
    "signals_known": True,
    "stretches": Stretches([0], [0.0], [1.0], [1.0]),
    "window_s": 1,
    "goals": Stretches([1], [0.0], [1.0], [1.0]),
    "stops": Stops(0.0, 1.0, 60.0),
    "flees": Flees(90.0, 1.3),
}
OTHER_TARGET = {
    "prior": replace(drawn().prior, driving="free"),
    "route": ["AB"],
    "speed_mps": 21.0,
    "offset_m": 1.0,
    "horizon_s": 901.0,
    "seed": 2,
    "stream": ("truth", 1),
    "realisations": Realisations(8, 8),
}
SPEEDS = [
    Uniform(15.0, 25.0),
    Uniform(14.0, 25.0),
    Normal(20.0, 2.0, 15.0, 25.0),
    Normal(21.0, 2.0, 15.0, 25.0),
    Normal(20.0, 3.0, 15.0, 25.0),
    Normal(20.0, 2.0, 14.0, 25.0),
    Normal(20.0, 2.0, 15.0, 26.0),
    Listed(np.array([15.0, 25.0]), np.array([0.5, 0.5])),
    Listed(np.array([15.0, 24.0]), np.array([0.5, 0.5])),
    Listed(np.array([15.0, 25.0]), np.array([0.4, 0.6])),
]


def key_of(recipe: Recipe, **described: str) -> str:
    return recording_name.recording_key(recipe, {"net_sha256": "a", **described})


@pytest.mark.parametrize("name", [field.name for field in fields(Drawn)])
def test_all_of_a_recipe_is_in_the_key(name: str) -> None:
    other = replace(drawn(), **{name: OTHER_DRAWN[name]})
    assert key_of(drawn()) == key_of(drawn()) != key_of(other)


@pytest.mark.parametrize("name", [field.name for field in fields(Prior)])
def test_all_of_a_prior_is_in_the_key(name: str) -> None:
    prior = replace(drawn().prior, **{name: OTHER_PRIOR[name]})
    assert key_of(replace(drawn(), prior=prior)) != key_of(drawn())


def test_all_of_a_mixture_is_in_the_key() -> None:
    prior, other = drawn().prior, replace(drawn().prior, window_s=1)
    parts = [(0.5, prior, prior), (0.5, prior, replace(prior, gone=True)), (0.4, prior, prior)]
    parts.append((0.5, other, other))
    mixtures = [Mixture(np.array([p, 1 - p]), (one, two)) for p, one, two in parts]
    keys = {key_of(replace(drawn(), prior=mixture)) for mixture in mixtures}
    assert len(keys) == len(mixtures)


@pytest.mark.parametrize("name", [field.name for field in fields(OneTarget)])
def test_all_of_a_given_target_is_in_the_key(name: str) -> None:
    target = OneTarget(drawn().prior, ["AB", "BC"], 20.0, 0.0, 900.0, 1, ("truth",))
    assert key_of(replace(target, **{name: OTHER_TARGET[name]})) != key_of(target)


@pytest.mark.parametrize("name", [field.name for field in fields(Particles)])
def test_all_of_given_particles_is_in_the_key(name: str) -> None:
    network = figure3()
    particles = drawn().particles(network)
    column = getattr(particles, name)
    value = "free" if name == "driving" else np.concatenate((column[:-1], column[-1:] + 1))
    if name == "first_edge":  # one route ends where the next one begins
        value = column + np.where(np.arange(len(column)) == 1, 1, 0)
    if name == "gone":
        value = ~column
    if name in ("stop_s", "end_m"):
        value = np.full(len(column), 1.0)
    other = replace(particles, **{name: value})
    assert key_of(Given(other, 900.0)) != key_of(Given(particles, 900.0))
    assert key_of(Given(particles, 901.0)) != key_of(Given(particles, 900.0))


def test_all_of_a_distribution_is_in_the_key() -> None:
    for part in ("speed_mps", "distance_m"):
        priors = [replace(drawn().prior, **{part: values}) for values in SPEEDS]
        assert len({key_of(replace(drawn(), prior=prior)) for prior in priors}) == len(SPEEDS)


def test_the_net_and_the_program_are_in_the_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert key_of(drawn(), net_sha256="b") != key_of(drawn())
    assert key_of(drawn(), sumo_version="2.0") != key_of(drawn())
    described = describe(figure3(), {"seed": 1}, 1.0)
    assert {"net_sha256", "sumo_version", "scenario", "tolerance_m"} <= set(described)
    known = {made_by(recording_name.PACKAGE)}
    for file in (
        "arrays.py",
        "belief/sampling.py",
        "futures/kernels/thinning.py",
        "network/road_network.py",
        "streams.py",
    ):
        copy = tmp_path / file.replace("/", "-")
        shutil.copytree(recording_name.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
        assert made_by(copy) in known  # wherever it lies
        other = tmp_path / f"{copy.name}-changed"
        copy.rename(other)
        (other / file).write_text((other / file).read_text() + "#")
        assert made_by(other) not in known
        known.add(made_by(other))
    assert {name for name, _ in (one.split() for one in made_by(recording_name.PACKAGE)[1:])} == {
        "numpy",
        "scipy",
    }
    before = key_of(drawn())
    made_by.cache_clear()
    monkeypatch.setattr(recording_name, "version_of", lambda name: f"{name}-99")
    assert key_of(drawn()) != before
    made_by.cache_clear()


def test_what_has_no_text_is_no_recipe() -> None:
    with pytest.raises(TypeError, match="no place in a recipe"):
        key_of(replace(drawn(), prior=object()))  # type: ignore[arg-type]


def test_nothing_is_drawn_that_is_recorded(
    empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = grid5x5()
    edges = np.zeros(len(network.edge_ids))
    edges[0] = 1.0
    turns = turn_probability(network, {})
    prior = replace(drawn().prior, edge_probability=edges, turn_probability=turns)
    recipe = replace(drawn(), prior=prior, count=3)
    made = recorded(network, recipe, scenario={}, how=ALONE)
    monkeypatch.setattr(Drawn, "particles", lambda *_: pytest.fail("drawn again"))
    again = recorded(network, recipe, scenario={})
    np.testing.assert_array_equal(again.futures.time_s, made.futures.time_s)


def changed(path: Path, name: str, values: list[object]) -> None:
    table = pq.read_table(path)
    place = table.column_names.index(name)
    pq.write_table(table.set_column(place, name, pa.array(values)), path)


def test_broken_files_are_told_in_one_line(written: tuple[Path, RoadNetwork]) -> None:
    path, network = written
    rows = len(pq.read_table(path))
    times = pq.read_table(path)["time_s"].to_pylist()
    numbers = pq.read_table(path)["particle"].to_pylist()
    beside, edges = path.with_name("particles.parquet"), path.with_name("edges.parquet")
    changes = pq.read_table(edges)
    faults = [
        (path, "time_s", [float("nan"), *times[1:]], "NaN"),
        (path, "time_s", times[::-1], "sorted"),
        (path, "x_m", ["east"] * rows, "numbers"),
        (edges, "edge", ["nowhere"] * len(changes), "'nowhere'"),
        (edges, "time_s", [1.0] * len(changes), "comes onto edges at 1 and 1 s"),
        (edges, "time_s", [None] * len(changes), "null"),
        (edges, "particle", [None] * len(changes), "holds no name"),
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
    assert (read.edges.at(60.0) == -1).all()
    assert len(read.edges.time_s) == 0


def test_a_column_of_edges_is_read_and_goes_before_the_file_beside(
    written: tuple[Path, RoadNetwork],
) -> None:
    path, network = written
    futures = read_recording(path, network).futures
    of_knots = [network.edge_ids[edge] for edge in edge_of_knots(futures)]
    other = [edge if edge != of_knots[0] else None for edge in of_knots]
    table = pq.read_table(path)
    for column in (of_knots, other):
        pq.write_table(table.append_column("edge", pa.array(column)), path)
        read = read_recording(path, network).futures
        index = [-1 if edge is None else network.edge_index[edge] for edge in column]
        assert edge_of_knots(read).tolist() == index


def test_edges_are_read_by_name_in_any_order(written: tuple[Path, RoadNetwork]) -> None:
    path, network = written
    whole = read_recording(path, network).futures
    beside = path.with_name("edges.parquet")
    table = pq.read_table(beside)
    pq.write_table(table.take(np.random.default_rng(1).permutation(len(table))), beside)
    np.testing.assert_array_equal(
        edge_of_knots(read_recording(path, network).futures), edge_of_knots(whole)
    )
    knots = pq.read_table(path)
    pq.write_table(knots.filter(pa.compute.field("particle") > 1), path)
    some = read_recording(path, network).futures
    assert edge_of_knots(some).tolist() == edge_of_knots(whole.take(np.arange(2, 5))).tolist()
    beside.unlink()
    assert set(edge_of_knots(read_recording(path, network).futures)) == {-1}
