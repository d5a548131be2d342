"""Tables of experiments."""

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.stats
from rich.console import Console

from planner.cli.printing import console
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.experiments.instances import Bound, instances_path, read_instances
from planner.intervals import student_interval
from planner.report.experiment_tables import (
    failures,
    instances_table,
    results_table,
)


def row(seed: int, expected_s: float | None, reason: str | None = None, **more: Any) -> Any:
    return {
        "method": "greedy",
        "radius": 200.0,
        "seed": seed,
        "expected_detection_time_s": expected_s,
        "ci95_low_s": 90.0,
        "ci95_high_s": 110.0,
        "detection_probability": 0.5,
        "found_before_goal_probability": 0.25,
        "reason": reason,
        **more,
    }


def printed(rows: list[Any]) -> list[list[str]]:
    out = io.StringIO()
    console(out).print(results_table(rows, ["radius"], "title"))
    lines = [" ".join(line.split()) for line in out.getvalue().splitlines()]
    return [line.split(" ") for line in lines if line.startswith("200")]


def test_interval_is_student_s() -> None:
    values = np.random.default_rng(1).normal(1000, 50, 7).tolist()
    error = scipy.stats.sem(values)
    expected = scipy.stats.t.interval(0.95, 6, loc=np.mean(values), scale=error)
    assert student_interval(values) == pytest.approx(expected, rel=1e-12)


def test_seeds_are_averaged() -> None:
    (cells,) = printed([row(1, 99.0), row(2, 101.0)])
    assert " ".join(cells) == "200 greedy 100 s 87 .. 113 50.0 % 25.0 % 2"


def test_no_interval_goes_further_than_times_can() -> None:
    rows = [row(1, 10.0, id="a"), row(2, 990.0, id="b")]
    table = results_table(rows, ["radius"], "title", {"a": 1000.0, "b": 1000.0})
    assert table.rows[0][3] == "0 .. 1,000"
    assert results_table(rows, ["radius"], "title").rows[0][3] == "0 .. 6,726"


def test_one_seed_has_the_interval_of_its_targets() -> None:
    (cells,) = printed([row(1, 99.0)])
    assert " ".join(cells) == "200 greedy 99 s 90 .. 110 50.0 % 25.0 % 1"


def test_failures_are_counted_and_left_out() -> None:
    rows = [row(1, 99.0), row(2, None, "odd"), row(3, None, "odd")]
    (cells,) = printed(rows)
    assert cells[-1] == "1"
    assert failures(rows) == ["2 failed: odd"]
    (cells,) = printed(rows[1:])
    assert " ".join(cells) == "200 greedy - - - - 0"


@pytest.mark.parametrize(("plans", "told"), [("roads", "+50.0 %"), ("free", "(+50.0 %)")])
def test_a_bound_is_told_as_a_share_of_itself(plans: str, told: str) -> None:
    one = replace(read_instances(instances_path())[0], bound=Bound(1500.0, 1000.0, plans))
    seen = Evaluation(
        np.array([1400.0, 1600.0]), np.full(2, 0.5), np.full(2, 900.0), Objective(2000.0)
    )
    table = instances_table([one], {one.name: seen}, {})
    assert list(table.columns[2].cells) == [told]


def test_lines_left_out_are_told() -> None:
    few, many = ([row(1, 100.0, radius=float(r)) for r in range(n)] for n in (60, 63))
    assert results_table(few, ["radius"], "title").caption == ""
    assert "3 more lines" in str(results_table(many, ["radius"], "title").caption)


def test_where_factors_are_many_seldom_levels_share_a_column() -> None:
    odd = {"b": 5, "d": "odd"}
    rows = [
        row(1, 100.0, **({"a": n, "b": 0, "c": 0, "d": "as usual"} | (odd if n == 2 else {})))
        for n in range(3)
    ]
    table = results_table(rows, ["a", "b", "c", "d"], "title")
    assert [column.header for column in table.columns][:3] == ["a", "other levels", "method"]
    assert [cells[1] for cells in table.rows] == ["", "", "b=5\nd=odd"]
    assert table.caption == "other levels than b=0, c=0, d=as usual"


def test_an_interval_of_times_begins_at_zero() -> None:
    (cells,) = printed([row(1, 10.0), row(2, 900.0)])
    assert cells[4] == "0"


def test_a_table_is_whole_in_a_narrow_window() -> None:
    rows = [row(seed, 99.0, **{"search.particles": 1000}) for seed in (1, 2)]
    out = io.StringIO()
    narrow = Console(file=out, width=60)
    narrow.print(results_table(rows, ["search.particles"], "title"))
    text = out.getvalue()
    assert all(len(line) <= 60 for line in text.splitlines())
    assert ["search.", "expected", "95", "%"] in [line.split() for line in text.splitlines()]
    assert "particles" in text
    assert "a wider window also shows: before goal, seeds" in text
