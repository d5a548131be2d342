"""Where all particles are, in pieces of straight motion and at a time."""

from dataclasses import replace

import numpy as np
import pytest

from planner.futures.futures import Futures
from support.search_instances import random_problem


def with_extremes(seed: int) -> Futures:
    """Some vanish, one jumps, one has no knots, one is there for a moment only."""
    futures = random_problem(seed, particles=20).futures
    rng = np.random.default_rng(seed)
    extra = Futures(
        time_s=[*futures.time_s, 5.0, 9.0, 9.001, 12.0, 7.0],
        x_m=[*futures.x_m, 0.0, 4.0, 50.0, 60.0, 3.0],
        y_m=[*futures.y_m, 0.0, 3.0, 50.0, 60.0, 4.0],
        first_knot=[*futures.first_knot, *(futures.first_knot[-1] + np.array([4, 4, 5]))],
        weight=np.full(23, 1 / 23),
        gone=rng.random(23) < 0.5,
    )
    return replace(extra, gone=[*extra.gone[:-1], True])


@pytest.mark.parametrize("seed", range(8))
def test_positions_are_those_of_each_particle(seed: int) -> None:
    futures = with_extremes(seed)
    ends_s = futures.end_s[np.isfinite(futures.end_s)]
    for time_s in (
        -1.0,
        7.0,
        9.0,
        10.0,
        float(np.median(ends_s)),
        *ends_s[:5].tolist(),
        1e6,
        np.inf,
    ):
        each = [futures.xy(k, time_s) for k in range(len(futures))]
        np.testing.assert_array_equal(futures.positions(time_s), each)


def test_positions_at_a_time_of_each_particles_own() -> None:
    futures = with_extremes(3)
    own_s = np.minimum(futures.end_s, 200.0)
    each = [futures.xy(k, own_s[k]) for k in range(len(futures))]
    np.testing.assert_array_equal(futures.positions(own_s), each)


@pytest.mark.parametrize("seed", range(8))
def test_pieces_move_as_the_particles_do(seed: int) -> None:
    futures = with_extremes(seed)
    pieces = futures.pieces
    assert len(pieces.from_s) == len(pieces.to_s) == len(futures.time_s)
    for k, who in enumerate(futures.particle):
        last = k + 1 == futures.first_knot[who + 1]
        until_s = np.inf if last and not futures.gone[who] else pieces.to_s[k]
        assert pieces.to_s[k] == until_s
        middle_s = pieces.from_s[k] + min(pieces.to_s[k] - pieces.from_s[k], 80.0) / 2
        if pieces.to_s[k] > pieces.from_s[k]:
            since_s = middle_s - pieces.from_s[k]
            place = (
                pieces.x_m[k] + pieces.vx_mps[k] * since_s,
                pieces.y_m[k] + pieces.vy_mps[k] * since_s,
            )
            assert place == pytest.approx(futures.xy(int(who), middle_s))
        else:
            assert (pieces.vx_mps[k], pieces.vy_mps[k]) == (0.0, 0.0)


def test_there_is_one_target_unless_said_otherwise() -> None:
    futures = with_extremes(0)
    assert futures.target.tolist() == [0] * 23
    several = replace(futures, target=np.arange(23) % 3)
    assert several.take(np.array([4, 2])).target.tolist() == [1, 2]
