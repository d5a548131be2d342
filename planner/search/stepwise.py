"""Orders made leg by leg: what a next leg earns, and where to go when none earns anything."""

from collections.abc import Callable

import numpy as np

from planner.arrays import Floats, Ints
from planner.search.problem import Problem, candidate_legs
from planner.search.state import SearchState
from planner.search.what_if import Sightings, WhatIf

TIE = 1e-10  # of the most that can be earned; closer values are equal but for rounding

Step = Callable[[WhatIf, SearchState], SearchState | None]


def stepwise(engine: WhatIf, state: SearchState, step: Step) -> SearchState:
    """Return where a search comes to leg by leg, until no sighting is worth anything any more.

    Parameters
    ----------
    step
        Flies one leg or more; None where there is nothing left to do.
    """
    ends_s = engine.problem.objective.ends_s
    while state.time_s < ends_s:
        after = step(engine, state)
        if after is None:
            break
        state = after
    return state


def legs_ahead(problem: Problem, state: SearchState) -> Ints:
    """Return the legs that may be flown next and take time, (C,): both directions, any road."""
    legs = candidate_legs(problem, state)
    lasts_s = problem.legs.transit_s(state.x_m, state.y_m)[legs] + problem.legs.duration_s[legs]
    return legs[state.time_s + lasts_s > state.time_s]


def earned(problem: Problem, flights: Sightings) -> Floats:
    """Return what each flight's sightings are worth, all of them first ones, (C,)."""
    worth = problem.futures.weight[flights.particle] * problem.objective.reward(flights.seen_at)
    return flights.per_flight(worth)


def rate_of(gained: Floats, lasts_s: Floats) -> Floats:
    """Return gains per second of flight; a flight that takes no time has none."""
    return np.divide(gained, lasts_s, out=np.zeros(len(gained)), where=lasts_s > 0.0)


def first_greatest(value: Floats, alike: float) -> int:
    """Return the lowest index of the greatest values.

    Ties are common: two flights that see the same particles on the same way to different roads.
    Their sums differ by rounding, which must not decide.
    """
    return int(np.argmax(value >= value.max() - alike))


def first_fastest(problem: Problem, rates: Floats) -> int:
    """Return the lowest index of the greatest gains per second."""
    return first_greatest(rates, TIE * problem.objective.most / problem.horizon_s)


def after_flight(
    problem: Problem, state: SearchState, flights: Sightings, flight: int
) -> SearchState:
    """Return the state after one of the flights from it, with what that flight sees."""
    mine = slice(flights.first[flight], flights.first[flight + 1])
    seen_at = state.seen_at.copy()
    seen_at[flights.particle[mine]] = flights.seen_at[mine]
    return state.after(problem.legs, int(flights.leg[flight]), seen_at)


def toward_next(engine: WhatIf, state: SearchState) -> SearchState | None:
    """Return the state after flying to where an unseen particle can be met soonest.

    For when no leg sees anything: the UAV flies to the road that such a particle passes first of
    those it can reach, and to and fro there until it comes. None if none will come.
    """
    problem = engine.problem
    legs = legs_ahead(problem, state)
    start_s = np.full(len(problem.legs), np.inf)
    start_s[legs] = state.time_s + problem.legs.transit_s(state.x_m, state.y_m)[legs]
    first, from_s, to_s, _, particle, _ = engine.passages
    roads = len(problem.network.road_ids)
    road = np.repeat(np.arange(2 * roads) % roads, np.diff(first))
    leg = (2 * road[:, None] + (0, 1)).ravel()
    begins_s, over_s = np.repeat(from_s, 2), np.repeat(to_s, 2)
    meets_s = np.maximum(begins_s, start_s[leg])
    waits = np.repeat(np.isinf(state.seen_at[particle]), 2) & (start_s[leg] <= over_s)
    meets_s[~waits] = np.inf
    if len(meets_s) == 0 or meets_s.min() >= problem.objective.ends_s:
        return None
    soonest = int(np.argmin(meets_s))
    return _to_and_fro(problem, state, int(leg[soonest]), float(meets_s[soonest]))


def _to_and_fro(
    problem: Problem, state: SearchState, leg: int, until_s: float
) -> SearchState | None:
    flown = None
    while (flown or state).time_s <= until_s:
        state = flown or state
        if leg not in candidate_legs(problem, state):
            break
        flown, leg = state.after(problem.legs, leg, state.seen_at), leg ^ 1
    return flown
