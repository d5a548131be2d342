"""Means, intervals and paired differences, against hand computation."""

import pytest

from planner.report.estimates import Estimate, chosen, difference, estimate

E = "expected_detection_time_s"


def row(method: str, seed: int, value: float | None, **other: object) -> dict[str, object]:
    reason = None if value is not None else "odd"
    return {"method": method, "seed": seed, E: value, "reason": reason, **other}


ROWS = [
    row("greedy", 1, 10.0),
    row("greedy", 2, 14.0),
    row("greedy", 3, None),
    row("best", 2, 11.0),
    row("best", 1, 9.0),
    row("best", 4, 100.0),
    row("wait", 1, 8.0),
]


def test_a_mean_with_students_interval() -> None:
    found = Estimate.of([10.0, 14.0])
    half = 12.706204736432095 * 2.0  # t(0.975, 1) times the standard error
    assert (found.mean, found.seeds) == (12.0, 2)
    assert (found.low, found.high) == (pytest.approx(12 - half), pytest.approx(12 + half))
    assert found.seconds == "12 s (-13 to 37)"


def test_a_single_value_has_no_width() -> None:
    found = Estimate.of([1234.4])
    assert (found.low, found.high) == (1234.4, 1234.4)
    assert (found.seconds, found.change) == ("1,234 s", "+1,234 s")
    assert Estimate.of([0.5]).percent == "50.0 %"


def test_an_interval_that_would_show_as_its_middle_is_left_out() -> None:
    assert Estimate(10.1, 10.0, 10.2, 3).seconds == "10 s"
    assert Estimate(10.1, 9.0, 10.2, 3).seconds == "10 s (9 to 10)"


def test_intervals_end_where_values_do() -> None:
    probability = "detection_probability"
    rows = [{"seed": seed, probability: p} for seed, p in ((1, 1.0), (2, 0.9))]
    found = estimate(rows, {}, probability)
    assert found is not None
    assert (found.mean, found.low, found.high) == (
        pytest.approx(0.95),
        pytest.approx(0.95 - 0.05 * 12.7062047),
        1.0,
    )
    values = [{"seed": 1, E: 0.0, "bias": -9.0}, {"seed": 2, E: 9.0, "bias": 1.0}]
    time_s, bias_s = estimate(values, {}), estimate(values, {}, "bias")
    assert time_s is not None
    assert bias_s is not None
    assert time_s.low == 0.0
    assert bias_s.low < bias_s.mean == -4.0
    assert Estimate(5.0, -3.0, 12.0, 2).within(0.0, 10.0) == Estimate(5.0, 0.0, 10.0, 2)


def test_rows_that_failed_do_not_count() -> None:
    assert [one["seed"] for one in chosen(ROWS, {"method": "greedy"})] == [1, 2]
    found = estimate(ROWS, {"method": "greedy"})
    assert found is not None
    assert found.mean == 12.0
    assert estimate(ROWS, {"method": "none"}) is None


def test_differences_are_paired_by_seed() -> None:
    greedy, best, wait = (chosen(ROWS, {"method": m}) for m in ("greedy", "best", "wait"))
    apart = difference(greedy, best)
    assert apart is not None
    assert (apart.mean, apart.seeds) == (2.0, 2)  # 1 and 3: seeds that both have
    against_one = difference(greedy, wait)
    assert against_one is not None
    assert (against_one.mean, against_one.seeds) == (4.0, 2)
    turned = difference(wait, greedy)
    assert turned is not None
    assert turned.mean == -4.0
    assert difference(greedy, []) is None
