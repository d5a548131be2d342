"""Farthest reach against its slow twin and against the fewest knots that there can be."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.arrays import Flags, Floats
from planner.futures.kernels.thinning import SampleColumns, farthest_reach

SPEEDING_MPS2, BRAKING_MPS2 = 2.6, 4.5


def off_m(path: Floats, a: int, b: int) -> float:
    """How far samples between two are from even motion, (time, x, y) each, at most."""
    time_s, xy_m = path[a : b + 1, 0], path[a : b + 1, 1:]
    share = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
    even = xy_m[0] + share[:, None] * (xy_m[-1] - xy_m[0])
    return float(np.hypot(*(even - xy_m).T).max())


def slow_reach(path: Floats, tolerance_m: float) -> list[int]:
    """All samples ahead are tried from each knot, and the farthest that will do is taken."""
    knots = [0]
    while knots[-1] < len(path) - 1:
        ahead = range(knots[-1] + 1, len(path))
        knots.append(max(b for b in ahead if off_m(path, knots[-1], b) <= tolerance_m))
    return knots


def fewest(path: Floats, tolerance_m: float) -> int:
    """The number of knots that no choice among the samples can go below: dynamic programming."""
    best = [1] + [len(path)] * (len(path) - 1)
    for b in range(1, len(path)):
        reached_from = [a for a in range(b) if off_m(path, a, b) <= tolerance_m]
        best[b] = 1 + min(best[a] for a in reached_from)
    return best[-1]


def stop_and_go(rng: np.random.Generator, samples: int) -> Floats:
    """A car in a town, second by second: speeds up, brakes, waits, turns at corners."""
    path, speed, wanted, heading = np.zeros((samples, 3)), 0.0, 12.0, rng.uniform(0.0, 6.28)
    for k in range(1, samples):
        if rng.random() < 0.06:
            wanted = rng.choice([0.0, rng.uniform(5.0, 15.0)])
            heading += rng.choice([0.0, 0.3, -1.57, 1.57])
        speed += np.clip(wanted - speed, -BRAKING_MPS2, SPEEDING_MPS2)
        step = speed * np.array([np.cos(heading), np.sin(heading)])
        path[k] = k, *(path[k - 1, 1:] + step)
    return path


def random_motion(rng: np.random.Generator, samples: int) -> Floats:
    """Any motion at uneven times: some of it straight, some of it none, some of it jumps."""
    time_s = np.cumsum(rng.choice([0.5, 1.0, 7.0], samples))
    scale = rng.choice([0.0, 0.5, 5.0], (samples, 1), p=[0.5, 0.3, 0.2])
    velocity = np.cumsum(scale * rng.normal(size=(samples, 2)), axis=0)
    xy_m = np.cumsum(velocity, axis=0) + rng.normal(scale=rng.choice([0.0, 2.0]), size=(samples, 2))
    return np.column_stack([time_s, xy_m])


def thinned(paths: list[Floats], tolerance_m: float, fixed: list[int] | None = None) -> list[Flags]:
    first = np.concatenate(([0], np.cumsum([len(path) for path in paths])))
    together = np.concatenate([*paths, np.zeros((0, 3))])
    columns = SampleColumns(first, *(column.copy() for column in together.T))
    stay = np.isin(np.arange(len(together)), [] if fixed is None else fixed)
    return np.split(farthest_reach(columns, tolerance_m, stay), first[1:-1])


@pytest.mark.parametrize("motion", [stop_and_go, random_motion])
@pytest.mark.parametrize("tolerance_m", [0.5, 2.0, 5.0, 20.0])
def test_it_is_its_slow_twin(motion, tolerance_m: float) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(int(10 * tolerance_m))
    paths = [motion(rng, length) for length in (1, 2, 3, 60, 90)]
    for path, stays in zip(paths, thinned(paths, tolerance_m), strict=True):
        assert np.flatnonzero(stays).tolist() == slow_reach(path, tolerance_m)


@pytest.mark.parametrize("motion", [stop_and_go, random_motion])
def test_fixed_samples_part_a_path(motion) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(4)
    for tolerance_m in (0.5, 5.0, 50.0):
        path = motion(rng, 90)
        (stays,) = thinned([path], tolerance_m, [0, 30, 31, 75, 89])
        parts = [slow_reach(path[a : b + 1], tolerance_m) for a, b in ((0, 30), (31, 75), (75, 89))]
        expected = {*parts[0], *(31 + k for k in parts[1]), *(75 + k for k in parts[2])}
        assert set(np.flatnonzero(stays).tolist()) == expected


@given(st.integers(0, 10**6), st.integers(2, 300), st.floats(0.01, 50.0), st.booleans())
def test_no_sample_is_farther_off_than_the_tolerance(
    seed: int, samples: int, tolerance_m: float, town: bool
) -> None:
    rng = np.random.default_rng(seed)
    path = stop_and_go(rng, samples) if town else random_motion(rng, samples)
    (stays,) = thinned([path], tolerance_m)
    assert stays[0]
    assert stays[-1]
    kept = np.flatnonzero(stays)
    worst_m = max(off_m(path, a, b) for a, b in pairwise(kept.tolist()))
    assert worst_m <= tolerance_m + 1e-9 * np.abs(path).max()


@pytest.mark.parametrize("tolerance_m", [1.0, 5.0])
def test_hardly_more_knots_than_can_be(tolerance_m: float) -> None:
    rng = np.random.default_rng(7)
    for motion in (stop_and_go, random_motion):
        paths = [motion(rng, 120) for _ in range(6)]
        knots = sum(int(stays.sum()) for stays in thinned(paths, tolerance_m))
        least = sum(fewest(path, tolerance_m) for path in paths)
        assert least <= knots < 1.1 * least


def test_even_motion_and_rest_need_their_ends_only() -> None:
    time_s = np.arange(5000.0)
    even = np.column_stack([time_s, 3.0 * time_s, -2.0 * time_s])
    rest = np.column_stack([time_s, np.full(5000, 7.0), np.zeros(5000)])
    for stays in thinned([even, rest], 0.1):
        assert np.flatnonzero(stays).tolist() == [0, 4999]


def test_a_particle_may_have_no_sample() -> None:
    empty, three = np.zeros((0, 3)), np.array([[0.0, 0, 0], [1, 9, 0], [2, 0, 0]])
    assert [stays.tolist() for stays in thinned([empty, three, empty], 1.0)] == [
        [],
        [True] * 3,
        [],
    ]
    assert [stays.tolist() for stays in thinned([three, empty], 9.0)] == [[True, False, True], []]
