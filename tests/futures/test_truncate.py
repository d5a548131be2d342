"""Futures cut short, against the motion that they were cut from."""

import numpy as np
import pytest

from planner.futures.edges_driven import NO_EDGE
from planner.futures.futures import Futures
from planner.futures.truncate import after, parked
from support.instances import edge_of_knots, grid, physics_futures

TIMES = np.linspace(-10.0, 1500.0, 400)


@pytest.fixture(params=[False, True], ids=["stays", "gone"])
def futures(request: pytest.FixtureRequest) -> Futures:
    network = grid(2, 2, road_m=1000.0)
    routes = [["r0c0-r0c1", "r0c1-r1c1"], ["r0c0-r1c0", "r1c0-r1c1"], ["r0c1-r1c1"]]
    speeds = np.array([5.0, 10.0, 4.0])
    return physics_futures(network, routes, 0.0, speeds, gone=request.param)


def test_after_a_time_the_motion_is_the_same(futures: Futures) -> None:
    from_s = np.array([123.0, 100.0, -5.0])  # in between, on a knot, before the first
    cut = after(futures, from_s)
    for k, start_s in enumerate(from_s):
        late = TIMES[start_s <= TIMES]
        np.testing.assert_allclose(cut.xy(k, late), futures.xy(k, late))
        assert np.isnan(cut.xy(k, min(start_s, 0.0) - 1.0)).all()
        assert np.isnan(cut.xy(k, max(start_s, 0.0) - 1e-6)).all()
    assert cut.weight.tolist() == futures.weight.tolist()


def test_all_at_once_is_one_by_one(futures: Futures) -> None:
    rng = np.random.default_rng(5)
    many = futures.take(rng.integers(0, len(futures), 200))
    knots = rng.choice(many.time_s, 200)  # some cuts lie on a knot
    from_s = np.where(rng.random(200) < 0.3, knots, rng.uniform(-50.0, 700.0, 200))
    from_s[rng.random(200) < 0.1] = np.inf
    cut = after(many, from_s)
    for k, start_s in enumerate(from_s):
        left = slice(many.first_knot[k], many.first_knot[k + 1])
        times = many.time_s[left][many.time_s[left] > start_s]
        if start_s == np.inf or (many.gone[k] and start_s > many.end_s[k]):
            times = times[:0]
        elif start_s >= many.time_s[left][0]:
            times = np.append(start_s, times)
        mine = slice(cut.first_knot[k], cut.first_knot[k + 1])
        np.testing.assert_array_equal(cut.time_s[mine], times)
        places = np.stack([cut.x_m[mine], cut.y_m[mine]], axis=-1)
        np.testing.assert_allclose(places, many.xy(k, times), atol=1e-9)


def test_after_its_end_a_particle_rests_or_is_gone(futures: Futures) -> None:
    cut = after(futures, np.array([450.0, np.inf, 0.0]))
    counts = np.diff(cut.first_knot).tolist()
    if futures.gone.any():
        assert counts == [0, 0, 2]
    else:
        assert counts == [1, 0, 2]
        np.testing.assert_allclose(cut.xy(0, 2000.0), futures.xy(0, 2000.0))


def test_the_edge_after_a_cut_is_the_one_driven(futures: Futures) -> None:
    cut = after(futures, np.array([250.0, 0.0, 0.0]))
    assert edge_of_knots(cut)[0] == edge_of_knots(futures)[1]
    assert (cut.edges.first_change[1], cut.edges.time_s[0]) == (1, 250.0)


def test_parked_targets_follow_their_way_and_stop_on_it(futures: Futures) -> None:
    stopped = parked(futures, np.random.default_rng(3))
    shares = []
    for k in range(len(futures)):
        stop_s = stopped.end_s[k]
        way = TIMES[(TIMES >= 0) & (stop_s >= TIMES)]
        np.testing.assert_allclose(stopped.xy(k, way), futures.xy(k, way))
        np.testing.assert_allclose(stopped.xy(k, stop_s + 999.0), futures.xy(k, stop_s))
        assert stopped.edges.at(stop_s)[k] == NO_EDGE
        just_before = stop_s - 1e-6
        assert stopped.edges.at(just_before)[k] == futures.edges.at(just_before)[k] != NO_EDGE
        shares.append(stop_s / futures.end_s[k])
    assert not stopped.gone.any()
    np.testing.assert_allclose(sorted(shares), [1 / 6, 3 / 6, 5 / 6])


def test_a_target_that_never_sets_out_is_left_alone(futures: Futures) -> None:
    none = after(futures, np.full(3, np.inf))
    again = parked(none, np.random.default_rng(3))
    assert np.diff(again.first_knot).tolist() == [0, 0, 0]
    assert again.gone.tolist() == none.gone.tolist()
