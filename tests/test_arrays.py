"""Rows of many owners in one column, against lists of lists."""

from itertools import pairwise

import numpy as np
import pytest

from planner.arrays import first_kept, first_of_parts, first_rows, rows_taken

OWNED = (["a", "b"], [], ["c"], ["d", "e", "f"])
COLUMN = np.array([row for rows in OWNED for row in rows])
FIRST = np.array([0, 2, 2, 3, 6])


def lists(first: np.ndarray, column: np.ndarray) -> list[list[str]]:
    return [column[a:b].tolist() for a, b in pairwise(first)]


def test_rows_start_where_those_before_end() -> None:
    assert first_rows([2, 0, 1, 3]).tolist() == FIRST.tolist()
    assert first_of_parts(OWNED).tolist() == FIRST.tolist()
    assert first_rows([]).tolist() == [0]
    assert first_of_parts([]).dtype == np.int64


@pytest.mark.parametrize("owners", [[0, 1, 2, 3], [3, 0], [1], [2, 2], []])
def test_rows_are_taken_with_their_owners(owners: list[int]) -> None:
    rows, first = rows_taken(FIRST, np.array(owners, dtype=np.int64))
    assert lists(first, COLUMN[rows]) == [OWNED[owner] for owner in owners]


@pytest.mark.parametrize("kept", ["abcdef", "ace", "f", ""])
def test_kept_rows_stay_with_their_owners(kept: str) -> None:
    stays = np.isin(COLUMN, [*kept])
    found = lists(first_kept(FIRST, stays), COLUMN[stays])
    assert found == [[row for row in rows if row in kept] for rows in OWNED]
