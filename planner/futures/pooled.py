"""Several futures of one belief as one, so that rare motion is there more often."""

from collections.abc import Sequence

import numpy as np

from planner.arrays import first_rows
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures


def pooled(parts: Sequence[Futures]) -> Futures:
    """Return the particles of futures of the same belief as one, each of its share of weight."""
    counts = np.concatenate([np.diff(part.first_knot) for part in parts])
    columns = ("time_s", "x_m", "y_m", "gone", "target")
    weight = np.concatenate([part.weight for part in parts]) / len(parts)
    return Futures(
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in columns},
        first_knot=first_rows(counts),
        weight=weight,
        edges=EdgesDriven.joined([part.edges for part in parts]),
    )
