"""The studies of Sections 3 and 4.1, on the paper's own small graphs."""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from planner.experiments.condition import Condition
from planner.experiments.experiment_file import read_experiment
from planner.experiments.run_condition import run_condition
from planner.network.road_network import RoadNetwork
from planner.paper.optimum import BOUND, optimum_of
from planner.paper.orders import orders_of
from planner.paper.precedence import last_in_first_out, precedence_of
from planner.paper.studies import STUDIES
from planner.search.exact import number_of_orders
from support.experiment_results import run_alone
from support.instances import figure1, grid

WITH_STUDIES = partial(run_condition, studies=STUDIES)


def first(name: str, *choices: str) -> Condition:
    return read_experiment(name, STUDIES).only(choices).conditions()[0]


def test_all_orders_of_figure3() -> None:
    found = orders_of(first("section4", "target.at_sink=gone", "uav.start.x_m=-30000"))
    rows = {row["what"]: row for row in found["rows"]}
    assert sum(found["counts"]) == number_of_orders(7) == 645_120
    assert len(found["edges_s"]) == len(found["counts"]) + 1
    best, worst = rows["all orders: best"], rows["all orders: worst"]
    assert rows["exact"]["expected_detection_time_s"] == pytest.approx(
        best["expected_detection_time_s"]
    )
    assert best["orders_better"] == 0.0
    assert worst["orders_better"] > 0.99
    assert rows["all orders: median"]["orders_better"] == pytest.approx(0.5, abs=1e-3)
    drawn, mean = rows["500 random orders: mean"], rows["all orders: mean"]
    apart = drawn["expected_detection_time_s"] - mean["expected_detection_time_s"]
    assert abs(apart) < 4 * drawn["standard_error_s"]


def test_no_plan_is_better_than_the_bound() -> None:
    quick = read_experiment("optimum", STUDIES).only(["uav.start.distance_m=120000"]).quick()
    condition = quick.conditions()[0]
    small = replace(
        condition, overrides=(*condition.overrides, "search.particles=64", "search.work=2000")
    )
    rows = {row["what"]: row for row in optimum_of(small)["rows"]}
    assert {row["particles"] for row in rows.values()} == {64}
    bound = rows.pop(BOUND)["expected_detection_time_s"]
    assert set(rows) == {"greedy", "lookahead", "best"}
    for row in rows.values():
        value = row["expected_detection_time_s"]
        assert value >= bound > 1200.0  # nobody is met sooner than 120 km and 300 s take
        assert row["gap"] == pytest.approx(value / bound - 1.0)
    assert rows["best"]["gap"] < rows["greedy"]["gap"]


def test_precedence_finds_all_and_breadth_first_does_not() -> None:
    late = first("section3", "uav.take_off_s=900", "sensor.detects_in_transit=false")
    late = replace(late, sets=tuple(replace(one, points=8) for one in late.sets))
    rows = precedence_of(late)["rows"]
    assert len(rows) == 2 * 8
    for row in rows:
        certain = row["detection_probability"] == pytest.approx(1.0)
        assert certain != row["order"].startswith("breadth-first")
        if row["order"] == "breadth-first":
            assert row["never_flown"] == "ED"
        elif row["order"] == "breadth-first, as printed":
            assert row["never_flown"] == "DF ED"
        else:
            assert row["never_flown"] == ""
        assert row["last_found_s"] <= row["flight_ends_s"]
    printed = {row["order"]: row["extra_movements"] for row in rows}
    assert printed["optimised, as printed"] == 2  # as Section 3 says
    assert printed["topological, shortest"] == 1


@pytest.mark.parametrize("network", [figure1(), grid(3, 4)], ids=["figure1", "grid"])
def test_last_in_first_out_keeps_the_precedence(network: RoadNetwork) -> None:
    order = last_in_first_out(network)
    assert sorted(order) == list(range(len(network.road_ids)))
    place = np.argsort(order)
    for road in order:
        into = np.flatnonzero(network.road_to == network.road_from[road])
        assert (place[into] < place[road]).all()


def test_on_a_grid_it_goes_deep_first() -> None:
    network = grid(3, 3)
    order = last_in_first_out(network)
    joined = sum(network.road_to[a] == network.road_from[b] for a, b in pairwise(order))
    assert joined > 0


def test_a_study_has_rows_of_its_own(tmp_path: Path) -> None:
    study = read_experiment("section3", STUDIES).only(["uav.take_off_s=300"])
    conditions = [
        replace(c, sets=tuple(replace(one, points=2) for one in c.sets)) for c in study.conditions()
    ]
    results = run_alone(conditions, tmp_path, workers=1, run_one=WITH_STUDIES)
    assert len(results.rows) == 2 * 2 * 8
    assert {row["reason"] for row in results.rows} == {None}
    again = run_alone(conditions, tmp_path, workers=1, run_one=WITH_STUDIES)
    assert (again.run, again.rows) == (0, results.rows)
