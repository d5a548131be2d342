"""Nobody sees a particle sooner than the bound thinks, particle by particle.

With one particle cheap and all others dearer than any sighting, a bound is nothing but the prices
and what the earliest sighting is worth above its own. So an error of a second shows, which many
particles and plans far from the best would hide.
"""

import numpy as np
import pytest

from planner.arrays import Floats
from planner.bounds.movements import Movements
from planner.bounds.particle_prices import table_of
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from support.cases import some_in_the_gate
from support.search_instances import random_problem

BELOW = 1e-3  # of a unit of reward: how much the cheap particle costs less than it earns


def rewards_of(problem: Problem, order: list[int]) -> Floats:
    track = plan_of_legs(problem, "", order).tracks[0]
    return problem.objective.reward(
        first_detection(problem.futures, track, problem.sensor.radius_m)
    )


def most_seen(problem: Problem, rng: np.random.Generator, many: int) -> Floats:
    """The most that random short plans earn with each particle, (N,)."""
    legs, most = problem.legs, np.zeros(len(problem.futures))
    for _ in range(many):
        order = [int(rng.integers(len(legs)))]
        while len(order) < 1 + rng.integers(5):
            onward = np.flatnonzero(legs.from_node == legs.to_node[order[-1]])
            near = len(onward) > 0 and rng.random() < 0.8
            order.append(int(rng.choice(onward) if near else rng.integers(len(legs))))
        most = np.maximum(most, rewards_of(problem, order))
    return most


@pytest.mark.parametrize("seed", some_in_the_gate(48, 20))
def test_the_earliest_sighting_is_offered(seed: int) -> None:
    problem, rng = random_problem(seed, particles=12), np.random.default_rng(seed)
    problem = problem.replace(objective=Objective(700.0, 500.0 if seed % 5 == 0 else None))
    weight, dear = problem.futures.weight, problem.objective.most + 1.0
    most_of = most_seen(problem, rng, 1500)
    floor = np.maximum(0.0, most_of - BELOW) * (seed % 2)  # the cheap price, or nothing
    movements = Movements(problem)
    table = table_of(movements, movements.fitting_bin_s)
    table = table.narrowed(floor, np.ones(len(floor)), table.starts)
    for k, most in enumerate(most_of.tolist()):
        if most <= BELOW:
            continue
        prices = np.full(len(weight), dear)
        prices[k] = most - BELOW
        others = dear * (float(weight.sum()) - weight[k])
        bound, counts = table.bound(prices)
        assert bound >= others + weight[k] * most - 1e-9
        assert counts[k] >= 1.0
        assert np.count_nonzero(counts) == 1
