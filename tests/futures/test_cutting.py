"""Recordings cut from larger ones against recordings made anew: the same, byte for byte."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.belief.distribution import Uniform
from planner.belief.habits import Flees, Stops
from planner.belief.mixture import Mixture
from planner.belief.prior import Prior, turn_probability
from planner.belief.recipe import Drawn
from planner.belief.ways import quiet_streets
from planner.futures import store, workers
from planner.futures.answers import KNOT_EVERY_S
from planner.futures.cutting import siblings_of
from planner.futures.futures import Futures
from planner.futures.record import (
    SESSION,
    How,
    Wanted,
    record,
    record_in_turn,
    session_of,
)
from planner.futures.rides import Ride, drive_session
from planner.futures.store import Recording, recorded
from planner.futures.workers import in_processes
from planner.mission.opening import OpenScenario
from planner.network.road_network import RoadNetwork
from support.sumo_instances import grid5x5, town

ALONE = How(workers=1)


def recipe(network: RoadNetwork, count: int, horizon_s: float) -> Drawn:
    """Particles of which some arrive at a dead end, and some ride at the speed drawn for them."""
    turns = {"n-ne": {"ne-e": 1.0}} if "n-ne" in network.edge_index else {}
    prior = Prior(
        edge_probability=network.edge_length_m / network.edge_length_m.sum(),
        distance_m=None,
        speed_mps=Uniform(5.0, 14.0),
        turn_probability=turn_probability(network, turns),
        speed_per_road=False,
        driving="free",
        gone=True,
        probability_present=0.75,
    )
    return Drawn(prior, count, horizon_s, 1, ("particles",), "sobol")


def files(made: Recording) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(made.path.parent.iterdir())}


def made(some: Drawn, network: RoadNetwork) -> Recording:
    described = {"horizon_s": some.horizon_s, "seed": some.seed}
    return recorded(network, some, scenario=described, how=ALONE)


def anew(some: Drawn, network: RoadNetwork, folder: Path) -> dict[str, bytes]:
    """Return the files of a recording made in a cache of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PLANNER_CACHE", str(folder))
        return files(made(some, network))


def undriven(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(workers, "in_parts", lambda *_, **__: pytest.fail("recorded again"))


@pytest.mark.parametrize("session", [20, pytest.param(SESSION, marks=pytest.mark.long)])
@pytest.mark.parametrize("sampling", ["iid", "sobol"])
def test_cut_and_recorded_anew_are_the_same(
    sampling: str,
    session: int,
    empty_cache: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    network, count = town(), 13 * session // 10  # two sessions
    monkeypatch.setattr("planner.futures.record.SESSION", session)
    large = replace(recipe(network, count, 1000.0), sampling=sampling)
    sizes = [(count, 900.0), (session + 1, 1000.0), (count // 4, 600.0), (1, 300.0)]
    smaller = [replace(large, count=n, horizon_s=horizon_s) for n, horizon_s in sizes]
    expected = [anew(some, network, tmp_path / str(k)) for k, some in enumerate(smaller)]
    made(large, network)
    undriven(monkeypatch)
    with caplog.at_level(logging.INFO, logger="planner"):
        for some, right in zip(smaller, expected, strict=True):
            assert files(made(some, network)) == right
    assert [line for line in caplog.messages if line.startswith("cut")] == [
        f"cut from a recording of {count} particles up to 1000 s",
        f"cut from a recording of {count} particles up to 1000 s",
        # The smallest that will do.
        f"cut from a recording of {session + 1} particles up to 1000 s",
        f"cut from a recording of {count // 4} particles up to 600 s",
    ]


@pytest.mark.parametrize("sampling", ["iid", "sobol"])
def test_cut_mixtures_of_targets_that_stop_are_the_same(
    sampling: str, empty_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = town()
    drawn = recipe(network, 60, 900.0)
    assert isinstance(drawn.prior, Prior)
    whole = replace(drawn.prior, window_s=200, stops=Stops(0.1, 0.6, 200.0))
    goes = replace(whole, goals=quiet_streets(network), flees=Flees(60.0, 1.2))
    mixture = Mixture(np.array([0.3, 0.7]), (whole, goes))
    large = replace(drawn, prior=mixture, sampling=sampling)
    smaller = [replace(large, count=n, horizon_s=h) for n, h in ((60, 600.0), (23, 300.0))]
    expected = [anew(some, network, tmp_path / str(k)) for k, some in enumerate(smaller)]
    assert 0 < made(large, network).futures.gone.sum() < 60
    undriven(monkeypatch)
    for some, right in zip(smaller, expected, strict=True):
        assert files(made(some, network)) == right


def test_in_a_real_town_they_are_the_same(
    berlin: OpenScenario, empty_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    large = Drawn(berlin.prior, 24, 900.0, 1, ("particles",), "sobol")
    small = replace(large, count=20, horizon_s=300.0)
    right = anew(small, berlin.network, tmp_path / "anew")
    made(large, berlin.network)
    undriven(monkeypatch)
    assert files(made(small, berlin.network)) == right


def test_motion_and_knots_do_not_depend_on_the_horizon() -> None:
    network = town()
    short, long = (
        record(network, recipe(network, 40, t).particles(network), horizon_s=t, workers=1)
        for t in (KNOT_EVERY_S, 2.0 * KNOT_EVERY_S)
    )
    goes_on = long.end_s > KNOT_EVERY_S
    assert goes_on.any()
    for k in range(40):
        rows = slice(short.first_knot[k], short.first_knot[k + 1])
        count = rows.stop - rows.start
        for name in ("time_s", "x_m", "y_m"):
            of_long = getattr(long, name)[long.first_knot[k] : long.first_knot[k + 1]]
            assert getattr(short, name)[rows].tolist() == of_long[:count].tolist()
    assert np.all(short.end_s[goes_on] == KNOT_EVERY_S)


def test_no_ride_depends_on_the_horizon() -> None:
    """Short ones above all: there many are near the edge on which they would be at the horizon."""
    network = town()

    def rides(horizon_s: float) -> list[Ride]:
        particles = recipe(network, 100, horizon_s).particles(network)
        session = session_of(network, particles, np.arange(100), 42, horizon_s)
        (answer,) = in_processes(drive_session, [session], workers=1)
        return answer

    long = rides(120.0)
    for horizon_s in (10.0, 40.0):
        for whole, ride in zip(long, rides(horizon_s), strict=True):
            assert len(ride.xy_m) <= 16 * (1 + int(horizon_s))
            assert whole.xy_m.startswith(ride.xy_m)
            assert ride.roads == tuple(road for road in whole.roads if road[0] <= horizon_s)


def lines_of(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [line.rpartition(": ")[2] for line in caplog.messages if "recorded anew" in line]


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"count": 7}, ["the one of 6 particles up to 600 s has fewer particles"]),
        ({"horizon_s": 900.0}, ["the one of 6 particles up to 600 s ends earlier"]),
        (
            {"horizon_s": 599.0},
            ["the one of 6 particles up to 600 s can be cut at multiples of 300 s only"],
        ),
        ({"seed": 2}, []),
        ({"stream": ("evaluation",)}, []),
        ({"sampling": "iid"}, []),
    ],
)
def test_what_cannot_be_cut_is_recorded_anew(
    changed: dict[str, object],
    told: list[str],
    empty_cache: Path,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    network = town()
    there = recipe(network, 6, 600.0)
    other = replace(there, **changed)  # type: ignore[arg-type]
    made(there, network)
    with caplog.at_level(logging.INFO, logger="planner"):
        found = files(made(other, network))
    assert lines_of(caplog) == told
    assert found == anew(other, network, tmp_path / "anew")


@pytest.mark.parametrize("sampling", ["iid", "sobol"])
def test_a_recording_grows_from_a_smaller_one(
    sampling: str, empty_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = town()
    drawn = recipe(network, 130, 300.0)  # two sessions, the first of which is parted
    assert isinstance(drawn.prior, Prior)
    parts = (replace(drawn.prior, stops=Stops(0.1, 0.6, 200.0)), drawn.prior)
    large = replace(drawn, prior=Mixture(np.array([0.3, 0.7]), parts), sampling=sampling)
    right = anew(large, network, tmp_path / "anew")
    made(replace(large, count=40), network)
    made(replace(large, count=20, horizon_s=600.0), network)  # not of the same time
    driven: list[int] = []

    def counting(wanted: Sequence[Wanted], *rest: object) -> Iterator[Futures]:
        driven.extend(len(one.kept.missing) for one in wanted)
        return record_in_turn(wanted, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(store, "record_in_turn", counting)
    assert files(made(large, network)) == right
    assert driven == [90]


def test_speeds_drawn_by_road_are_cut_in_number_only(
    empty_cache: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    network = town()
    there = recipe(network, 6, 600.0)
    there = replace(there, prior=replace(there.prior, speed_per_road=True))
    made(there, network)
    with caplog.at_level(logging.INFO, logger="planner"):
        for some in (replace(there, count=5), replace(there, horizon_s=300.0)):
            assert files(made(some, network)) == anew(some, network, tmp_path / str(some.count))
    assert [line.split(" particles")[0] for line in caplog.messages if "cut from" in line] == [
        "cut from a recording of 6"
    ]
    assert lines_of(caplog)[-1:] == [
        "the one of 6 particles up to 600 s has speeds by road, whose drivers depend on the horizon"
    ]


@pytest.mark.parametrize("harm", ["byte", "unsealed", "no file"])
def test_a_damaged_recording_is_not_cut(harm: str, empty_cache: Path, tmp_path: Path) -> None:
    network = town()
    there = recipe(network, 6, 600.0)
    path = made(there, network).path
    if harm == "byte":
        path.write_bytes(path.read_bytes()[:-1])
    elif harm == "no file":
        path.unlink()
    else:
        for file in (empty_cache / "digests" / "futures").iterdir():
            file.unlink()
    small = replace(there, count=4)
    assert files(made(small, network)) == anew(small, network, tmp_path / "anew")


def test_names_that_are_none_are_passed_over(tmp_path: Path) -> None:
    names = ["a-6-600.0-k", "a-7-300.0-l", "b-9-900.0-m", "a-x-600.0-k", "a-6-inf-k", "a", "a-1-2"]
    for name in names:
        (tmp_path / name).mkdir()
    found = siblings_of(tmp_path / "a-5-300.0-k")
    assert [(one.folder.name, one.particles, one.horizon_s) for one in found] == [
        ("a-7-300.0-l", 7, 300.0),
        ("a-6-600.0-k", 6, 600.0),
    ]
    assert [one.folder.name for one in siblings_of(tmp_path / "a-6-600.0-k")] == ["a-7-300.0-l"]
    assert siblings_of(tmp_path / "nowhere" / "a-6-600.0-k") == []


def test_what_is_exact_elsewhere_has_no_size_in_its_name(empty_cache: Path) -> None:
    for network, driving in ((grid5x5(), "free"), (town(), "constant")):
        some = recipe(network, 2, 60.0)
        some = replace(some, prior=replace(some.prior, driving=driving))
        assert "-" not in made(some, network).path.parent.name
