"""What chose a plan never estimates it: intervals from fresh targets hold what they say."""

from collections.abc import Iterator

import pytest

from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.search.beam import beam
from planner.search.problem import Budget
from planner.streams import stream
from support.grid_instance import grid_futures, grid_problem

PARTICLES, FRESH, MANY, SIZE = 40, 400, 30_000, 3


def plans(seeds: int) -> Iterator[tuple[float, Evaluation, Evaluation]]:
    """Each plan's true value, and what it seems on fresh targets and on its own particles."""
    world = grid_futures(MANY, stream(0, "world"), size=SIZE)
    for seed in range(seeds):
        own, holdout, fresh = (
            grid_futures(many, stream(seed, name), size=SIZE)
            for name, many in (("own", PARTICLES), ("holdout", PARTICLES), ("fresh", FRESH))
        )
        problem = grid_problem(own, size=SIZE, distance_m=20e3, radius_m=50.0)
        problem = problem.replace(holdout=holdout)
        rng = stream(seed, "planner")
        plan = beam(problem, budget=Budget(work=4000), rng=rng).plan
        values = [
            evaluate(plan.tracks, targets, problem.sensor, problem.objective)
            for targets in (world, fresh, own)
        ]
        yield values[0].expected_detection_time_s, values[1], values[2]


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [100, pytest.param(200, marks=pytest.mark.long)])
def test_the_interval_holds_the_value_as_often_as_it_says(seeds: int) -> None:
    fresh, own = 0, 0
    for value, on_fresh, on_own in plans(seeds):
        fresh += on_fresh.ci95_s[0] <= value <= on_fresh.ci95_s[1]
        own += on_own.ci95_s[0] <= value <= on_own.ci95_s[1]
    assert 0.92 * seeds <= fresh <= 0.98 * seeds
    assert own < 0.9 * seeds  # what a plan was made from flatters it
