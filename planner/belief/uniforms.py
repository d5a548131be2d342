"""Columns of numbers in [0, 1), one per dimension of the prior, that draws are made from."""

from collections.abc import Iterator
from itertools import chain, count

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
    With as many dimensions a row is the same however many there are, and whatever columns of the
    rows before it were taken.
    """
    from scipy.stats import qmc

    dimensions = min(dimensions, SOBOL_DIMENSIONS)
    np.empty(n * dimensions)  # far more than fits into memory is refused here, not after hours
    sequence = qmc.Sobol(dimensions, scramble=True, rng=rng.spawn(1)[0])
    rows = 2 ** int(np.log2(max(BLOCK // dimensions, 1)))
    rows = min(rows, 2 ** int(np.ceil(np.log2(n))))
    further = _Further(rng)
    for first in range(0, n, rows):
        # Whole blocks: the sequence is balanced over powers of two and complains about others.
        points = sequence.random(rows)[: n - first]
        yield chain(points.T, further.of_rows(first, len(points)))


class _Further:
    """Independent columns, each with its own random stream, given out in blocks of rows."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._columns: list[np.random.Generator] = []
        self._given: list[int] = []  # how many rows of each column

    def of_rows(self, first: int, rows: int) -> Columns:
        """Yield columns of rows that come after those of the blocks before."""
        for column in count():
            if column == len(self._columns):
                self._columns += self._rng.spawn(1)
                self._given.append(0)
            draws = self._columns[column]
            draws.random(first - self._given[column])  # of rows that did not ask for this column
            self._given[column] = first + rows
            yield draws.random(rows)
