"""POUCT of pomdp-py as a planner: Monte-Carlo tree search over the legs that begin nearby.

    pip install pomdp-py
    planner compare grid5x5 --method tools/peers/pouct.py:pouct

The hidden state is which particle the target is; all else (place and time of the UAV) follows from
the legs flown. What a leg sees is exact, by the same simulated flights that all planners ask. After
each leg the particles that it sees leave the belief, as the target has not been found.
"""

import random
from dataclasses import dataclass

import numpy as np
import pomdp_py

from planner import Budget, Problem, SearchResult, WhatIf, candidate_legs, plan_of_legs
from planner.arrays import Floats
from planner.search.state import SearchState

SIMULATIONS = 1000  # for each leg
NEAREST = 12  # legs to choose from
DEPTH = 15
EXPLORES = 0.3  # UCB1's constant; rewards are shares of the horizon


@dataclass(frozen=True)
class Leg(pomdp_py.Action):  # type: ignore[misc]
    """Fly a leg next; -1: nothing is left to do."""

    leg: int


@dataclass(frozen=True)
class Flight(pomdp_py.State):  # type: ignore[misc]
    """Which particle the target is, the legs flown, and what its sighting is worth, once seen."""

    particle: int
    order: tuple[int, ...]
    reward: float | None = None


@dataclass(frozen=True)
class Look(pomdp_py.Observation):  # type: ignore[misc]
    """What came of a leg."""

    is_seen: bool


class Flights:
    """What is known of flights from the states that the search comes to, computed once each."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.engine = problem, WhatIf(problem)
        self.states: dict[tuple[int, ...], SearchState] = {(): problem.first_state}
        self.known: dict[tuple[int, ...], dict[int, Floats]] = {}

    def legs(self, order: tuple[int, ...]) -> dict[int, Floats]:
        """Return when each leg nearby would see each particle, (N,) seconds, inf: not."""
        if order in self.known:
            return self.known[order]
        state, found = self.states[order], self.known.setdefault(order, {})
        if state.time_s < self.problem.horizon_s:
            legs = candidate_legs(self.problem, state)
            near = legs[np.argsort(state.to_legs_s(self.problem.legs)[legs], kind="stable")]
            everybody = np.ones(len(self.problem.futures))
            flown = self.engine.fly(state, np.sort(near[:NEAREST]), miss=everybody)
            for at, leg in enumerate(flown.leg.tolist()):
                found[leg] = flown.seen(at, len(everybody))
                self.states[*order, leg] = state.after(self.problem.legs, leg, state.seen_at)
        return found

    def forget_all_but(self, order: tuple[int, ...]) -> None:
        """Keep what goes on from an order alone; the rest, gigabytes, cannot come any more."""
        for known in (self.states, self.known):
            for one in [one for one in known if one[: len(order)] != order]:
                del known[one]


class Transition(pomdp_py.TransitionModel):  # type: ignore[misc]
    """What a leg does: it sees the target or not."""

    def __init__(self, flights: Flights) -> None:
        self.flights = flights

    def sample(self, state: Flight, action: Leg) -> Flight:
        """Return the next state."""
        if action.leg < 0:
            return state
        seen_at = self.flights.legs(state.order)[action.leg][state.particle]
        order = (*state.order, action.leg)
        if np.isinf(seen_at):
            return Flight(state.particle, order)
        worth = self.flights.problem.objective.reward(np.array([seen_at]))
        return Flight(state.particle, order, float(worth[0]))


class Looking(pomdp_py.ObservationModel):  # type: ignore[misc]
    """What is observed: whether the target has been seen."""

    def sample(self, next_state: Flight, action: Leg) -> Look:  # noqa: ARG002
        """Return it."""
        return Look(next_state.reward is not None)


class Reward(pomdp_py.RewardModel):  # type: ignore[misc]
    """What a sighting is worth, as a share of the horizon, when it comes."""

    def __init__(self, horizon_s: float) -> None:
        self.horizon_s = horizon_s

    def sample(self, state: Flight, action: Leg, next_state: Flight) -> float:  # noqa: ARG002
        """Return it."""
        is_new = state.reward is None and next_state.reward is not None
        return (next_state.reward or 0.0) / self.horizon_s if is_new else 0.0


class Policy(pomdp_py.RolloutPolicy):  # type: ignore[misc]
    """The legs nearby, at random in roll-outs."""

    def __init__(self, flights: Flights) -> None:
        self.flights = flights

    def get_all_actions(self, state: Flight, history: object = None) -> list[Leg]:  # noqa: ARG002
        """Return the legs that can be flown next."""
        legs = [] if state.reward is not None else [*self.flights.legs(state.order)]
        return [Leg(leg) for leg in legs or [-1]]

    def rollout(self, state: Flight, history: object = None) -> Leg:
        """Return one of them."""
        return random.choice(self.get_all_actions(state, history))


def pouct(problem: Problem, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the plan whose legs are chosen by pomdp-py's POUCT, one after the other."""
    random.seed(int(rng.integers(2**62)))  # pomdp-py draws by Python's own generator
    flights, order = Flights(problem), tuple[int, ...]()
    policy = Policy(flights)
    models = policy, Transition(flights), Looking(), Reward(problem.horizon_s)
    weight = problem.weight_at_start.copy()
    while weight.any() and not budget.stop(0):
        drawn = rng.choice(len(weight), SIMULATIONS, p=weight / weight.sum())
        belief = pomdp_py.Particles([Flight(one, order) for one in drawn.tolist()])
        agent = pomdp_py.Agent(belief, *models)
        search = pomdp_py.POUCT(
            max_depth=DEPTH,
            discount_factor=1.0,
            num_sims=SIMULATIONS,
            exploration_const=EXPLORES,
            rollout_policy=policy,
        )
        leg = search.plan(agent).leg
        if leg < 0:
            break
        weight[np.isfinite(flights.legs(order)[leg])] = 0.0
        order = (*order, leg)
        flights.forget_all_but(order)
    return SearchResult(plan_of_legs(problem, "pouct", order))
