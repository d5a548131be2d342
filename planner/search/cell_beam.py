"""The best of some free flights that beams over a space-time cell index find."""

from collections.abc import Sequence

import numpy as np

from planner.flight.plan import Plan
from planner.search.anneal_waypoints import with_patrols
from planner.search.cell_flights import FreeFlight
from planner.search.dashes import portfolio
from planner.search.plan import needs_open_country, plan_of_waypoints
from planner.search.problem import Budget, Problem
from planner.search.result import SearchLog, SearchResult
from planner.search.sightings import holdout_value


def cells(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan of the best free flight; the holdout chooses between those behind dashes.

    Flights are made on the problem's proposals if there are any, else on its particles.

    Raises
    ------
    NotApplicableError
        If the sensor only looks along roads.
    """
    needs_open_country(problem, "cells")
    log = SearchLog(problem, budget)
    flights, work = portfolio(problem, budget.work, stop=log.stop, reached=log.reached)
    plans = free_plans(problem, flights, "cells")
    chosen = max(plans, key=lambda plan: holdout_value(problem, plan))
    log.reached(holdout_value(problem, chosen), work)
    return log.result(chosen)


def free_plans(problem: Problem, flights: Sequence[FreeFlight], method: str) -> list[Plan]:
    """Return the plans that fly free flights; also such that patrol roads once most is seen."""
    ways = [flight.waypoints for flight in flights]
    ways += [patrolled for way in tuple(ways) for patrolled in with_patrols(problem, way)]
    return [plan_of_waypoints(problem, method, way) for way in ways]
