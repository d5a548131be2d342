"""Several futures as one: sets of one belief, or days each as likely as any other."""

from collections.abc import Sequence

import numpy as np

from planner.arrays import first_rows
from planner.futures.edges_driven import EdgesDriven
from planner.futures.fates import Fates
from planner.futures.futures import Futures


def pooled(parts: Sequence[Futures]) -> Futures:
    """Return the particles of several futures as one, each set with its share of the weight.

    What became of them in traffic is known only if it is known of all.
    """
    counts = np.concatenate([np.diff(part.first_knot) for part in parts])
    return Futures(
        time_s=np.concatenate([part.time_s for part in parts]),
        x_m=np.concatenate([part.x_m for part in parts]),
        y_m=np.concatenate([part.y_m for part in parts]),
        first_knot=first_rows(counts),
        weight=np.concatenate([part.weight for part in parts]) / len(parts),
        gone=np.concatenate([part.gone for part in parts]),
        target=np.concatenate([part.target for part in parts]),
        edges=EdgesDriven.joined([part.edges for part in parts]),
        fates=Fates.joined([part.fates for part in parts]),
    )
