"""A recording that tells of its first particles is the same recording."""

from dataclasses import fields

import numpy as np
import pytest

from planner.futures import portions
from planner.futures.futures import Futures
from planner.futures.portions import record_in_portions
from planner.futures.record import record
from support.sumo_instances import grid5x5, town, walkers

HORIZON_S = 60.0


def same(one: Futures, other: Futures) -> bool:
    columns = [field.name for field in fields(Futures)]
    return all(np.array_equal(getattr(one, c), getattr(other, c)) for c in columns)


def test_portions_make_the_same_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(portions, "FIRST", 2)
    network = town()
    start = network.edge_ids[0]
    rng = np.random.default_rng(1)
    particles = walkers(network, 7, rng, start=start, roads=3, driving="free")
    whole = record(network, particles, horizon_s=HORIZON_S, workers=1)
    heard: list[Futures] = []
    progress: list[tuple[int, int, str]] = []

    def note(first: Futures) -> str:
        heard.append(first)
        return f"{len(first)} known"

    def on_progress(done: int, total: int, said: str = "", /) -> None:
        progress.append((done, total, said))

    made = record_in_portions(
        network, particles, note, horizon_s=HORIZON_S, workers=1, progress=on_progress
    )
    assert same(made, whole)
    assert [len(first) for first in heard] == [2, 4]
    for first in heard:
        assert first.weight.sum() == pytest.approx(whole.weight.sum())
        motion = whole.take(np.arange(len(first)))
        np.testing.assert_array_equal(first.time_s, motion.time_s)
        np.testing.assert_array_equal(first.x_m, motion.x_m)
    done = [step[0] for step in progress]
    assert done == sorted(done)
    assert progress[0] == (1, 7, "")
    assert (3, 7, "2 known") in progress
    assert progress[-1] == (7, 7, "4 known")


def test_where_runs_are_shared_all_are_one_portion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(portions, "FIRST", 2)
    network = grid5x5()
    particles = walkers(network, 5, np.random.default_rng(1), start="r0c0-r0c1", roads=2)
    made = record_in_portions(network, particles, _refuse, horizon_s=500.0, workers=1)
    assert same(made, record(network, particles, horizon_s=500.0, workers=1))


def _refuse(_: Futures) -> str:
    raise AssertionError


def test_a_part_of_particles_is_that_part() -> None:
    network = grid5x5()
    rng = np.random.default_rng(3)
    whole = walkers(network, 6, rng, start="r0c0-r0c1", roads=4, speed_per_road=True)
    part = whole.part(2, 5)
    assert len(part) == 3
    for k in range(3):
        assert part.route(k).tolist() == whole.route(k + 2).tolist()
        assert part.speeds(k).tolist() == whole.speeds(k + 2).tolist()
    for name in ("weight", "start_m", "depart_s", "seed", "gone", "target"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[2:5])
    assert part.driving == whole.driving
