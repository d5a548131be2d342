"""A pilot's patterns as planners: each is tuned on the planning particles."""

from collections.abc import Callable

import numpy as np

from planner.arrays import Floats
from planner.search import patterns
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.tuning import Layout, Tuner, Whereabouts

Pass = Callable[[Layout, int], Floats]  # the points of a pattern's pass by number, (W, 2)


def hover(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the plan that hovers over the best place of those where particles set out.

    Raises
    ------
    NotApplicableError
        If the sensor only looks along roads, or no particle ever sets out.
    """
    tuner = Tuner(problem, budget, "hover")
    where = Whereabouts.of(problem, rng)
    tuner.is_better(np.array([where.last_seen]))
    while tuner.goes_on:
        tuner.is_better(where.starts_xy_m[[where.any_particle(rng)]])
    return tuner.result()


def spiral(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the best spiral outwards; further ones fly between its tracks."""

    def one_pass(at: Layout, number: int) -> Floats:
        course_deg = at.course_deg + 180.0 * number
        return patterns.spiral(at.centre, at.spacing_m, at.extent_m, course_deg)

    return _tuned(problem, budget, rng, "spiral", one_pass)


def expanding_square(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the best expanding square search; further ones are turned by 45 degrees."""

    def one_pass(at: Layout, number: int) -> Floats:
        course_deg = at.course_deg + patterns.SECOND_SQUARE_DEG * number
        return patterns.expanding_square(at.centre, at.spacing_m, at.extent_m, course_deg)

    return _tuned(problem, budget, rng, "expanding-square", one_pass)


def sector(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the best sector search; further ones are turned by 30 degrees."""

    def one_pass(at: Layout, number: int) -> Floats:
        course_deg = at.course_deg + patterns.SECOND_SECTORS_DEG * number
        return patterns.sector_search(at.centre, at.extent_m, course_deg)

    return _tuned(problem, budget, rng, "sector", one_pass)


def lawnmower(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the best parallel tracks over a rectangle, flown there and back again."""

    def one_pass(at: Layout, number: int) -> Floats:
        oblong = np.sqrt(at.slimness)
        length_m, width_m = 2.0 * at.extent_m / oblong, 2.0 * at.extent_m * oblong
        tracks = patterns.parallel_track(at.centre, length_m, width_m, at.spacing_m, at.course_deg)
        return tracks[:: -1 if number % 2 else 1]

    return _tuned(problem, budget, rng, "lawnmower", one_pass)


def _tuned(
    problem: Problem, budget: Budget, rng: np.random.Generator, method: str, one_pass: Pass
) -> SearchResult:
    """Return the best plan of a pattern that is repeated until the search ends.

    Raises
    ------
    NotApplicableError
        If the sensor only looks along roads, or no particle ever sets out.
    """
    tuner = Tuner(problem, budget, method)
    where = Whereabouts.of(problem, rng)

    def is_better(layout: Layout) -> bool:
        points = patterns.repeated(lambda number: one_pass(layout, number), where.flight_m)
        return tuner.is_better(points)

    best = where.by_the_book
    is_better(best)
    while tuner.goes_on:
        step = tuner.step
        layout = where.flyable(where.drawn(rng) if step > 1.0 else best.near(rng, step))
        if is_better(layout):
            best = layout
    return tuner.result()
