"""Stretches of edges on which a target may be, each with its probability."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, freeze
from planner.belief.distribution import chosen
from planner.checked import finite, same_length, weights


@dataclass(frozen=True, eq=False)
class Stretches(Frozen):
    """Stretches, on each of which every metre is as probable as another."""

    edge: Ints  # (S,) edge index
    from_m: Floats  # (S,) metres along the edge
    to_m: Floats  # (S,)
    probability: Floats  # (S,) sums to one

    def __post_init__(self) -> None:
        freeze(self, edge=np.int32, from_m=np.float64, to_m=np.float64, probability=np.float64)
        ends = {"from_m": self.from_m, "to_m": self.to_m}
        same_length(edge=self.edge, probability=self.probability, **ends)
        finite(**ends)
        weights("probability", self.probability)

    @classmethod
    def by_length(cls, edge: Ints, from_m: Floats, to_m: Floats) -> "Stretches":
        """Return stretches that are as probable as they are long."""
        length_m = to_m - from_m
        return cls(edge, from_m, to_m, length_m / length_m.sum())

    def take(self, kept: Flags) -> "Stretches":
        """Return some of the stretches, their probabilities to one."""
        probability = self.probability[kept]
        return Stretches(
            self.edge[kept], self.from_m[kept], self.to_m[kept], probability / probability.sum()
        )

    def by_edge(self, edges: int) -> Floats:
        """Return the probability of each of so many edges, (E,)."""
        return np.asarray(np.bincount(self.edge, self.probability, edges), dtype=np.float64)

    def places(self, which: Floats, where: Floats) -> tuple[Offsets, Floats]:
        """Return the edges that the shares ``which`` fall on, and metres along them at ``where``.

        Both are numbers from 0 up to but not including 1, (N,).
        """
        stretch = chosen(self.probability, which)
        from_m, to_m = self.from_m[stretch], self.to_m[stretch]
        return self.edge[stretch].astype(np.int64), from_m + where * (to_m - from_m)
