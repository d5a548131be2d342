"""Simulation-aided path planning: Figures 4, 5 and 6 of the paper, one road after the other.

The printed pseudo-code leaves choices open; each is an option, the first value being the default.
"""

from collections.abc import Callable

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.errors import InputError, NotApplicableError
from planner.futures.futures import Futures
from planner.search.greedy_options import GreedyOptions
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem, candidate_legs
from planner.search.result import SearchResult
from planner.search.state import SearchState
from planner.search.stepwise import TIE, after_flight, first_greatest, rate_of
from planner.search.what_if import Sightings, WhatIf

Resample = Callable[[int], Futures]


def greedy(
    problem: Problem,
    *,
    budget: Budget,
    rng: np.random.Generator,  # noqa: ARG001  (every planner takes one)
    options: GreedyOptions | None = None,
    resample: Resample | None = None,
) -> SearchResult:
    """Return the plan of the paper's simulation_aided_planning (Figure 4).

    Parameters
    ----------
    rng
        Not used: all chance lies in the particles.
    resample
        Gives the particles of step 0, 1, ... if ``options.particles`` is "anew": as many each
        time as the problem has.

    Raises
    ------
    NotApplicableError
        If particles are to be drawn anew and no `resample` is given.
    """
    options = options or GreedyOptions()
    state = problem.first_state  # line 1: best_path is empty
    engine = WhatIf(problem)
    observed = np.zeros((len(problem.legs), len(state.seen_at)), dtype=np.bool_)
    # line 3: while best_path is not long enough
    while len(state.order) < budget.roads and not _over(problem, state, options):
        if options.particles == "anew":  # line 4: sample (Figure 5)
            engine = WhatIf(_drawn(problem, resample, len(state.order)))
        # lines 5-9: how the particles move until now is recorded in the futures
        removed = state.roads if options.roads == "removed" else frozenset()  # line 13
        legs = candidate_legs(problem, state, directions=options.direction, removed=removed)
        if len(legs) == 0:
            break
        flights, i = what_if_simulations(engine, state, legs, observed, options)  # 10
        state = after_flight(problem, state, flights, i)  # lines 11, 12 and 14
    return SearchResult(plan_of_legs(problem, "greedy", state.order))


def what_if_simulations(
    engine: WhatIf, state: SearchState, legs: Ints, observed: Flags, options: GreedyOptions
) -> tuple[Sightings, int]:
    """Return the simulations of Figure 6, and the index of the one that it chooses.

    Parameters
    ----------
    legs
        ``roads`` of the figure: what each simulation flies, (C,).
    observed
        The figure's matrix, a row per simulation; changed if flags are read "times only".
    """
    # lines 1-7: all flights set out from the same place and time
    if options.flags == "times only" and engine.problem.sensor.is_perfect:
        flights = _fly(engine, state, legs, np.ones(len(state.miss)), options)
        flights = flights.those(~observed[flights.flight, flights.particle])  # line 18
        observed[flights.flight, flights.particle] = True  # line 19
    else:
        flights = _fly(engine, state, legs, state.miss, options)
    # Line 28; in lines 29-31 all simulations take over the times of the best one (line 20).
    return flights, _arg_min(engine.problem, state, flights, options)


def _fly(
    engine: WhatIf, state: SearchState, legs: Ints, miss: Floats, options: GreedyOptions
) -> Sightings:
    """Lines 8-27: the while loop over ticks, or its limit for ever shorter ticks."""
    if options.tick_s > 0.0:
        return engine.fly_by_ticks(state, legs, options.tick_s, miss=miss)
    return engine.fly(state, legs, miss=miss)


def _arg_min(
    problem: Problem, state: SearchState, flights: Sightings, options: GreedyOptions
) -> int:
    """Line 28: the flight with the least mean of the observation times, by the reading of a miss.

    What the particles cost that a flight does not see is the same for all flights; so they are
    compared by what their sightings take off the sum, without the rounding of the sum.
    """
    objective, sensor = problem.objective, problem.sensor
    unseen = problem.weight_at_start if sensor.is_perfect else problem.futures.weight * state.miss
    weight = unseen[flights.particle]
    before = state.seen_at[flights.particle] if sensor.is_perfect else np.full(len(weight), np.inf)
    if options.miss == "infinity":
        by_s = np.inf if objective.by_s is None else objective.by_s
        newly_seen = flights.per_flight(
            weight * flights.share * (np.isinf(before) & (flights.seen_at <= by_s))
        )
        earlier = flights.share * (np.where(np.isinf(before), 0.0, before) - flights.seen_at)
        most = newly_seen >= newly_seen.max() - TIE
        sooner = np.where(most, flights.per_flight(weight * earlier), -np.inf)
        return _tie_broken(sooner, TIE * problem.horizon_s, flights, options)
    gain = flights.worth - objective.reward(before)
    gained = flights.per_flight(weight * gain)
    alike = TIE * objective.most
    if options.miss == "rate":
        gained = rate_of(gained, flights.end_s - state.time_s)
        alike /= problem.horizon_s
    return _tie_broken(gained, alike, flights, options)


def _tie_broken(value: Floats, alike: float, flights: Sightings, options: GreedyOptions) -> int:
    if options.ties == "lowest index":
        return first_greatest(value, alike)
    return first_greatest(np.where(value >= value.max() - alike, -flights.end_s, -np.inf), 0.0)


def _over(problem: Problem, state: SearchState, options: GreedyOptions) -> bool:
    left = ~np.isfinite(state.seen_at) if problem.sensor.is_perfect else state.miss > 0.0
    found = options.ends == "all found" and not left.any()
    return found or state.time_s >= problem.objective.ends_s


def _drawn(problem: Problem, resample: Resample | None, step: int) -> Problem:
    if resample is None:
        raise NotApplicableError(
            'greedy.particles = "anew" needs the belief to draw from, not futures alone; use "once"'
        )
    futures = resample(step)
    if len(futures) != len(problem.futures):
        raise InputError(
            f"greedy: {len(futures)} particles drawn anew, but there were "
            f"{len(problem.futures)} before; keep their number"
        )
    return problem.replace(futures=futures)
