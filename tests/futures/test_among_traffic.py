"""Recordings in traffic: the same bytes however they are made, and who rides where."""

import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from planner.belief.particles import Particles, Realisations
from planner.errors import InputError
from planner.futures import among_traffic, workers
from planner.futures.among_traffic import RIDERS, copies_of
from planner.futures.fates import Fates
from planner.futures.futures import Futures
from planner.futures.kept import Kept
from planner.futures.record import How, record, record_into
from planner.futures.riders import Ridden, TrafficSession, ride_in_traffic
from planner.futures.traffic import Traffic
from planner.futures.workers import in_parts
from support.queues import behind_a_lorry as queue
from support.queues import busy_grid, grid_particles, rider, road, session
from support.signal_grid import signal_grid

COUNT, HORIZON_S = 24, 60.0


@pytest.fixture
def traffic(tmp_path: Path) -> Traffic:
    return busy_grid(tmp_path, at_s=60.0)


@pytest.fixture
def few_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(among_traffic, "RIDERS", 4)


def particles_of(count: int = COUNT) -> Particles:
    return grid_particles(count).in_realisations(Realisations(0, 2))


def recorded(kept: Kept, traffic: Traffic, number: int, **how: object) -> Futures:
    given = How(workers=number, traffic=traffic, **how)  # type: ignore[arg-type]
    return record_into(kept, signal_grid(), particles_of(), HORIZON_S, given)


def bytes_of(futures: Futures) -> dict[str, bytes]:
    assert futures.fates is not None
    columns = {name: getattr(futures, name) for name in ("time_s", "x_m", "y_m", "first_knot")}
    return {name: c.tobytes() for name, c in (columns | futures.fates.columns).items()}


@pytest.mark.usefixtures("few_together")
def test_workers_and_interruptions_change_nothing(traffic: Traffic, tmp_path: Path) -> None:
    whole = bytes_of(recorded(Kept(COUNT), traffic, 1))
    assert bytes_of(recorded(Kept(COUNT), traffic, 2)) == whole
    assert bytes_of(recorded(Kept(COUNT), traffic, 4)) == whole  # each realisation in two parts

    class Stopped(Exception):
        pass

    def stop(done: int, _total: int, _note: str = "", /) -> None:
        if done >= 8:
            raise Stopped

    kept = tmp_path / "kept"
    kept.mkdir()
    with pytest.raises(Stopped):
        recorded(Kept(COUNT, kept), traffic, 1, progress=stop)
    some = Kept(COUNT, kept)
    assert 8 <= COUNT - len(some.missing) < COUNT
    assert bytes_of(recorded(some, traffic, 1)) == whole


def test_a_worker_that_dies_is_replaced_and_no_part_comes_twice(tmp_path: Path) -> None:
    workers.dismiss()
    together = tuple((rider(str(k), 100.0),) for k in range(3))
    task = session(road(tmp_path, 1), queue(tmp_path), together, end_s=20.0)
    parts = [part for _, part in in_parts(ride_in_traffic, [task], workers=1)]
    mark = tmp_path / "mark"
    dying = [part for _, part in in_parts(partial(_dies_once, mark), [task], workers=1)]
    assert mark.exists()
    assert dying == parts


def _dies_once(mark: Path, task: TrafficSession) -> Iterator[Ridden]:
    for part in ride_in_traffic(task):
        yield part
        if part.number == 1 and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)


def test_who_rides_together_depends_on_the_particles_alone() -> None:
    particles = particles_of(50)
    counts = np.bincount(particles.realisation)
    assert counts.tolist() == [25, 25]
    copies = copies_of(particles, 1)
    assert [len(copy) for copy in copies] == [RIDERS, RIDERS, 5]
    assert np.all(particles.realisation[np.concatenate(copies)] == 1)


def test_single_targets_ride_in_any_realisation() -> None:
    one = grid_particles(1)
    seeds = np.random.default_rng(1).integers(1, 2**31 - 1, 40)
    ridden = {
        int(replace(one, seed=[seed]).in_realisations(Realisations(8, 8)).realisation[0])
        for seed in seeds
    }
    assert len(ridden) > 5
    assert ridden <= set(range(8, 16))


def test_traffic_has_to_be_known() -> None:
    with pytest.raises(InputError, match="Recorder"):
        record(signal_grid(), particles_of(), horizon_s=HORIZON_S)


def test_fates_are_told() -> None:
    fates = Fates(
        realisation=[0, 0, 1, 1],
        late_s=[0, 30, np.inf, 0.5],
        took_over=[1, 0, 0, 0],
        teleports=[0, 2, 0, 0],
        driven_m=[900, np.nan, 0, 950],
        alone_m=[1000, np.nan, 0, 1000],
    )
    assert str(fates) == (
        "4 particles rode in 2 realisations of the traffic: 1 took over a car that stood there, "
        "1 entered late (by 30 s on average), 1 never entered and stand where they start, "
        "1 were put past a jam by SUMO"
    )
    share, _, pairs = fates.share()
    assert (share, pairs) == (pytest.approx(0.925), 3)
    assert "comes 92.5 % of the way" in fates.told_share()
    assert replace(fates, alone_m=np.full(4, np.nan)).told_share() == ""
