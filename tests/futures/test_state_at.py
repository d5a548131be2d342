"""The assessed state of the target against hand-made futures."""

from pathlib import Path

import numpy as np
import pytest

from planner.futures.edges_driven import NO_EDGE
from planner.futures.futures import Futures
from planner.futures.state_at import MEDIAN, UNKNOWN, State, by_road, state_at
from planner.network.road_network import RoadNetwork
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


def test_a_road_has_all_its_edges_and_one_start() -> None:
    """Three cars in a street of 100 m: two come towards its start on its other side."""
    line = np.array([[0.0, 0.0], [100.0, 0.0]])
    net = RoadNetwork(
        node_ids=("a", "b"),
        node_xy_m=line,
        road_ids=("street",),
        road_from=np.array([0]),
        road_to=np.array([1]),
        first_point=np.array([0, 2]),
        shape_xy_m=line,
        edge_ids=("ab", "ba"),
        edge_road=np.array([0, 0]),
        edge_length_m=np.array([90.0, 90.0]),
        edge_limit_mps=np.array([14.0, 14.0]),
        edge_lanes=np.array([1, 1]),
        first_turn=np.array([0, 0, 0]),
        turn_edge=np.array([], dtype=np.int32),
        edge_first_point=np.array([0, 2, 4]),
        edge_shape_xy_m=np.concatenate((line - (0.0, 3.0), line[::-1] - (0.0, -3.0))),
        path=Path("street.net.xml"),
        sha256="0" * 64,
    )
    assert net.is_merged
    places = np.array([[10.0, -3.0], [60.0, 3.0], [90.0, 3.0], [500.0, 0.0]])
    state = State(
        time_s=0.0,
        particle=np.arange(4),
        weight=np.array([0.3, 0.25, 0.25, 0.2]),
        xy_m=places,
        edge=np.array([0, 1, 1, NO_EDGE]),
        distance_m=np.array([9.0, 36.0, 9.0, np.nan]),
        speed_mps=np.array([5.0, 6.0, 7.0, 8.0]),
    )
    street, off = by_road(state, net)
    assert (street.road, street.edge, street.probability) == ("street", "ba", pytest.approx(0.8))
    assert street.distance_m == pytest.approx((10.0, 60.0, 90.0))
    assert street.xy_m == tuple(places[1])
    assert (off.road, off.edge, off.probability) == (UNKNOWN, UNKNOWN, 0.2)
    assert np.isnan(off.distance_m[MEDIAN])


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
