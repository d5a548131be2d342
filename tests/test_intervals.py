"""Intervals of shares hold the truth as often as they say."""

import numpy as np
import pytest

from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.intervals import half_width, half_width_of_runs, share_interval


@pytest.mark.parametrize("truth", [0.02, 0.3, 0.5, 0.97])
def test_nineteen_of_twenty_intervals_hold_the_truth(truth: float) -> None:
    hits = np.random.default_rng(5).binomial(300, truth, 4000)
    intervals = np.array([share_interval(hit / 300, 300) for hit in hits])
    holds = np.mean((intervals[:, 0] <= truth) & (truth <= intervals[:, 1]))
    assert holds == pytest.approx(0.95, abs=0.025)


def test_all_and_none_found_leave_some_doubt() -> None:
    low, high = share_interval(1.0, 100)
    assert 0.95 < low < 1.0 == high
    assert share_interval(0.0, 100) == pytest.approx((1 - high, 1 - low), abs=1e-12)
    assert share_interval(0.5, 0) == (0.0, 1.0)


def test_more_draws_say_more() -> None:
    widths = [np.ptp(share_interval(0.4, draws)) for draws in (10, 100, 1000)]
    assert widths[0] > widths[1] > widths[2]


def test_an_absent_target_adds_no_doubt() -> None:
    def found(weight: float) -> tuple[tuple[float, float], tuple[float, float]]:
        seen_s = np.array([10.0, 60.0, np.inf, np.inf])
        result = Evaluation(seen_s, np.full(4, weight), np.full(4, 50.0), Objective(100.0))
        return result.found_interval, result.found_before_goal_interval

    present, half = found(0.25), found(0.125)
    assert np.allclose(np.array(half), np.array(present) / 2)
    assert present[0] == pytest.approx(share_interval(0.5, 4))
    assert present[1] == pytest.approx(share_interval(0.25, 4))
    assert found(0.0) == ((0.0, 0.0), (0.0, 0.0))


def test_found_by_a_time() -> None:
    seen_s = np.array([10.0, 60.0, np.inf, np.inf])
    result = Evaluation(seen_s, np.full(4, 0.2), np.full(4, 50.0), Objective(100.0))
    assert result.found_by_interval(100.0) == pytest.approx(result.found_interval)
    expected = 0.8 * np.array(share_interval(0.25, 4))
    assert result.found_by_interval(30.0) == pytest.approx(tuple(expected))


def test_nineteen_of_twenty_intervals_of_a_mean_hold_it() -> None:
    draws = np.random.default_rng(6).exponential(30.0, (4000, 200))
    weight = np.full(200, 1 / 200)
    off = [abs(values.mean() - 30.0) / half_width(values, weight) for values in draws]
    assert np.mean(np.array(off) <= 1.0) == pytest.approx(0.95, abs=0.015)
    assert half_width(draws[0], weight / 2) == pytest.approx(half_width(draws[0], weight) / 2)
    assert half_width(draws[0], 0 * weight) == half_width(draws[0][:1], np.ones(1)) == np.inf


def test_what_values_of_a_run_have_in_common_widens_the_interval() -> None:
    """Over many draws the interval of runs holds the mean 95 times in 100, that of values less."""
    rng, run = np.random.default_rng(7), np.repeat(np.arange(8), 25)
    weight = np.full(200, 1 / 200)
    hits = {"runs": 0, "values": 0}
    for _ in range(400):
        values = rng.normal(0.0, 1.0, 8)[run] + rng.normal(0.0, 1.0, 200)
        off = abs(values.mean())
        hits["runs"] += off <= half_width_of_runs(values, weight, run)
        hits["values"] += off <= half_width(values, weight)
    assert 0.92 <= hits["runs"] / 400 <= 0.98
    assert hits["values"] / 400 < 0.7


def test_runs_of_one_value_are_values() -> None:
    values, weight = np.array([3.0, 5.0, 4.0, 9.0]), np.array([0.3, 0.2, 0.1, 0.2])
    alike = half_width_of_runs(values, weight, np.array([4, 1, 2, 7]))
    share = weight / weight.sum()
    deviation = share * (values - share @ values)
    error = np.sqrt((deviation**2).sum() * 4 / 3)
    assert alike == pytest.approx(0.8 * 3.182446 * error, rel=1e-5)
    assert half_width_of_runs(values, weight, np.zeros(4, int)) == np.inf


def test_an_evaluation_in_traffic_counts_runs() -> None:
    """Of targets that one queue holds up, a hundred say little more than one."""
    seen_at = np.repeat([100.0, 250.0, 180.0, np.inf], 25)
    weight, objective = np.full(100, 0.01), Objective(300.0)
    alone = Evaluation(seen_at, weight, np.zeros(100), objective)
    together = Evaluation(
        seen_at, weight, np.zeros(100), objective, run=np.repeat(np.arange(4), 25)
    )
    widths = [np.ptp(one.ci95_s) for one in (alone, together)]
    assert widths[1] > 5 * widths[0]
    found = [np.ptp(one.found_interval) for one in (alone, together)]
    assert found[1] > 3 * found[0]
    part = together.of_those(np.arange(100) < 50)
    assert part.run is not None
    assert np.unique(part.run).tolist() == [0, 1]
    single = Evaluation(seen_at, weight, np.zeros(100), objective, run=np.zeros(100, int))
    assert single.ci95_s == (0.0, 300.0)
    assert single.found_interval == pytest.approx((0.0, 1.0))


def test_what_targets_of_a_run_count_for_is_the_same_for_two_that_differ_in_their_means() -> None:
    """Each target of several has its own mean, and how far these are apart says nothing of runs."""
    rng, run = np.random.default_rng(2), np.repeat(np.arange(10), 20)
    seen_at = 100.0 + 20.0 * rng.normal(size=10)[run] + 20.0 * rng.normal(size=200)
    weight, rows = np.full(400, 1 / 200), np.repeat([0, 1], 200)
    both = Evaluation(
        np.concatenate([seen_at, seen_at + 500.0]),
        weight,
        np.zeros(400),
        Objective(1000.0, sought=2),
        run=np.tile(run, 2),
        target=rows,
    )
    worth = [one._worth_of_draw() for one in (both, *both.each.values())]
    assert 0.0 < worth[0] < 0.5
    np.testing.assert_allclose(worth, worth[0])
