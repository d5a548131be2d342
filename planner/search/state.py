"""Where a search stands: the UAV's place and time, and what it may have missed so far."""

from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Floats, Frozen, freeze
from planner.checked import number, same_length, set_fields
from planner.flight.legs import Legs


@dataclass(frozen=True, eq=False)
class SearchState(Frozen):
    """One UAV between two legs, and what has been seen so far.

    The mission from here on needs nothing else: all that can be learnt before the detection is
    "not seen yet".
    """

    time_s: float  # seconds on the target's clock
    x_m: float
    y_m: float
    miss: Floats  # (N,) probability that a particle is still unseen; a perfect sensor's: 0 or 1
    seen_at: Floats  # (N,) seconds, when first seen, or first in contact; inf: not yet
    order: tuple[int, ...] = ()  # legs flown

    def __post_init__(self) -> None:
        freeze(self, miss=np.float64, seen_at=np.float64)
        same_length(miss=self.miss, seen_at=self.seen_at)
        names = ("time_s", "x_m", "y_m")
        set_fields(self, {name: number(name, getattr(self, name)) for name in names})

    @classmethod
    def of_sightings(cls, time_s: float, x_m: float, y_m: float, seen_at: Floats) -> "SearchState":
        """Return the state of a UAV at a place and time, whose sensor misses nothing it sees.

        Parameters
        ----------
        seen_at
            When each particle was first seen, (N,) seconds, inf: not yet.
        """
        return cls(time_s, x_m, y_m, np.isinf(seen_at).astype(np.float64), seen_at)

    @property
    def roads(self) -> frozenset[int]:
        """Indices of the roads flown."""
        return frozenset(Legs.road(leg) for leg in self.order)

    def to_legs_s(self, legs: Legs) -> Floats:
        """Return the seconds until each leg could begin, (L,): straight flight, and corners."""
        return legs.transit_s(self.x_m, self.y_m) + self.turns_s(legs)

    def turns_s(self, legs: Legs) -> Floats:
        """Return the seconds lost at corners on the way to each leg, (L,)."""
        return legs.turns_s(self.x_m, self.y_m, self.order[-1] if self.order else None)

    def absorb(self, seen_at: Floats) -> "SearchState":
        """Return the state that also knows of other sightings, (N,) seconds: the earlier counts.

        This is all that lines 29-31 of Figure 6 have to do.
        """
        return self._with(np.minimum(self.seen_at, seen_at))

    def after(
        self, legs: Legs, leg: int, seen_at: Floats, miss: Floats | None = None
    ) -> "SearchState":
        """Return the state at the end of a leg, with the seen times then known, (N,) seconds.

        Parameters
        ----------
        miss
            Probability that each particle is still unseen then, (N,); if not given, nobody is who
            was seen.
        """
        last = legs.first_point[leg + 1] - 1
        start_s = self.time_s + float(self.to_legs_s(legs)[leg])
        known = self._with(seen_at)
        return replace(
            known,
            miss=known.miss if miss is None else miss,
            time_s=start_s + float(legs.after_s[last]),
            x_m=float(legs.x_m[last]),
            y_m=float(legs.y_m[last]),
            order=(*self.order, leg),
        )

    def _with(self, seen_at: Floats) -> "SearchState":
        """Return the state with these seen times: a perfect sensor misses nothing that it sees."""
        return replace(self, miss=np.where(np.isinf(seen_at), self.miss, 0.0), seen_at=seen_at)
