"""Futures of sampled motion: few knots, and edges that need none."""

import numpy as np
import pytest

from planner.errors import InputError
from planner.futures.tracks import Tracks, futures_of_tracks


def tracks() -> Tracks:
    """East for a minute, then north, a wave of 1 m on the way; nowhere; at rest."""
    time_s = np.arange(121.0)
    east = 10.0 * np.minimum(time_s, 60.0) + np.where(time_s % 3 == 1, 1.0, 0.0)
    north = 10.0 * np.maximum(time_s - 60.0, 0.0)
    return Tracks(
        first_sample=np.array([0, 121, 121, 131]),
        time_s=np.append(time_s, np.arange(10.0)),
        x_m=np.append(east, np.full(10, 5.0)),
        y_m=np.append(north, np.full(10, 6.0)),
        first_change=np.array([0, 3, 3, 4]),
        change_s=np.array([0.0, 29.5, 60.2, 0.0]),
        change_edge=np.array([7, 8, 9, 3]),
    )


def test_knots_are_few_and_edges_are_kept() -> None:
    futures = futures_of_tracks(tracks(), tolerance_m=2.0)
    assert np.diff(futures.first_knot).tolist() == [3, 0, 2]
    assert abs(futures.time_s[1] - 60.0) < 1.0
    edges = [futures.edges.at(t).tolist() for t in (-1.0, 0.0, 29.4, 29.5, 60.3, 1e6)]
    assert edges == [[-1] * 3, [7, -1, 3], [7, -1, 3], [8, -1, 3], [9, -1, 3], [9, -1, 3]]
    for t, x_m, y_m in zip(*tracks()[1:4], strict=True):
        if t > 9.0:
            assert np.hypot(*(futures.xy(0, t) - (x_m, y_m))) <= 2.0


def test_the_tolerance_decides() -> None:
    counts = [
        len(futures_of_tracks(tracks(), tolerance_m=tolerance_m).time_s)
        for tolerance_m in (0.01, 0.3, 2.0, 1000.0)
    ]
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 4
    assert counts[0] > 60


def test_knots_at_multiples_part_what_comes_before_from_what_comes_after() -> None:
    whole = futures_of_tracks(tracks(), tolerance_m=2.0, every_s=40.0)
    knots = whole.time_s[: whole.first_knot[1]]
    assert {0.0, 40.0, 80.0, 120.0} < set(knots.tolist())
    short = tracks()._replace(
        first_sample=np.array([0, 81]),
        time_s=tracks().time_s[:81],
        x_m=tracks().x_m[:81],
        y_m=tracks().y_m[:81],
        first_change=np.array([0, 3]),
        change_s=tracks().change_s[:3],
        change_edge=tracks().change_edge[:3],
    )
    cut = futures_of_tracks(short, tolerance_m=2.0, every_s=40.0)
    assert cut.time_s.tolist() == knots[knots <= 80.0].tolist()


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"time_s": tracks().time_s[::-1]}, "particle 0 has samples at 9 and 8 s"),
        ({"time_s": np.append(np.arange(130.0), 129.0)}, "particle 2 has samples at 129 and 129 s"),
        ({"x_m": np.full(131, np.nan)}, "x_m: holds NaN"),
        ({"y_m": np.zeros(3)}, "y_m: has the shape"),
        ({"first_sample": np.array([0, 90, 90, 130])}, "first_sample"),
        ({"first_change": np.array([0, 3, 4])}, "edges.first_change: should rise"),
        ({"change_s": np.zeros(4)}, "comes onto edges at 0 and 0 s"),
    ],
)
def test_nonsense_is_refused(changed: dict[str, np.ndarray], told: str) -> None:
    with pytest.raises(InputError, match=told):
        futures_of_tracks(tracks()._replace(**changed), tolerance_m=1.0)


def test_a_tolerance_is_above_zero() -> None:
    with pytest.raises(InputError, match="tolerance_m"):
        futures_of_tracks(tracks(), tolerance_m=0.0)
