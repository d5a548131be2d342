"""The figures of a search, against hand-made numbers and repeated draws."""

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.track import Track
from support.instances import figure3, physics_futures

NEVER = np.inf


def evaluation(
    seen_at: list[float], weight: list[float], *, end_s: float = 50.0, horizon_s: float = 100.0
) -> Evaluation:
    return Evaluation(seen_at, weight, np.full(len(seen_at), end_s), Objective(horizon_s))


def test_a_miss_counts_the_horizon() -> None:
    result = evaluation([10, 30, NEVER, 200], [0.4, 0.2, 0.3, 0.1])
    assert result.expected_detection_time_s == pytest.approx(4 + 6 + 30 + 10)
    assert result.detection_probability == pytest.approx(0.6)


def test_an_absent_target_is_never_found() -> None:
    result = evaluation([10, 30], [0.5, 0.25])
    assert result.expected_detection_time_s == pytest.approx(5 + 7.5 + 25)
    assert result.detection_probability == pytest.approx(0.75)
    nobody = evaluation([], [])
    assert nobody.expected_detection_time_s == 100
    assert nobody.detection_probability == 0
    assert nobody.ci95_s == (100, 100)


def test_the_horizon_itself_is_in_time_and_the_goal_is_not() -> None:
    result = evaluation([100, 50, 49.9], [0.2, 0.3, 0.5])
    assert result.detection_probability == pytest.approx(1)
    assert result.found_before_goal_probability == pytest.approx(0.5)
    late_goal = evaluation([100, 50, 150], [0.2, 0.3, 0.5], end_s=1000)
    assert late_goal.found_before_goal_probability == pytest.approx(0.5)


def test_found_by_a_time() -> None:
    result = evaluation([10, 30, NEVER, 200], [0.4, 0.2, 0.3, 0.1])
    shares = [result.found_by_probability(time_s) for time_s in (9.9, 10, 29, 30, 100, 1e9)]
    assert shares == pytest.approx([0, 0.4, 0.4, 0.6, 0.6, 0.6])  # nothing after the horizon


def test_detection_curve() -> None:
    times, probability = evaluation([30, 10, NEVER, 30, 101], [0.1, 0.2, 0.3, 0.2, 0.2]).curve()
    assert times.tolist() == [10, 30]
    assert probability == pytest.approx([0.2, 0.5])
    assert evaluation([NEVER], [1.0]).curve()[0].size == 0


def test_expected_time_is_the_area_above_the_curve() -> None:
    rng = np.random.default_rng(1)
    result = evaluation(list(rng.uniform(0, 150, 50)), list(rng.dirichlet(np.ones(50)) * 0.8))
    times, probability = result.curve()
    bounds = np.concatenate(([0.0], times, [result.objective.horizon_s]))
    area = np.diff(bounds) @ (1 - np.concatenate(([0.0], probability)))
    assert result.expected_detection_time_s == pytest.approx(area)


def test_interval_of_equal_weights_is_the_textbook_one() -> None:
    seen_at = [10.0, 20.0, 40.0, NEVER]
    low, high = evaluation(seen_at, [0.25] * 4).ci95_s
    error = np.std([10, 20, 40, 100], ddof=1) / 2
    assert (low, high) == pytest.approx((42.5 - 1.959964 * error, 42.5 + 1.959964 * error))


@pytest.mark.parametrize("present", [1.0, 0.6])
def test_interval_covers_the_truth_in_95_of_100_worlds(present: float) -> None:
    rng = np.random.default_rng(7)
    truth = present * (0.7 * 50 + 0.3 * 100) + (1 - present) * 100
    covered = 0
    for _ in range(1000):
        seen_at = np.where(rng.random(200) < 0.7, rng.uniform(0, 100, 200), NEVER)
        low, high = evaluation(list(seen_at), [present / 200] * 200).ci95_s
        covered += low <= truth <= high
    assert 925 <= covered <= 970


def test_one_target_tells_nothing() -> None:
    assert evaluation([10.0], [1.0]).ci95_s == (0, 100)
    assert evaluation([10.0, 20.0], [1.0, 0.0]).ci95_s == (0, 100)


def test_several_flights_count_the_earliest_sighting() -> None:
    network = figure3()
    futures = physics_futures(network, [["AB", "BC", "CE"], ["AB", "BD", "DG"]], 0.0, 10.0)
    sensor = Sensor(200.0)
    at_c = Track([0, 4000], [10000] * 2, [4000] * 2, [(0, 4000)])
    at_b = Track([800, 4000], [5000] * 2, [0] * 2, [(800, 4000)])
    at_d = Track([0, 900], [10000] * 2, [-4000] * 2, [(0, 900)])
    alone = evaluate([at_c], futures, sensor, Objective(3600.0))
    assert np.isinf(alone.seen_at).tolist() == [False, True]
    both = evaluate([at_c, at_d, at_b], futures, sensor, Objective(3600.0))
    to_c = (5000 + np.hypot(5000, 4000) - 200) / 10
    assert both.seen_at == pytest.approx([to_c, NEVER])
    assert both.end_s == pytest.approx(futures.end_s)
    assert evaluate([], futures, sensor, Objective(3600.0)).expected_detection_time_s == 3600
