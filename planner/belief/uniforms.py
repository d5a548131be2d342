"""Columns of numbers in [0, 1), one per dimension of the prior, that draws are made from."""

from collections.abc import Iterator
from itertools import chain

import numpy as np

from planner.arrays import Floats

SOBOL_DIMENSIONS = 4096  # more turns than that are drawn independently
BLOCK = 2**22  # numbers of a Sobol sequence held at once (32 MB)

Columns = Iterator[Floats]  # each (n,)


def independent(n: int, rng: np.random.Generator) -> Columns:
    """Yield columns of independent draws without end.

    Each column has its own random stream, so a particle's draws depend neither on how many
    particles there are nor on how far the others go.
    """
    while True:
        yield rng.spawn(1)[0].random(n)


def sobol(n: int, dimensions: int, rng: np.random.Generator) -> Iterator[Columns]:
    """Yield blocks of columns, which together are n points of a scrambled Sobol sequence.

    The first ``dimensions`` columns are the sequence's (`SOBOL_DIMENSIONS` of them at most); the
    ones after it are independent. One block holds a power of two of points, which bounds memory.
    """
    from scipy.stats import qmc

    dimensions = min(dimensions, SOBOL_DIMENSIONS)
    np.empty(n * dimensions)  # far more than fits into memory is refused here, not after hours
    sequence = qmc.Sobol(dimensions, scramble=True, rng=rng.spawn(1)[0])
    rows = 2 ** int(np.log2(max(BLOCK // dimensions, 1)))
    rows = min(rows, 2 ** int(np.ceil(np.log2(n))))
    for first in range(0, n, rows):
        # Whole blocks: the sequence is balanced over powers of two and complains about others.
        points = sequence.random(rows)[: n - first]
        yield chain(points.T, independent(len(points), rng))
