"""A sensor that misses, against looks found by hand and against draws."""

import numpy as np
import pytest

from planner.arrays import Floats
from planner.detection.first_detection import first_detection
from planner.detection.sensor import Sensor
from planner.experiments.looks import AGAIN_S, looked
from planner.flight.track import Track
from planner.futures.futures import Futures
from support.instances import grid, physics_futures

SENSOR, STEP_S, HORIZON_S = Sensor(100.0), 0.05, 1500.0


@pytest.fixture
def futures() -> Futures:
    network = grid(2, 2, road_m=1000.0)
    routes = [["r0c0-r0c1", "r0c1-r1c1"], ["r0c0-r1c0", "r1c0-r1c1"], ["r0c0-r0c1", "r0c1-r1c1"]]
    return physics_futures(network, routes, 0.0, np.array([5.0, 10.0, 2.0]))


@pytest.fixture
def track() -> Track:
    """To and fro along the northern road, then a long hover at the goal."""
    x_m = [0.0, 1000.0, 0.0, 1000.0, 1000.0, 1000.0]
    y_m = [0.0, 0.0, 0.0, 0.0, -1000.0, -1000.0]
    return Track(
        np.array([50.0, 70.0, 90.0, 110.0, 150.0, 1387.0]),
        np.array(x_m),
        np.array(y_m),
        np.array([[50.0, 1387.0]]),
    )


def looks_by_hand(futures: Futures, track: Track, k: int) -> list[float]:
    """In short steps: within the radius, and a minute after the last look."""
    times = np.arange(0.0, 1387.0, STEP_S)
    apart = np.hypot(*(futures.xy(k, times) - track.xy(times)).T)
    looks: list[float] = []
    for time_s, metres in zip(times.tolist(), apart.tolist(), strict=True):
        if metres <= SENSOR.radius_m and (not looks or time_s >= looks[-1] + AGAIN_S):
            looks.append(time_s)
    return looks


def test_a_perfect_sensor_is_the_first_detection(futures: Futures, track: Track) -> None:
    seen = looked(futures, [track], SENSOR)
    first = first_detection(futures, track, SENSOR.radius_m)
    assert seen.at_s.tolist() == [first.tolist()]
    assert seen.share.tolist() == [1.0]
    np.testing.assert_array_equal(seen.time_s(100.0), np.minimum(first, 100.0))


def test_looks_are_those_found_step_by_step(futures: Futures, track: Track) -> None:
    seen = looked(futures, [track], SENSOR, 0.2)
    for k in range(len(futures)):
        by_hand = looks_by_hand(futures, track, k)
        assert len(by_hand) > 3
        mine = seen.at_s[:, k]
        finite = mine[np.isfinite(mine)]
        np.testing.assert_allclose(finite, by_hand[: len(finite)], atol=len(finite) * STEP_S)
        assert len(finite) == len(by_hand)


def drawn(looks: Floats, detects: float, rng: np.random.Generator) -> float:
    """When one target is seen in one draw of hits and misses."""
    for look_s in looks:
        if rng.random() < detects:
            return float(look_s)
    return np.inf


def test_the_expectation_is_that_of_draws(futures: Futures, track: Track) -> None:
    rng = np.random.default_rng(1)
    seen = looked(futures, [track], SENSOR, 0.5)
    for k in range(len(futures)):
        finite = seen.at_s[np.isfinite(seen.at_s[:, k]), k]
        draws = np.array([drawn(finite, 0.5, rng) for _ in range(4000)])
        capped = np.minimum(draws, HORIZON_S)
        margin = 5 * capped.std() / len(draws) ** 0.5 + 1e-6
        assert seen.time_s(HORIZON_S)[k] == pytest.approx(capped.mean(), abs=margin)
        by_s = np.full(len(futures), finite[1])
        share = seen.found_by(by_s)[k]
        assert share == pytest.approx(0.75)
        assert seen.found_by(by_s, strict=True)[k] == pytest.approx(0.5)


def test_several_tracks_share_a_look(futures: Futures, track: Track) -> None:
    once, twice = (looked(futures, [track] * n, SENSOR, 0.5) for n in (1, 2))
    np.testing.assert_array_equal(once.at_s, twice.at_s)
