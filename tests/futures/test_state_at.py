"""The assessed state of the target against hand-made futures."""

import numpy as np
import pytest

from planner.futures.futures import Futures
from planner.futures.state_at import by_road, state_at
from support.instances import figure3, physics_futures


def two_targets(*, gone: bool) -> Futures:
    return physics_futures(
        figure3(), [["AB", "BC"], ["AB", "BD"]], [0.0, 1_000.0], [10.0, 20.0],
        horizon_s=1e5, gone=gone,
    )  # fmt: skip


def test_roads_distances_and_speeds_on_the_way() -> None:
    state = state_at(two_targets(gone=False), figure3(), 300.0)
    rows = by_road(state, figure3())
    assert {row.edge: row.probability for row in rows} == {"AB": 0.5, "BD": 0.5}
    on = {row.edge: row for row in rows}
    assert on["AB"].distance_m == pytest.approx((3_000.0,) * 3)
    assert on["AB"].speed_mps == pytest.approx((10.0,) * 3)
    assert on["BD"].distance_m == pytest.approx((20.0 * 300.0 + 1_000.0 - 5_000.0,) * 3)
    assert on["BD"].speed_mps == pytest.approx((20.0,) * 3)


def test_quantiles_are_weighted() -> None:
    futures = physics_futures(
        figure3(), [["AB"]] * 3, [0.0, 0.0, 0.0], [5.0, 10.0, 15.0],
        horizon_s=1e5, gone=False, weight=np.array([0.02, 0.08, 0.9]),
    )  # fmt: skip
    (row,) = by_road(state_at(futures, figure3(), 100.0), figure3())
    assert row.distance_m == pytest.approx((1_000.0, 1_500.0, 1_500.0))


def test_at_rest_at_the_end_or_gone() -> None:
    resting = state_at(two_targets(gone=False), figure3(), 5_000.0)
    np.testing.assert_allclose(resting.speed_mps, 0.0)
    np.testing.assert_allclose(resting.distance_m, np.hypot(5_000.0, 4_000.0))
    vanished = state_at(two_targets(gone=True), figure3(), 5_000.0)
    assert len(vanished.particle) == 0
    assert vanished.elsewhere_probability == pytest.approx(1.0)


def test_nothing_before_the_first_knot() -> None:
    assert state_at(two_targets(gone=False), figure3(), -1.0).elsewhere_probability == 1.0
