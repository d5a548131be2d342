"""Particles that ride in traffic: nobody passes a queue, and a fork is a fresh SUMO."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from planner.futures.riders import Ridden, TrafficSession, ride_in_traffic
from planner.futures.tracks import motion_of
from planner.futures.vehicles import vehicles_of
from planner.futures.workers import in_parts
from support.queues import (
    LORRY_M,
    LORRY_S,
    behind_a_lorry,
    busy_grid,
    grid_particles,
    nobody,
    rider,
    road,
    session,
)
from support.signal_grid import signal_grid

FRESH = partial(ride_in_traffic, forks=False)


def ridden(task: TrafficSession, how: partial[object] | None = None) -> list[Ridden]:
    return [part for _, part in in_parts(how or ride_in_traffic, [task], workers=1)]


def east_m(copy: Ridden, k: int, time_s: float) -> float:
    """How far east a vehicle is, whose road begins at 0."""
    time, x_m, _ = motion_of(copy.rides[k], copy.step_s).T
    return float(np.interp(time_s, time, x_m))


def test_nobody_drives_through_a_lorry(tmp_path: Path) -> None:
    some = (rider("0", 200.0), rider("1", 100.0), rider("2", 5.0, depart_s=60.0))
    (copy,) = ridden(session(road(tmp_path, 1), behind_a_lorry(tmp_path), (some,), end_s=300.0))
    stands_s = LORRY_S - 10.0
    assert [east_m(copy, k, stands_s - 2.0) < LORRY_M for k in range(3)] == [True] * 3
    assert min(east_m(copy, k, 299.0) for k in range(3)) > LORRY_M + 200.0  # once it has gone


def test_all_pass_a_lorry_where_there_is_a_second_lane(tmp_path: Path) -> None:
    some = (rider("0", 200.0), rider("1", 100.0))
    (copy,) = ridden(session(road(tmp_path, 2), behind_a_lorry(tmp_path), (some,)))
    assert min(east_m(copy, k, 110.0) for k in range(2)) > LORRY_M + 100.0


def test_who_starts_in_a_queue_is_there_at_once(tmp_path: Path) -> None:
    traffic = behind_a_lorry(tmp_path, cars=20, at_s=40.0)
    starts_m = [LORRY_M - 30.0, LORRY_M - 90.0]
    some = tuple(rider(str(k), start_m) for k, start_m in enumerate(starts_m))
    (copy,) = ridden(session(road(tmp_path, 1), traffic, (some,)))
    for k, start_m in enumerate(starts_m):
        assert copy.fates[k].took_over
        assert copy.fates[k].late_s == 0.0
        assert abs(east_m(copy, k, 0.0) - start_m) < 12.0
        assert abs(east_m(copy, k, 100.0) - start_m) < 12.0  # they stand, all of them


def test_whose_place_stays_taken_waits_there(tmp_path: Path) -> None:
    """A lorry is no car to be taken over."""
    inside = (rider("0", LORRY_M - 2.0),)
    traffic = behind_a_lorry(tmp_path)
    (copy,) = ridden(session(road(tmp_path, 1), traffic, (inside,), end_s=100.0))
    assert copy.fates[0].late_s == np.inf
    motion = motion_of(copy.rides[0], copy.step_s)
    assert len(motion) == 101
    assert np.ptp(motion[:, 1]) == 0.0
    assert motion[0, 1] == pytest.approx(LORRY_M - 2.0, abs=0.1)
    (later,) = ridden(session(road(tmp_path, 1), traffic, (inside,), end_s=300.0))
    assert LORRY_S - 10.0 <= later.fates[0].late_s < LORRY_S + 30.0
    assert east_m(later, 0, 100.0) == pytest.approx(LORRY_M - 2.0, abs=2.0)


def test_who_stops_leaves_the_road(tmp_path: Path) -> None:
    """Who parks does not stand in the way of those behind."""
    parks = replace(rider("0", 600.0), stop_s=20.0)
    (copy,) = ridden(
        session(road(tmp_path, 1), behind_a_lorry(tmp_path), ((parks, rider("1", 500.0)),))
    )
    assert motion_of(copy.rides[0], copy.step_s)[-1, 0] == 20.0
    assert east_m(copy, 1, 60.0) > east_m(copy, 0, 60.0) + 100.0


@pytest.fixture
def on_the_grid(tmp_path: Path) -> TrafficSession:
    vehicles = vehicles_of(signal_grid(), grid_particles(6), np.arange(6))
    together = (vehicles[:3], vehicles[3:])
    return session(signal_grid(), busy_grid(tmp_path, at_s=60.0), together, end_s=60.0, alone=True)


def test_a_fork_is_a_fresh_load(on_the_grid: TrafficSession) -> None:
    forks = ridden(on_the_grid)
    assert forks == ridden(on_the_grid, FRESH)
    assert forks[0].warm is not None
    assert forks[0].warm.vehicles > 10


def test_a_ride_does_not_depend_on_those_before_it(on_the_grid: TrafficSession) -> None:
    """A fork that touched the traffic it was made from would let the second one differ."""
    twice = replace(on_the_grid, together=on_the_grid.together[:1] * 2)
    first, second = ridden(twice)
    assert first._replace(number=1) == second


def test_realisations_differ(on_the_grid: TrafficSession) -> None:
    first, second = ridden(on_the_grid), ridden(replace(on_the_grid, realisation=1))
    assert first[0].rides != second[0].rides


def test_who_rides_behind_another_is_slower_than_alone(tmp_path: Path) -> None:
    behind, before = rider("0", 100.0), replace(rider("1", 130.0), speeds_mps=(6.0, 6.0))
    task = session(road(tmp_path, 1), nobody(tmp_path), ((behind, before),), end_s=60.0, alone=True)
    (copy,) = ridden(task)
    assert copy.alone is not None
    alone_m = motion_of(copy.alone, copy.step_s)[-1, 1]
    assert east_m(copy, 0, 60.0) < 500.0 < 750.0 < alone_m
