"""The planner from outside: what it weighs, and what it keeps to."""

import numpy as np
import pytest

from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.search.orienteering import orienteering, passing_probability
from planner.search.problem import Budget, Problem
from support.grid_instance import grid_futures, grid_problem
from support.instances import figure3, physics_futures

pytest.importorskip("ortools")


def figure3_problem(*, horizon_s: float = 3600.0) -> Problem:
    network = figure3()
    paths = [path.split() for path in ("AB BC CE", "AB BC CE", "AB BC CF", "AB BD DG")]
    futures = physics_futures(network, paths, 0.0, np.full(4, 20.0))
    return Problem(
        network, futures, Uav(-30e3, 0.0, 0.0, 100.0), Sensor(200.0), Objective(horizon_s)
    )


def test_a_road_is_worth_the_probability_that_the_target_passes() -> None:
    problem = figure3_problem()
    share = dict(zip(problem.network.road_ids, passing_probability(problem), strict=True))
    assert share["AB"] == pytest.approx(1.0)
    assert share["BC"] == pytest.approx(0.75)
    assert share["CE"] == pytest.approx(0.5)
    assert share["DF"] == 0.0


def test_the_tour_flies_what_is_worth_most_within_its_time() -> None:
    """Time for one road only: the one that every target passes."""
    long = figure3_problem()
    legs = long.legs
    first = 2 * long.network.road_ids.index("AB")
    there_s = float(legs.transit_s(-30e3, 0.0)[first] + legs.duration_s[first])
    plan = orienteering(
        long.replace(objective=Objective(there_s + 1.0)),
        budget=Budget(),
        rng=np.random.default_rng(0),
    ).plan
    assert [flown.road for flown in plan.legs[0]] == [first // 2]


def test_each_road_once_and_home_in_time() -> None:
    problem = grid_problem(grid_futures(100, np.random.default_rng(1), size=4), size=4)
    uav = Uav(0.0, 0.0, 0.0, 100.0, max_flight_time_s=2000.0, return_to_m=(0.0, 0.0))
    plan = orienteering(
        problem.replace(uav=uav), budget=Budget(), rng=np.random.default_rng(0)
    ).plan
    roads = [flown.road for flown in plan.legs[0]]
    assert len(roads) == len(set(roads)) > 5
    assert plan.tracks[0].end_s <= 2000.0
