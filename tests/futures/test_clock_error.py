"""How far a clock is from a recording, reckoned by hand, and the driver that is fitted."""

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import InputError
from planner.futures.calibrate import calibrated
from planner.futures.clock_error import clock_error
from planner.futures.futures import Futures
from planner.futures.kinematic import Calibration, kinematic_futures
from planner.network.signals import signals_of
from support.street import driver_on, lights, street
from support.sumo_instances import town, walkers


def going(*paths: list[tuple[float, float]], gone: bool = False) -> Futures:
    """Particles along the x axis: seconds and metres."""
    time_s, x_m = np.concatenate(paths).T
    return Futures(
        time_s=time_s,
        x_m=x_m,
        y_m=np.zeros(len(x_m)),
        first_knot=np.cumsum([0, *map(len, paths)]),
        weight=np.full(len(paths), 1 / len(paths)),
        gone=np.full(len(paths), gone),
    )


def test_distances_are_medians_and_arrivals_a_ratio() -> None:
    far = [(0.0, 0.0), (400.0, 4000.0)]
    clock = going([(0, 0), (100, 1000)], [(0, 0), (200, 2000)], far)
    recorded = going([(0, 0), (110, 1000)], [(0, 0), (200, 1000)], [(0, 0), (400, 4400)])
    error = clock_error(clock, recorded)
    # At 180 s: 0 m, 900 m and 180 m apart; at 300 s: 0 m, 1,000 m and 300 m.
    assert error.at_180_s_m == pytest.approx(180.0)
    assert error.at_300_s_m == pytest.approx(300.0)
    assert error.arrived == 2
    assert error.arrival_ratio == pytest.approx((1.1 + 1.0) / 2)
    assert str(error) == (
        "the kinematic clock (a guess): 180 m off at 180 s and 300 m off at 300 s (medians); "
        "SUMO takes 1.050 times as long to arrive"
    )


def test_who_is_gone_is_not_compared() -> None:
    clock = going([(0, 0), (100, 1000)], [(0, 0), (400, 4000)], gone=True)
    recorded = going([(0, 0), (120, 1000)], [(0, 0), (400, 4400)], gone=True)
    assert clock_error(clock, recorded).at_180_s_m == pytest.approx(180.0)


def test_short_recordings_are_said_to_be_too_short() -> None:
    clock = going([(0, 0), (100, 1000)])
    error = clock_error(clock, clock)
    assert "cannot be compared" in str(error)
    assert error.as_json() == {
        "particles": 1,
        "at_180_s_m": None,
        "at_300_s_m": None,
        "arrived": 0,
        "arrival_ratio": None,
    }


def test_other_particles_are_refused() -> None:
    one, two = going([(0, 0), (9, 9)]), going([(0, 0), (9, 9)], [(0, 0), (9, 9)])
    with pytest.raises(InputError, match="1 and 2 particles"):
        clock_error(one, two)
    with pytest.raises(InputError, match="are 1 and 2"):
        calibrated(street(), driver_on(), two, signals=lights())


def test_the_driver_that_recorded_is_found() -> None:
    network = town()
    signals, rng = signals_of(network), np.random.default_rng(4)
    particles = walkers(network, 60, rng, start="w-centre", roads=12, driving="free")
    particles = replace(particles, phase_s=rng.integers(0, 90, 60))
    truth = Calibration(yields_mps=3.0, early_s=-0.7)
    recorded = kinematic_futures(network, particles, signals, horizon_s=240.0, calibration=truth)
    found = calibrated(network, particles, recorded, signals=signals)
    assert found.early_s == pytest.approx(truth.early_s, abs=0.3)
    off_m = [
        clock_error(
            kinematic_futures(network, particles, signals, horizon_s=240.0, calibration=driver),
            recorded,
        ).at_180_s_m
        for driver in (Calibration(), found)
    ]
    assert off_m[1] < 0.5 * off_m[0]
