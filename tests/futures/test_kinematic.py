"""The kinematic clock: by hand, and beside a slow twin."""

import dataclasses
import os
from functools import cache

import numpy as np
import pytest

from planner.errors import InputError
from planner.futures.futures import Futures
from planner.futures.kernels.kinematic import drive_cars
from planner.futures.kinematic import Calibration, kinematic_futures
from planner.network.signals import YIELD, signals_of
from support.signal_grid import signal_grid
from support.slow_clock import slow_clock
from support.street import driver_on, lights, street
from support.sumo_instances import grid5x5, town, walkers

KNOT_M = 3.6  # 2.5 m in x and in y
ACCEL, DECEL, EARLY_S = 1.95, 4.5, 0.2  # of the driver, m/s2 and s


def clock(particles: object, signals: object, **more: object) -> Futures:
    return kinematic_futures(street(), particles, signals, horizon_s=300.0, **more)  # type: ignore


def test_green_is_driven_through_evenly() -> None:
    # It would have to brake 11.1 m before the line, after 48.9 s: the sample of second 49 or 50.
    found = clock(driver_on(), lights())
    times_s = np.array([0.0, 10.0, 49.0, 51.0, 80.0, 101.0])
    np.testing.assert_allclose(found.xy(0, times_s)[:, 0], 10.0 * times_s, atol=1e-6)
    assert found.end_s[0] == pytest.approx(101.0)


@pytest.mark.parametrize(
    ("phase_s", "offset_s", "wait_until"),
    [
        (60, 0, 70),  # at its second 50 the cycle is in its 20th: green 20 s later
        (59, 0, 71),
        (50, 0, 80),
        (60, 7, 77),
        (0, 30, 70),
        (150, 0, 70),
    ],
)
def test_red_holds_a_car_as_long_as_the_program_says(
    phase_s: int, offset_s: int, wait_until: int
) -> None:
    found = clock(driver_on(phase_s=phase_s), lights(offset_s=offset_s))
    # SUMO moves a car to the sample of second k by what is shown at k: off a second sooner.
    off_s = wait_until - 1 - EARLY_S
    stands = (500 - 10**2 / (2 * DECEL)) / 10 + 10 / DECEL
    at_line = found.xy(0, np.linspace(stands, off_s, 20))
    np.testing.assert_allclose(at_line[:, 0], 500.0, atol=KNOT_M)
    speeds_up_s = 10 / ACCEL
    later = off_s + speeds_up_s
    x_m = 500 + 0.5 * ACCEL * speeds_up_s**2
    assert found.xy(0, later + 20)[0] == pytest.approx(x_m + 200, abs=1e-6)
    assert found.end_s[0] == pytest.approx(later + (1010 - x_m) / 10)


def test_who_is_never_let_pass_stands_at_the_line_to_the_end() -> None:
    # SUMO too lets nobody pass where the one program of a signal has no green for them.
    open_ = lights()
    found = clock(driver_on(), dataclasses.replace(open_, shows=np.zeros_like(open_.shows)))
    assert found.xy(0, np.array([60.0, 299.0]))[:, 0] == pytest.approx(500.0, abs=KNOT_M)
    assert found.end_s[0] == 300.0


def test_who_comes_as_red_ends_only_slows_down() -> None:
    # At its second 50 the cycle is in its 39th: it brakes for less than a second.
    found = clock(driver_on(phase_s=79), lights())
    brake_s = (500 - 10**2 / (2 * DECEL)) / 10
    brakes_s = 50 - EARLY_S - brake_s  # second 51 is green, and moves the car from 50 on
    slow_mps = 10 - DECEL * brakes_s
    lost_s = (10 - slow_mps) ** 2 / 20 * (1 / DECEL + 1 / ACCEL)
    assert slow_mps > 0.0
    assert found.end_s[0] == pytest.approx(101 + lost_s)


def test_a_corner_costs_braking_the_way_and_speeding_up() -> None:
    found = clock(driver_on(), lights(signal=False, through_mps=5.65))
    lost_s = (10 - 5) ** 2 / 20 * (1 / DECEL + 1 / ACCEL) + (10 / 5 - 10 / 10)
    assert found.end_s[0] == pytest.approx(101 + lost_s)


@pytest.mark.parametrize("signals", [lights(signal=False, minor=True), lights(green=YIELD)])
def test_who_gives_way_slows_down_at_the_line(signals: object) -> None:
    found = clock(driver_on(), signals)
    lost_s = (10 - 4.5) ** 2 / 20 * (1 / DECEL + 1 / ACCEL)
    assert found.end_s[0] == pytest.approx(101 + lost_s)


def test_a_detector_holds_the_green_of_an_actuated_signal() -> None:
    # It would be held 50 m before the line, passed at 45 s, in the last second of green.
    phase_s = 89 - 46
    assert clock(driver_on(phase_s=phase_s), lights()).end_s[0] > 120
    assert clock(driver_on(phase_s=phase_s), lights(actuated=True)).end_s[0] == pytest.approx(101)
    late = clock(driver_on(phase_s=phase_s + 2), lights(actuated=True))
    assert late.end_s[0] > 120


def test_limits_and_the_drawn_speed_both_hold() -> None:
    signals = lights(signal=False)
    limit = dataclasses.replace(signals, limit_mps=np.array([5.65, 50, 50]))
    found = clock(driver_on(), limit)
    assert found.xy(0, 40.0)[0] == pytest.approx(200.0, abs=KNOT_M)
    speeds_up_s = 5 / ACCEL
    x_m = 500 + 7.5 * speeds_up_s
    assert found.end_s[0] == pytest.approx(100 + speeds_up_s + (1010 - x_m) / 10)


def test_constant_drivers_heed_nothing() -> None:
    signals = dataclasses.replace(lights(minor=False), limit_mps=np.array([5.0, 5.0, 2.0]))
    found = clock(driver_on(phase_s=60, driving="constant"), signals)
    assert found.xy(0, 60.0)[0] == pytest.approx(60 * 10.65)
    assert found.end_s[0] == pytest.approx(1010 / 10.65)


def test_free_and_constant_drivers_are_compiled_for_once() -> None:
    for driving in ("free", "constant"):
        clock(driver_on(driving=driving), lights())  # type: ignore[arg-type]
    assert len(drive_cars.signatures) == 1  # type: ignore[attr-defined]


def test_it_starts_where_and_when_it_is_said_to() -> None:
    found = clock(driver_on(start_m=120.0, depart_s=7.0), lights(signal=False))
    assert np.isnan(found.xy(0, 6.9)).all()
    np.testing.assert_allclose(found.xy(0, 17.0), [220.0, 0.0])
    assert found.end_s[0] == pytest.approx(7 + 89)


def test_the_inside_of_a_junction_counts_to_the_edge_after_it() -> None:
    through, waits = (clock(driver_on(phase_s=phase_s), lights()).edges for phase_s in (0, 60))
    np.testing.assert_array_equal(through.edge, [0, 1])
    np.testing.assert_allclose(through.time_s, [0.0, 50.0])
    np.testing.assert_allclose(waits.time_s, [0.0, 70 - 1 - EARLY_S])


def test_no_edge_is_come_onto_after_the_horizon() -> None:
    for horizon_s, edges in ((49.9, [0]), (50.1, [0, 1])):
        found = kinematic_futures(street(), driver_on(), lights(), horizon_s=horizon_s)
        np.testing.assert_array_equal(found.edges.edge, edges)


def test_the_end_is_a_rest_or_none() -> None:
    stays, gone = (clock(driver_on(gone=gone), lights(signal=False)) for gone in (False, True))
    np.testing.assert_allclose(stays.xy(0, 200.0), [1010.0, 0.0])
    assert np.isnan(gone.xy(0, 101.1)).all()


def test_nothing_is_laid_after_the_horizon() -> None:
    for horizon_s in (33.3, 60.0):  # on the way, and while it stands
        found = kinematic_futures(street(), driver_on(phase_s=60), lights(), horizon_s=horizon_s)
        assert found.end_s[0] == horizon_s
        x_m = min(10 * horizon_s, 500.0)
        np.testing.assert_allclose(found.xy(0, horizon_s), [x_m, 0.0], atol=1e-6)


def test_a_phase_given_beside_counts_in_place_of_the_particles() -> None:
    own = clock(driver_on(phase_s=60), lights())
    beside = clock(driver_on(), lights(), phase_s=np.array([60]))
    np.testing.assert_array_equal(own.time_s, beside.time_s)


def test_another_driver_is_heeded() -> None:
    slow = clock(driver_on(), lights(signal=False), calibration=Calibration(dawdles_mps=1.65))
    assert slow.end_s[0] == pytest.approx(1010 / 9)


def test_there_is_none_on_abstract_nets() -> None:
    network = grid5x5()
    particles = walkers(network, 2, np.random.default_rng(1), start=network.edge_ids[0], roads=3)
    with pytest.raises(InputError, match="there is no kinematic clock"):
        kinematic_futures(network, particles, signals_of(network), horizon_s=100.0)


@cache
def _nets(_cache_folder: str) -> dict[str, object]:
    return {"grid": signal_grid(), "town": town()}


@pytest.mark.parametrize(("name", "start"), [("grid", "A1B1"), ("town", "w-centre")])
def test_a_slow_twin_drives_alike(name: str, start: str) -> None:
    network = _nets(os.environ["PLANNER_CACHE"])[name]
    signals = signals_of(network)  # type: ignore[arg-type]
    rng = np.random.default_rng(3)
    particles = walkers(network, 6, rng, start=start, roads=12, driving="free")  # type: ignore
    phase_s = rng.integers(0, 90, len(particles))
    particles = dataclasses.replace(particles, phase_s=phase_s)
    found = kinematic_futures(network, particles, signals, horizon_s=200.0)  # type: ignore
    waits = 0
    for k in range(len(particles)):
        places = slow_clock(network, particles, signals, k, seconds=200)  # type: ignore[arg-type]
        xy_m = found.xy(k, np.arange(len(places), dtype=float))
        off_m = np.linalg.norm(xy_m - places, axis=1)
        assert off_m.max() < KNOT_M + 1.5
        # It comes onto an edge where the lane of the one before it ends.
        route, own = particles.route(k), found.edges.take(np.array([k]))
        assert own.edge.tolist() == route[: len(own.edge)].tolist()
        ends_m = signals.xy_m[signals.first_point[route[: len(own.edge) - 1] + 1] - 1]
        off_m = np.linalg.norm(found.xy(k, own.time_s[1:]) - ends_m, axis=1)
        assert off_m.max() < KNOT_M
        waits += int((np.linalg.norm(np.diff(places, axis=0), axis=1) < 0.01).sum())
    assert waits > 50  # seconds in which somebody stands
