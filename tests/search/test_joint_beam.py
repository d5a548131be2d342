"""Joint orders of several UAVs against the enumeration of all of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.search.beam import RewardToGo
from planner.search.joint_beam import JointBeam, joint_orders
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from support.instances import figure3, grid, physics_futures
from support.search_instances import driven, most_together, seen_by_order

ALL = JointBeam(width=10**6, first_width=10**6)


def on_figure3(**changes: object) -> Problem:
    """Targets of many speeds that are looked for during some minutes only."""
    routes = [["AB", "BC", "CE"], ["AB", "BC", "CF"], ["AB", "BD", "DF"], ["AB", "BD", "DG"]]
    speeds = np.repeat(np.linspace(8.0, 40.0, 6), 4)
    futures = physics_futures(figure3(), routes * 6, 0.0, speeds, horizon_s=500.0)
    uav = Uav(x_m=-3_000.0, y_m=0.0, take_off_s=0.0, speed_mps=100.0)
    problem = Problem(figure3(), futures, uav, Sensor(300.0), Objective(430.0))
    return problem.replace(**changes)


def on_three_by_three(seed: int) -> Problem:
    rng = np.random.default_rng(seed)
    net = grid(3, 3, road_m=4_000.0)
    uav = Uav(*rng.uniform(-3_000.0, 3_000.0, 2), take_off_s=0.0, speed_mps=100.0)
    return Problem(net, driven(net, rng, 30), uav, Sensor(250.0), Objective(170.0))


def earned(problems: Sequence[Problem], found: Sequence[Sequence[int]]) -> float:
    """Return what orders earn together."""
    seen = [seen_by_order(problem, order) for problem, order in zip(problems, found, strict=True)]
    problem = problems[0]
    return float(problem.objective.reward(np.min(seen, axis=0)) @ problem.futures.weight)


@pytest.mark.parametrize("by_s", [None, 300.0])
def test_a_beam_that_drops_nothing_finds_the_best_pair_of_orders(by_s: float | None) -> None:
    first = on_figure3(objective=Objective(430.0, by_s))
    second = first.replace(uav=replace(first.uav, x_m=16_000.0, take_off_s=20.0, speed_mps=80.0))
    for problems in ((first, first), (first, second)):
        found, _ = joint_orders(problems, ALL, RewardToGo.of(first, []))
        assert earned(problems, found) == pytest.approx(most_together(problems), rel=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_two_searchers_on_three_by_three(seed: int) -> None:
    problem = on_three_by_three(seed)
    pair = (problem, problem)
    found, _ = joint_orders(pair, ALL, RewardToGo.of(problem, []))
    assert earned(pair, found) == pytest.approx(most_together(pair), rel=1e-6)


def test_a_uav_that_has_to_land_leaves_the_rest_to_the_other() -> None:
    long = on_figure3()
    short = long.replace(uav=replace(long.uav, max_flight_time_s=100.0, return_to_m=(0.0, 0.0)))
    found, _ = joint_orders((short, long), ALL, RewardToGo.of(long, []))
    assert plan_of_legs(short, "", found[0]).tracks[0].end_s <= 100.0 + 1e-6
    assert earned((short, long), found) == pytest.approx(most_together((short, long)), rel=1e-6)


def test_the_same_orders_come_of_the_same_problems() -> None:
    problem, beam = on_three_by_three(1), JointBeam(width=5, first_width=20, reach_m=5_000.0)
    one, again = (
        joint_orders((problem, problem), beam, RewardToGo.of(problem, [])) for _ in range(2)
    )
    assert one == again


def test_a_search_that_is_stopped_flies_what_it_has() -> None:
    problem = on_figure3()
    found, work = joint_orders((problem,), ALL, RewardToGo.of(problem, []), stop=lambda: True)
    assert (found, work) == ([[]], 0)
