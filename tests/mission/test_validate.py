"""Whether a belief that is right covers what is true, and a wrong one is found out."""

from dataclasses import replace

import numpy as np
import pytest

from planner.arrays import Floats, Ints
from planner.errors import InputError
from planner.futures.fates import Fates
from planner.futures.futures import Futures
from planner.mission.validate import Validation, validated

HORIZON_S = 800.0


def drivers(speeds_mps: Floats, realisation: Ints | None = None) -> Futures:
    """Particles that drive east from 0, each at its speed."""
    count = len(speeds_mps)
    nothing = np.zeros(count)
    return Futures(
        time_s=np.tile([0.0, HORIZON_S], count),
        x_m=np.column_stack([nothing, speeds_mps * HORIZON_S]).ravel(),
        y_m=np.zeros(2 * count),
        first_knot=np.arange(0, 2 * count + 1, 2),
        weight=np.full(count, 1 / count),
        gone=np.zeros(count, bool),
        fates=None
        if realisation is None
        else Fates(realisation, nothing, nothing, nothing, nothing, nothing),
    )


def speeds(rng: np.random.Generator, realisation: Ints, *, jam: float) -> Floats:
    """Speeds that drivers of one realisation have partly in common, m/s."""
    of_run = rng.normal(0.0, jam, realisation.max() + 1)
    return np.asarray(10.0 + of_run[realisation] + rng.normal(0.0, 1.0, len(realisation)))


def case(seed: int, *, jam: float, runs: int = 20, factor: float = 1.0) -> Validation:
    rng = np.random.default_rng(seed)
    believed, true = np.arange(400) % 8, np.arange(200) % runs
    cloud = drivers(factor * speeds(rng, believed, jam=jam), believed)
    truths = drivers(speeds(rng, true, jam=jam), true + 8)
    return validated(cloud, truths, true, HORIZON_S, seed=seed)


@pytest.mark.parametrize("jam", [0.0, 0.7])
def test_a_right_belief_passes(jam: float) -> None:
    """Nearly always: all checks of one belief hold together with 95 %."""
    found = [case(seed, jam=jam) for seed in range(40)]
    assert sum(one.is_off for one in found) <= 5
    covered = np.mean([check.covered for one in found for check in one.checks])
    assert covered == pytest.approx(0.9, abs=0.02 if jam == 0.0 else 0.06)


@pytest.mark.parametrize(("jam", "factor"), [(0.0, 1.2), (0.7, 1.7)])
def test_a_belief_that_is_too_fast_is_found_out(jam: float, factor: float) -> None:
    found = [case(seed, jam=jam, factor=factor) for seed in range(10)]
    assert sum(one.is_off for one in found) >= 9
    check = found[0].checks[0]
    assert check.ratio is not None
    assert check.ratio.off < -check.ratio.half < 0.0


def test_what_drivers_of_a_run_have_in_common_widens_the_interval() -> None:
    """Else each car would count as if it were a run of its own."""
    alone, common = (case(3, jam=jam).checks[0].coverage.half for jam in (0.0, 0.7))
    assert common > 1.5 * alone
    few = case(3, jam=0.7, runs=4).checks[0].coverage.half
    assert few > 1.5 * common


def test_truths_where_particles_have_been_are_refused() -> None:
    rng, run = np.random.default_rng(1), np.arange(40) % 4
    cloud = drivers(speeds(rng, run, jam=0.5), run)
    seen = drivers(speeds(rng, run, jam=0.5), run + 3)
    with pytest.raises(InputError, match=r"ride in realisation 3 .*no forecast"):
        validated(cloud, seen, run, HORIZON_S, seed=1)
    with pytest.raises(InputError, match="one run only"):
        validated(cloud, replace(seen, fates=None), 0 * run, HORIZON_S, seed=1)


def test_those_that_have_left_are_ties_too() -> None:
    """Where most have left, 5 % are above the cloud's middle as ever, and not none."""
    some = drivers(np.linspace(5.0, 15.0, 2000))
    leaves = np.arange(2000) % 5 > 0
    time_s = np.where(np.arange(4000) % 2, 0.05 * HORIZON_S, 0.0)
    time_s[1::2][~leaves] = HORIZON_S
    left = replace(some, time_s=time_s, gone=leaves)
    found = validated(left, left, np.arange(2000) % 20, HORIZON_S, seed=5)
    for check in found.checks:
        assert check.covered == pytest.approx(0.9, abs=0.02)


def test_ties_are_broken_by_chance() -> None:
    """Of those that all stand, the middle 90 % hold 90 %, not all."""
    standing = drivers(np.zeros(2000))
    run = np.arange(2000) % 20
    found = validated(standing, standing, run, HORIZON_S, seed=5)
    assert not found.is_off
    for check in found.checks:
        assert check.covered == pytest.approx(0.9, abs=0.03)
        assert check.ratio is None


def test_driven_is_along_the_way() -> None:
    """There and back again, and then it rests."""
    futures = Futures(
        time_s=[5.0, 15.0, 35.0],
        x_m=[0.0, 100.0, 0.0],
        y_m=[0.0, 0.0, 0.0],
        first_knot=[0, 3],
        weight=[1.0],
        gone=[False],
    )
    driven = [futures.driven_m(at_s)[0] for at_s in (0.0, 5.0, 10.0, 25.0, 35.0, 90.0)]
    assert driven == pytest.approx([0.0, 0.0, 50.0, 150.0, 200.0, 200.0])
