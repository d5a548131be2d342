"""Longitude and latitude against sumolib's own way, by hand, and there and back."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planner.errors import InputError
from planner.mission.opening import OpenScenario, open_scenario
from planner.network.georeference import (
    grid_convergence_deg,
    is_georeferenced,
    lonlat,
    xy_of_lonlat,
)
from planner.network.road_network import RoadNetwork
from planner.network.sumo import parse_net
from support.instances import grid

# A zone of UTM whose central meridian runs along x = 0 of the net, as its netOffset says.
UTM33 = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"


def utm_net(**changed: Any) -> RoadNetwork:
    return replace(grid(2, 2), projection=UTM33, net_offset_m=(-500_000.0, -5_000_000.0), **changed)


def test_berlin_agrees_with_sumolib(berlin: OpenScenario) -> None:
    network = berlin.network
    net = parse_net(network.path)
    places = lonlat(network, network.node_xy_m)
    for (x_m, y_m), place in zip(network.node_xy_m[::7], places[::7], strict=True):
        np.testing.assert_allclose(place, net.convertXY2LonLat(x_m, y_m), rtol=0, atol=1e-12)
    # What the file says of itself: origBoundary="13.453860,52.424406,13.575739,52.459757".
    assert np.all(places >= (13.4538, 52.4244))
    assert np.all(places <= (13.5758, 52.4598))


def test_there_and_back(berlin: OpenScenario) -> None:
    network = berlin.network
    low, high = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    xy_m = low + (high - low) * np.random.default_rng(1).uniform(-3, 4, (4, 50, 2))
    places = lonlat(network, xy_m)
    assert places.shape == (4, 50, 2)
    np.testing.assert_allclose(xy_of_lonlat(network, places), xy_m, rtol=0, atol=1e-3)
    np.testing.assert_allclose(
        lonlat(network, xy_of_lonlat(network, places)), places, rtol=0, atol=1e-9
    )
    assert xy_of_lonlat(network, places[0, 0]).shape == (2,)


def test_by_hand() -> None:
    """On the central meridian of UTM a grid metre is 1 / 0.9996 m, and grid north is true north."""
    network = utm_net()
    where = lonlat(network, np.array([[0.0, 0.0], [0.0, 10_000.0]]))
    np.testing.assert_allclose(where[:, 0], 15.0, rtol=0, atol=1e-12)
    # A degree of the meridian of WGS 84 is 111,132.954 - 559.822 cos 2 phi + 1.175 cos 4 phi m.
    phi = math.radians(where[:, 1].mean())
    degree_m = 111_132.954 - 559.822 * math.cos(2 * phi) + 1.175 * math.cos(4 * phi)
    assert where[1, 1] - where[0, 1] == pytest.approx(10_000 / 0.9996 / degree_m, rel=1e-6)
    assert grid_convergence_deg(network, np.zeros(2)) == pytest.approx(0.0, abs=1e-12)


def test_grid_north_is_where_it_is_on_the_globe() -> None:
    """East of the central meridian grid north lies east of true north, by a step along it."""
    network = utm_net()
    for x_m in (-200_000.0, -30_000.0, 30_000.0, 200_000.0):
        (lon0, lat0), (lon1, lat1) = lonlat(network, np.array([[x_m, 0.0], [x_m, 100.0]]))
        east = math.radians(lon1 - lon0) * math.cos(math.radians(lat0)) * 6_388_838  # N at 45.15
        north = math.radians(lat1 - lat0) * 6_367_382  # M at 45.15 degrees
        true_deg = math.degrees(math.atan2(east, north))
        found = float(grid_convergence_deg(network, np.array([x_m, 0.0])))
        assert found == pytest.approx(true_deg, abs=0.01)
        assert math.copysign(1, found) == math.copysign(1, x_m)


def test_a_drone_that_comes_from_the_north_comes_from_the_true_north() -> None:
    name = "cluster_1704693650_1866350919_38920778_671564358"
    place = f"{{ node = '{name}', bearing_deg = 0, distance_m = 20000 }}"
    opened = open_scenario("berlin", overrides=[f"uav.start={place}"])
    network = opened.network
    node = lonlat(network, network.node_xy_m[network.node_index[name]])
    start = lonlat(network, np.array(opened.starts_m[0]))
    assert start[0] == pytest.approx(node[0], abs=2e-4)  # 14 m; the net's own north is 400 m off
    assert start[1] == pytest.approx(node[1] + 20_000 / 111_270, abs=1e-3)


@pytest.mark.parametrize(
    "place",
    [(200.0, 45.0), (15.0, 95.0), (45.15, 15.0), (-165.0, -45.0), (math.nan, 45.0), (105.0, 5.0)],
)
def test_places_beyond_the_sense_of_the_projection_are_refused(place: tuple[float, float]) -> None:
    network = utm_net()
    assert xy_of_lonlat(network, np.array([15.001, 45.15])).shape == (2,)
    with pytest.raises(InputError, match=r"longitude \S+, latitude \S+: no place near .*; give"):
        xy_of_lonlat(network, np.array([[15.001, 45.15], place]))


def test_metres_off_the_earth_are_refused() -> None:
    with pytest.raises(InputError, match="no place on the Earth"):
        lonlat(utm_net(), np.array([1e9, 5e9]))


@pytest.mark.parametrize("projection", [None, "-", "+proj=nothing"])
def test_a_net_without_a_projection_says_so(projection: str | None) -> None:
    network = replace(grid(2, 2), projection=projection)
    assert not is_georeferenced(network)
    assert is_georeferenced(utm_net())
    for ask in (lonlat, xy_of_lonlat, grid_convergence_deg):
        with pytest.raises(InputError, match=r"projection.*give places in metres"):
            ask(network, np.zeros(2))
