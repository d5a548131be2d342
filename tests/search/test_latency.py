"""Targets that rest make an order of roads a minimum latency tour, whose optimum is known.

Points are those of TSPLIB, optima those of Abeledo, Fukasawa, Pessoa and Uchoa (2013): the sum over
all points of when they are reached from the first one, and of when that is reached again, with
distances rounded to whole numbers.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.search.best import best
from planner.search.latency import is_latency, with_less_waiting
from planner.search.problem import Budget, Problem
from planner.streams import stream
from support.grid_instance import grid_futures, grid_problem
from support.instances import network_of_roads
from support.search_instances import random_problem

TOURS: dict[str, Any] = json.loads(
    (Path(__file__).parents[1] / "data" / "minimum_latency.json").read_text(encoding="utf-8")
)


def problem_of(xy: np.ndarray) -> Problem:
    """A road of a metre at each point but the first, with a target that rests there; kilometres."""
    nodes = {
        f"{end}{i}": (1000.0 * x + end, 1000.0 * y) for i, (x, y) in enumerate(xy) for end in (0, 1)
    }
    roads = [(f"r{i}", f"0{i}", f"1{i}") for i in range(1, len(xy))]
    used = {name: place for name, place in nodes.items() if int(name[1:])}
    count, place = len(xy) - 1, 1000.0 * xy[1:]
    futures = Futures(
        time_s=np.zeros(count),
        x_m=place[:, 0],
        y_m=place[:, 1],
        first_knot=np.arange(count + 1),
        weight=np.full(count, 1 / count),
        gone=np.zeros(count, dtype=bool),
    )
    return Problem(
        network=network_of_roads(used, roads),
        futures=futures,
        uav=Uav(*(1000.0 * xy[0]).tolist(), 0.0, 1000.0),
        sensor=Sensor(0.5, detects_in_transit=False),
        objective=Objective(1e6),
    )


def latency(xy: np.ndarray, tour: list[int]) -> float:
    way = np.array([0, *tour, 0])
    return float(np.cumsum(np.hypot(*np.diff(xy[way], axis=0).T).round()).sum())


@pytest.mark.parametrize(
    "name", ["eil51", *(pytest.param(one, marks=pytest.mark.long) for one in list(TOURS)[1:])]
)
def test_resting_targets_are_seen_almost_as_soon_as_can_be(name: str) -> None:
    xy = np.array(TOURS[name]["xy"], dtype=float)
    problem = problem_of(xy)
    plan = best(problem, budget=Budget(work=80_000), rng=stream(1, "best")).plan
    tour = list(dict.fromkeys(leg.leg // 2 + 1 for leg in plan.legs[0]))
    assert sorted(tour) == list(range(1, len(xy)))
    assert latency(xy, tour) <= 1.01 * TOURS[name]["optimum"]


@pytest.mark.parametrize("seed", range(6))
def test_the_same_legs_in_a_better_order(seed: int) -> None:
    """Its sums are those of the flight: nobody moves, and each road sees its own targets."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0.0, 40.0, (9, 2))
    problem = problem_of(xy)
    order = (2 * rng.permutation(8) + rng.integers(2, size=8)).tolist()
    found, work = with_less_waiting(problem, order, 2000, rng)
    assert sorted(leg // 2 for leg in found) == list(range(8))
    assert work <= 2000 + 10
    assert waited(xy, found) <= waited(xy, order) + 1e-9
    for i in range(8):
        for j in range(i):
            swapped = list(found)
            swapped[i], swapped[j] = found[j], found[i]
            assert waited(xy, found) <= waited(xy, swapped) + 0.01


def waited(xy: np.ndarray, order: list[int]) -> float:
    way = xy[[0, *(leg // 2 + 1 for leg in order)]]
    return float(np.cumsum(np.hypot(*np.diff(way, axis=0).T)).sum())


def test_only_where_targets_hardly_move() -> None:
    resting = problem_of(np.random.default_rng(1).uniform(0.0, 40.0, (5, 2)))
    assert is_latency(resting)
    assert not is_latency(grid_problem(grid_futures(20, np.random.default_rng(1))))
    assert not is_latency(resting.replace(objective=Objective(1e6, 100.0)))
    slow = grid_futures(20, np.random.default_rng(1))
    hundredth = replace(slow, time_s=100.0 * slow.time_s)
    assert is_latency(grid_problem(hundredth))
    assert not is_latency(random_problem(1))
