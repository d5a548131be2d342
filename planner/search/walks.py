"""What a UAV remembers: the last legs that it has flown without a straight flight in between."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.search.hops import Hops

Walk = tuple[int, ...]
ROUNDING = 1e-9  # of a bin, by which a hop may seem to end in the next one


def bins_of(duration_s: Floats, bin_s: float) -> Ints:
    """Return how many bins on a flight may end, at least and at most, (..., 2)."""
    bins = np.asarray(duration_s) / bin_s
    return np.stack([np.floor(bins + ROUNDING), np.ceil(bins - ROUNDING)], axis=-1).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Walks:
    """All walks of up to ``memory`` legs; the first V are the empty ones, one at each node."""

    ends_at: Ints  # (walks,) node index
    first: Offsets  # (legs + 1,) where a leg's contexts start
    before: Ints  # (C,) walk that may come before the leg; the empty one first, then by length
    then: Ints  # (C,) walk that is remembered after it
    legs: Sequence[Ints]  # per leg: the first leg of each context but the empty one
    shorter: Sequence[Ints]  # per leg: the context without that first leg, -1: the empty one
    lasts_s: Sequence[Floats]  # per leg: how long the walk lasts, seconds

    @classmethod
    def of(cls, hops: Hops, nodes: int, memory: int) -> "Walks":
        """Return the walks along a net's legs."""
        walks: list[tuple[Walk, int]] = [((), node) for node in range(nodes)]
        layer = list(walks)
        for _ in range(memory):
            layer = [
                ((*walk, leg), int(hops.to_node[leg]))
                for walk, node in layer
                for leg in np.flatnonzero(hops.from_node[: hops.legs] == node).tolist()
            ]
            walks += layer
        # A walk of legs is reached from one empty walk only: that at its first node.
        index = {walk: i for i, walk in enumerate(walks)}
        contexts = [[walk for walk in walks if walk[1] == node] for node in range(nodes)]
        before, then, legs, shorter, lasts_s = [], [], [], [], []
        for leg in range(hops.legs):
            known = contexts[hops.from_node[leg]]
            place = {walk: i - 1 for i, (walk, _) in enumerate(known)}
            before += [index[walk] for walk in known]
            after = [(*walk, leg)[-memory:] if memory else () for walk, _ in known]
            then += [index[(walk, int(hops.to_node[leg]))] for walk in after]
            legs.append(np.array([walk[0] for walk, _ in known[1:]], dtype=np.int64))
            shorter.append(np.array([place[walk[1:]] for walk, _ in known[1:]], dtype=np.int64))
            lasts_s.append(np.array([hops.duration_s[list(walk)].sum() for walk, _ in known[1:]]))
        counts = [len(contexts[node]) for node in hops.from_node[: hops.legs]]
        return cls(
            ends_at=np.array([node for _, node in walks], dtype=np.int64),
            first=np.concatenate(([0], np.cumsum(counts))).astype(np.int64),
            before=np.array(before, dtype=np.int64),
            then=np.array(then, dtype=np.int64),
            legs=legs,
            shorter=shorter,
            lasts_s=lasts_s,
        )
