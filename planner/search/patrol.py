"""Patrol: how a search goes on once a plan has found all of its own particles.

A thousand particles do not stand for every target there may be. A target that is a little slower,
or turns elsewhere, can slip past a plan that has seen every particle; about one in two hundred
does. So every particle that was seen counts as missed with a small probability, which grows with
the time since a UAV last had it in sight: the search returns to targets that were seen long ago,
and in the end stays where they rest.

A sensor that may miss needs no such doubt: nobody is ever surely seen, and the search goes on with
what the flights have missed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.evaluate import evaluate
from planner.search.fastest import fastest_gain, fly_fastest
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem, candidate_legs
from planner.search.state import SearchState
from planner.search.stepwise import after_flight, first_fastest, rate_of, stepwise
from planner.search.what_if import Sightings, WhatIf

# Of targets, by a plan that has seen all of a thousand particles; measured on grid5x5 alone.
MISSED = 0.005


def with_patrol(
    problem: Problem, order: Sequence[int], *, engine: WhatIf | None = None
) -> tuple[int, ...]:
    """Return an order of legs that goes on after its end, until the horizon or the landing.

    The patrol flies, leg by leg, where it earns most per second: with particles not seen, and with
    seen ones as far as they may have been missed. It ends early where nobody is left to be seen.

    Parameters
    ----------
    engine
        For this problem, if there is one already.
    """
    engine = engine or WhatIf(problem)
    if not problem.sensor.is_perfect:
        return stepwise(engine, after_legs(engine, order), fastest_gain).order
    return patrol(engine, _after(problem, order)).order


def most_with_patrol(problem: Problem, order: Sequence[int]) -> float:
    """Return what an order of legs earns at most on the holdout, however it goes on after its end.

    Whom it has not seen by its end, it sees then at the soonest. So a patrol need not be made where
    no patrol could help. Infinite where what is flown next changes how an order is flown or counts.
    """
    if not problem.sensor.is_perfect or problem.flown or problem.uav.aircraft is not None:
        return np.inf
    plan = plan_of_legs(problem, "", order)
    (legs,), holdout, objective = plan.legs, problem.holdout or problem.futures, problem.objective
    seen_at = evaluate(plan.tracks, holdout, problem.sensor, objective).seen_at
    end_s = legs[-1].end_s if legs else problem.first_state.time_s
    return float(holdout.weight @ objective.reward(np.minimum(seen_at, end_s)))


def patrol(engine: WhatIf, state: SearchState) -> SearchState:
    """Return the state at the end of a patrol; its seen times are the latest, not the first."""
    return stepwise(engine, state, _patrol)


def after_legs(engine: WhatIf, order: Sequence[int]) -> SearchState:
    """Return the state at the end of an order, as far as it can be flown."""
    state = engine.problem.first_state
    for leg in order:
        if leg not in candidate_legs(engine.problem, state):
            break
        state = after_flight(engine.problem, state, engine.fly(state, np.array([leg])), 0)
    return state


def _after(problem: Problem, order: Sequence[int]) -> SearchState:
    """Return the state at the end of an order, as far as it can be flown."""
    plan = plan_of_legs(problem, "", order)
    state = problem.first_state
    (legs,) = plan.legs
    for flown in legs:
        state = state.after(problem.legs, flown.leg, state.seen_at)
    seen_at = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective).seen_at
    return state.absorb(np.where(seen_at <= state.time_s, seen_at, np.inf))


@dataclass(frozen=True, eq=False)
class Missed:
    """What the next leg earns with everybody, who was seen as far as that may be a mistake."""

    engine: WhatIf
    state: SearchState

    def fly(self, legs: Ints) -> tuple[Sightings, Floats]:
        """Return the flights along legs and what each earns, (C,)."""
        problem = self.engine.problem
        everyone = np.ones(len(self.state.miss))  # who was seen is looked for again
        flights = self.engine.fly(self.state, legs, miss=everyone)
        reward = _doubt(problem, self.state, flights) * flights.worth
        return flights, flights.per_flight(problem.weight_at_start[flights.particle] * reward)

    def ceilings(self, legs: Ints) -> Floats:
        """Return what flights along legs earn at most, (C,)."""
        weight = self.engine.problem.weight_at_start
        return self.engine.ceilings(self.state, legs, weight, missed=MISSED)


def _patrol(engine: WhatIf, state: SearchState) -> SearchState | None:
    """Return the state after the patrol's next leg, the one that earns most per second."""
    flights, gained = fly_fastest(Missed(engine, state))
    if not gained.any():
        return None
    rates = rate_of(gained, flights.end_s - state.time_s)
    return after_flight(engine.problem, state, flights, first_fastest(engine.problem, rates))


def _doubt(problem: Problem, state: SearchState, flights: Sightings) -> Floats:
    """Return for each sighting the probability that it is the first, (M,).

    That is 1 if its particle was never seen.
    """
    since_s = flights.seen_at - state.seen_at[flights.particle]  # -inf: never seen
    return np.where(since_s < 0.0, 1.0, MISSED * np.minimum(1.0, since_s / problem.horizon_s))
