"""Where a search stands: the UAV's place and time, and when each particle was first seen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from planner.arrays import Floats, Ints, freeze
from planner.search.problem import Problem

Directions = Literal["own", "both", "nearest end"]


@dataclass(frozen=True, eq=False)
class SearchState:
    """One UAV between two legs, and what has been seen so far.

    The mission from here on needs nothing else: with a perfect sensor all that can be learnt
    before the detection is "not seen yet".
    """

    time_s: float  # seconds on the target's clock
    x_m: float
    y_m: float
    seen_at: Floats  # (N,) seconds, inf: not seen yet
    order: tuple[int, ...] = ()  # legs flown

    def __post_init__(self) -> None:
        freeze(self, seen_at=np.float64)

    @classmethod
    def at_start(cls, problem: Problem) -> "SearchState":
        """Return the state before take-off: nothing flown, nothing seen."""
        uav = problem.uavs[0]
        return cls(uav.take_off_s, uav.x_m, uav.y_m, np.full(len(problem.futures), np.inf))

    @property
    def roads(self) -> frozenset[int]:
        """Indices of the roads flown."""
        return frozenset(leg // 2 for leg in self.order)

    def absorb(self, seen_at: Floats) -> "SearchState":
        """Return the state that also knows of other sightings, (N,) seconds: the earlier counts.

        This is all that lines 29-31 of Figure 6 have to do.
        """
        return replace(self, seen_at=np.minimum(self.seen_at, seen_at))

    def after(self, problem: Problem, leg: int, seen_at: Floats) -> "SearchState":
        """Return the state at the end of a leg, with the seen times then known, (N,) seconds."""
        legs = problem.legs
        last = legs.first_point[leg + 1] - 1
        start_s = self.time_s + float(legs.transit_s(self.x_m, self.y_m)[leg])
        return replace(
            self,
            seen_at=seen_at,
            time_s=start_s + float(legs.after_s[last]),
            x_m=float(legs.x_m[last]),
            y_m=float(legs.y_m[last]),
            order=(*self.order, leg),
        )


def candidate_legs(
    problem: Problem,
    state: SearchState,
    *,
    directions: Directions = "both",
    removed: Sequence[int] | frozenset[int] = frozenset(),
) -> Ints:
    """Return the legs that may be flown next, (C,) rising leg indices.

    Parameters
    ----------
    directions
        Each road in its "own" direction, in "both", or from its "nearest end", seen from the
        UAV's place (the own direction if both are equally near).
    removed
        Roads that are not flown any more. Legs from whose end the UAV could not come home
        before its landing never are.
    """
    legs = problem.legs
    transit_s = legs.transit_s(state.x_m, state.y_m)
    end_s = state.time_s + transit_s + legs.duration_s
    allowed = end_s + problem.home_s[legs.to_node] <= problem.uavs[0].landing_s
    allowed[[leg for road in removed for leg in (2 * road, 2 * road + 1)]] = False
    if directions == "own":
        allowed[1::2] = False
    elif directions == "nearest end":
        reverse = transit_s[1::2] < transit_s[::2]
        allowed[::2] &= ~reverse
        allowed[1::2] &= reverse
    return np.flatnonzero(allowed).astype(np.int32)
