"""Orders made leg by leg: what the next leg earns, and where to go when none earns anything."""

from collections.abc import Callable

import numpy as np

from planner.arrays import Floats, Ints
from planner.flight.legs import Legs
from planner.search.problem import Problem, candidate_legs
from planner.search.state import SearchState
from planner.search.what_if import Sightings, WhatIf

TIE = 1e-10  # of the most that can be earned; closer values are equal but for rounding
MOST_FLIGHTS = 1_000_000  # what-if flights of one order: seconds, even if its legs take none

Step = Callable[[WhatIf, SearchState], SearchState | None]


def stepwise(engine: WhatIf, state: SearchState, step: Step) -> SearchState:
    """Return the state in which a search ends that is made step by step.

    It goes on until no sighting is worth anything any more, or until so many legs were tried that
    the order would never end: roads of metres, a horizon of days.

    Parameters
    ----------
    step
        Returns the state after one leg or more; None where there is nothing left to do.
    """
    problem = engine.problem
    most_legs = len(state.order) + max(1, MOST_FLIGHTS // max(1, len(problem.legs)))
    while state.time_s < problem.objective.ends_s and len(state.order) < most_legs:
        after = step(engine, state)
        if after is None:
            break
        state = after
    return state


def legs_ahead(problem: Problem, state: SearchState) -> Ints:
    """Return the legs that may be flown next and take time, (C,): both directions, any road."""
    legs = candidate_legs(problem, state)
    lasts_s = state.to_legs_s(problem.legs)[legs] + problem.legs.duration_s[legs]
    return legs[state.time_s + lasts_s > state.time_s]


def earned(problem: Problem, state: SearchState, flights: Sightings) -> Floats:
    """Return the expected reward of each flight from a state, (C,)."""
    unseen = (problem.futures.weight * state.miss)[flights.particle]
    return flights.per_flight(unseen * flights.worth)


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
    many = len(state.seen_at)
    now_seen_at = flights.seen(flight, many)
    seen_at = np.where(np.isfinite(now_seen_at), now_seen_at, state.seen_at)
    miss = state.miss * flights.missed(flight, many)
    return state.after(problem.legs, int(flights.leg[flight]), seen_at, miss)


def toward_next(engine: WhatIf, state: SearchState) -> SearchState | None:
    """Return the state after flying to where an unseen particle can be met soonest.

    For when no leg sees anything: of the roads that the UAV can reach in time, it flies to the one
    that an unseen particle passes first, and to and fro there until the particle comes. None if
    none will come.
    """
    problem = engine.problem
    legs = legs_ahead(problem, state)
    start_s = np.full(len(problem.legs), np.inf)
    start_s[legs] = state.time_s + state.to_legs_s(problem.legs)[legs]
    passages = engine.index.passages
    roads = len(problem.network.road_ids)
    both = np.array([Legs.both(road) for road in range(roads)]).reshape(-1, 2)
    road = np.repeat(np.arange(2 * roads) % roads, np.diff(passages.first))
    leg = both[road].ravel()
    begins_s, over_s = np.repeat(passages.from_s, 2), np.repeat(passages.to_s, 2)
    meets_s = np.maximum(begins_s, start_s[leg])
    waits = np.repeat(state.miss[passages.particle] > 0.0, 2) & (start_s[leg] <= over_s)
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
        flown = state.after(problem.legs, leg, state.seen_at, state.miss)
        leg = Legs.reverse(leg)
    return flown
