"""What driving targets costs, as it was measured, and with how many runs of SUMO."""

import numpy as np
import pytest

from planner.futures.cost import Cost, cost_of, shares_runs
from planner.futures.record import SHARED
from planner.mission.opening import OpenScenario
from support.sumo_instances import grid5x5, town

TWENTY_MINUTES_S = 1200.0


def alone(opened: OpenScenario, particles: int, horizon_s: float = TWENTY_MINUTES_S) -> Cost:
    return cost_of(opened.network, particles, driving="free", horizon_s=horizon_s)


def test_a_town_s_targets_cost_what_was_measured(berlin: OpenScenario) -> None:
    cost = alone(berlin, 400)
    assert cost.runs == 400
    assert cost.cpu_s / 400 == pytest.approx(0.020, rel=0.02)
    assert cost.load_s == pytest.approx(0.34, rel=0.02)
    assert alone(berlin, 400, 2 * TWENTY_MINUTES_S).cpu_s == pytest.approx(2 * cost.cpu_s)


def test_a_large_town_s_targets_cost_what_was_measured(luxembourg: OpenScenario) -> None:
    cost = alone(luxembourg, 1)
    assert cost.cpu_s == pytest.approx(0.035, rel=0.02)
    assert cost.load_s == pytest.approx(1.2, rel=0.02)


def test_in_traffic_a_copy_counts_and_grows_with_the_time(berlin: OpenScenario) -> None:
    short, long = (
        cost_of(berlin.network, 95, driving="traffic", horizon_s=horizon_s)
        for horizon_s in (600.0, 1200.0)
    )
    assert short.runs == long.runs == 10
    assert long.cpu_s == pytest.approx(2 * short.cpu_s)
    assert 0.1 < long.cpu_s / 95 < 1.0  # 0.15 in Berlin at 1,000 vehicles an hour, more in a jam


def test_targets_of_the_grid_share_runs() -> None:
    grid = grid5x5()
    assert shares_runs(grid, "constant")
    assert not shares_runs(grid, "free")
    cost = cost_of(grid, 10 * SHARED + 1, driving="constant", horizon_s=10_000.0)
    assert cost.runs == 11
    assert cost.cpu_s == pytest.approx(2.2, rel=0.1)  # 0.17 to 0.22 s for a hundred
    assert cost.load_s == 0.0


def test_streets_of_several_lanes_are_driven_one_by_one() -> None:
    network = town()
    assert np.any(network.edge_lanes > 1)
    assert cost_of(network, 7, driving="constant", horizon_s=100.0).runs == 7


def test_processes_share_the_runs_but_each_reads_the_net() -> None:
    cost = Cost(runs=3, cpu_s=6.0, load_s=1.0)
    assert [cost.wall_s(workers) for workers in (1, 2, 3, 99)] == [7.0, 4.0, 3.0, 3.0]
