"""The edges that particles drive, against asking row by row."""

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import InputError
from planner.futures.edges_driven import NO_EDGE, EdgesDriven

PARTICLES = 12


@pytest.fixture(params=range(5))
def rows(request: pytest.FixtureRequest) -> tuple[list[int], list[float], list[int]]:
    """Which particle is on which edge from when on, in any order; some particles are not there."""
    rng = np.random.default_rng(request.param)
    particle = rng.choice(PARTICLES - 2, 60) + 1
    time_s = rng.permutation(60) * 2.0
    return particle.tolist(), time_s.tolist(), rng.integers(NO_EDGE, 3, 60).tolist()


def edge_at(rows: tuple[list[int], list[float], list[int]], particle: int, at_s: float) -> int:
    mine = [(t, edge) for who, t, edge in zip(*rows, strict=True) if who == particle and t <= at_s]
    return max(mine)[1] if mine else NO_EDGE


def of(rows: tuple[list[int], list[float], list[int]]) -> EdgesDriven:
    return EdgesDriven.of_rows(PARTICLES, *map(np.array, rows))


TIMES = np.arange(-2.0, 124.0)


def table(edges: EdgesDriven) -> list[list[int]]:
    """The edge of each particle at each time."""
    return np.array([edges.at(t) for t in TIMES]).T.tolist()


def test_the_edge_at_a_time_is_that_of_the_last_row(
    rows: tuple[list[int], list[float], list[int]],
) -> None:
    edges = of(rows)
    expected = [[edge_at(rows, k, t) for t in TIMES] for k in range(PARTICLES)]
    assert table(edges) == expected
    own_s = np.linspace(-3.0, 120.0, PARTICLES)
    assert edges.at(own_s).tolist() == [edge_at(rows, k, t) for k, t in enumerate(own_s)]
    first = np.arange(PARTICLES + 1) * len(TIMES)
    together = edges.of_times(np.tile(TIMES, PARTICLES), first)
    assert together.reshape(PARTICLES, -1).tolist() == expected


def test_no_change_repeats_the_edge_before_it(
    rows: tuple[list[int], list[float], list[int]],
) -> None:
    edges = of(rows)
    for k in range(PARTICLES):
        mine = edges.edge[edges.first_change[k] : edges.first_change[k + 1]]
        assert (np.diff(mine, prepend=NO_EDGE) != 0).all()


def test_taken_and_joined(rows: tuple[list[int], list[float], list[int]]) -> None:
    edges = of(rows)
    some = np.array([3, 3, 0, 11, 5])
    assert table(edges.take(some)) == [table(edges)[k] for k in some]
    flags = np.arange(PARTICLES) % 2 == 0
    assert table(edges.take(flags)) == table(edges)[::2]
    both = EdgesDriven.joined([edges, EdgesDriven.unknown(2), edges.take(some)])
    assert table(both) == [
        *table(edges),
        *[[NO_EDGE] * len(TIMES)] * 2,
        *table(edges.take(some)),
    ]


def test_since_and_until_a_time(rows: tuple[list[int], list[float], list[int]]) -> None:
    edges = of(rows)
    cut_s = np.linspace(-1.0, 121.0, PARTICLES)  # some of them times of changes
    cut_s[3] = np.inf
    since, until = edges.since(cut_s), edges.until(cut_s)
    whole = np.array(table(edges))
    expected = np.where(cut_s[:, None] <= TIMES, whole, NO_EDGE)
    assert table(since) == expected.tolist()
    assert np.diff(since.first_change)[3] == 0
    assert (since.time_s >= cut_s[since.particle]).all()
    expected = np.where(cut_s[:, None] > TIMES, whole, NO_EDGE)
    assert table(until) == expected.tolist()


def test_edges_of_knots() -> None:
    edges = EdgesDriven.of_knots(
        np.array([4, 4, 5, NO_EDGE, 5, 5, 6]),
        np.array([0.0, 10, 20, 30, 1, 2, 3]),
        np.array([0, 4, 4, 7]),
    )
    assert edges.first_change.tolist() == [0, 3, 3, 5]
    assert edges.time_s.tolist() == [0, 20, 30, 1, 3]
    assert edges.edge.tolist() == [4, 5, NO_EDGE, 5, 6]


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"time_s": [0.0, 0.0]}, "particle 0 comes onto edges at 0 and 0 s"),
        ({"time_s": [0.0, np.nan]}, "time_s: holds NaN"),
        ({"edge": [1]}, "edge: has the shape"),
        ({"first_change": [0, 1]}, "first_change: should rise from 0 to 2"),
        ({"first_change": []}, "first_change: should rise"),
        ({"first_change": 0}, "first_change: should rise"),
    ],
)
def test_nonsense_is_refused(changed: dict[str, object], told: str) -> None:
    edges = EdgesDriven([0, 2], [0.0, 1.0], [1, 2])  # type: ignore[arg-type]
    with pytest.raises(InputError, match=told):
        replace(edges, **changed)
