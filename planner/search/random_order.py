"""Roads in random order and direction: what any planner has to beat."""

import numpy as np

from planner.flight.legs import Legs
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult


def random(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the plan that flies random roads, each at most once, in random directions."""
    roads = rng.permutation(len(problem.network.road_ids))[: budget.roads]
    against = rng.integers(0, 2, size=len(roads))
    legs = [Legs.both(int(road))[way] for road, way in zip(roads, against, strict=True)]
    return SearchResult(plan_of_legs(problem, "random", legs))
