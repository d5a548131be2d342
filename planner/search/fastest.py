"""Which legs earn most per second, found among thousands without flying them all."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from planner.arrays import Floats, Ints
from planner.search.state import SearchState
from planner.search.stepwise import (
    TIE,
    after_flight,
    earned,
    first_fastest,
    legs_ahead,
    rate_of,
    toward_next,
)
from planner.search.what_if import Sightings, WhatIf

FEW = 512  # legs that are flown all; the paper's grids have no more
FIRST = 64  # of more, how many of the most promising are flown before it is known which others


class Next(Protocol):
    """What the legs that may be flown next from a state earn."""

    @property
    def engine(self) -> WhatIf:
        """What flies them."""

    @property
    def state(self) -> SearchState:
        """Where they start."""

    def fly(self, legs: Ints) -> tuple[Sightings, Floats]:
        """Return the flights along legs, and what each earns, (C,)."""

    def ceilings(self, legs: Ints) -> Floats:
        """Return what flights along legs earn at most, (C,)."""


@dataclass(frozen=True, eq=False)
class Unseen:
    """What the next leg earns with the particles not seen yet."""

    engine: WhatIf
    state: SearchState

    def fly(self, legs: Ints) -> tuple[Sightings, Floats]:
        """Return the flights along legs, and what each earns, (C,)."""
        flights = self.engine.fly(self.state, legs)
        return flights, earned(self.engine.problem, self.state, flights)

    def ceilings(self, legs: Ints) -> Floats:
        """Return what flights along legs earn at most, (C,)."""
        unseen = self.engine.problem.futures.weight * self.state.miss
        return self.engine.ceilings(self.state, legs, unseen)


class Before(NamedTuple):
    """What was earned before the next leg, if that counts too."""

    reward: float
    since_s: float  # seconds, from when on it was


def fly_fastest(
    following: Next, *, count: int = 1, before: Before | None = None
) -> tuple[Sightings, Floats]:
    """Return flights along next legs, and what each earns, (C,): the fastest are among them.

    Legs left out certainly earn less per second than the ``count`` fastest ones; where one is
    wanted, those that certainly earn nothing are left out too. The others are flown exactly, so
    that whoever chooses between them chooses as between all. In small nets none is left out.

    Parameters
    ----------
    count
        How many of the fastest legs are wanted.
    before
        For gains per second over more than the next leg.
    """
    problem, state = following.engine.problem, following.state
    legs = legs_ahead(problem, state)
    if len(legs) <= FEW:
        return following.fly(legs)
    reward, since_s = before or (0.0, state.time_s)
    transit_s = problem.legs.transit_s(state.x_m, state.y_m)
    lasts_s = state.time_s + transit_s[legs] + problem.legs.duration_s[legs] - since_s
    most = following.ceilings(legs)
    rates = rate_of(reward + most, lasts_s)
    if count == 1:
        rates[rates <= 0.0] = -np.inf  # who wants several takes what earns nothing, too
    tried = np.sort(np.argsort(-rates, kind="stable")[: max(FIRST, count)])
    flights, gained = following.fly(legs[tried])
    reached = np.sort(rate_of(reward + gained, flights.end_s - since_s))
    alike = 2.0 * TIE * problem.objective.most / problem.horizon_s
    return following.fly(legs[rates >= reached[-min(count, len(reached))] - alike])


def fastest_gain(engine: WhatIf, state: SearchState) -> SearchState | None:
    """Return the state after the leg that earns most per second, or nearer to what is unseen."""
    problem = engine.problem
    flights, gained = fly_fastest(Unseen(engine, state))
    if not gained.any():
        return toward_next(engine, state)
    rates = rate_of(gained, flights.end_s - state.time_s)
    return after_flight(problem, state, flights, first_fastest(problem, rates))
