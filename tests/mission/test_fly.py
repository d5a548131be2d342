"""Missions against hand-computed truths."""

import numpy as np
import pytest

from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.mission.fly import fly
from planner.report.run_files import mission_line
from planner.search.plan import plan_of_legs, plan_of_wait
from planner.search.problem import Problem
from support.instances import figure3, physics_futures


def problem(*, gone: bool = False) -> Problem:
    network = figure3()
    truth = physics_futures(
        network, [["AB", "BC", "CE"], ["AB", "BD", "DG"]], [0.0, 0.0], [20.0, 20.0],
        horizon_s=1e5, gone=gone,
    )  # fmt: skip
    uav = Uav(x_m=-30_000.0, y_m=0.0, take_off_s=0.0, speed_mps=100.0)
    return Problem(network, truth, uav, Sensor(200.0), Objective(3_600.0))


def leg(name: str) -> int:
    return 2 * figure3().road_ids.index(name)


def test_found_when_where_and_on_which_leg() -> None:
    asked = problem()
    plan = plan_of_legs(asked, "by hand", [leg("AB"), leg("BD"), leg("DG")])
    record = fly(plan, asked.futures, asked.sensor, asked.objective)
    # The UAV is at B at 350 s, 1,600 m along BD behind the second target, and gains 80 m/s.
    # The targets pass B after 250 s and are 2,000 m on their roads by then.
    assert record.evaluation.found.tolist() == [False, True]
    caught_s = 350.0 + (2_000.0 - 200.0) / 80.0
    assert record.evaluation.seen_at[1] == pytest.approx(caught_s)
    assert record.leg.tolist() == [0, 2]
    assert record.xy_m[1] == pytest.approx(asked.futures.xy(1, caught_s))
    assert np.isnan(record.xy_m[0]).all()
    assert record.evaluation.time_s.tolist() == pytest.approx([3_600.0, caught_s])
    assert record.evaluation.found_before_goal_probability == pytest.approx(0.5)


def test_waiting_at_the_goal_finds_what_arrives_but_not_before_its_goal() -> None:
    asked = problem()
    node = asked.network.node_xy_m[asked.network.node_index["E"]]
    plan = plan_of_wait(asked, "wait", *node)
    record = fly(plan, asked.futures, asked.sensor, asked.objective)
    assert record.evaluation.found.tolist() == [True, False]
    assert record.leg.tolist() == [0, 0]
    assert record.evaluation.seen_at[0] < asked.futures.end_s[0]  # 200 m ahead of its goal
    said = mission_line(record)
    assert said.endswith(", before it reached its goal")
    assert mission_line(record, in_town=True) == said.removesuffix(", before it reached its goal")
