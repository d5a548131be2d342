"""Flights keep out of no-fly areas and within the fence, by the shortest way."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.flight.airspace import MARGIN_M, Airspace
from planner.flight.around import legs_around, stops_around
from planner.flight.legs import Legs
from planner.flight.plan import legs_flown
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.flight.ways import Point
from support.instances import figure3

SQUARE = shapely.box(4.0, -1.0, 6.0, 1.0)
START = (-30_000.0, 0.0)
NET = figure3()


def length_m(way: list[Point]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(way))


def inside(x_m: float, y_m: float, polygon: list[Point]) -> bool:
    """Whether a ray to the east crosses the edge an odd number of times."""
    crossed = False
    for (ax, ay), (bx, by) in pairwise([*polygon, polygon[0]]):
        if (ay > y_m) != (by > y_m) and x_m < ax + (bx - ax) * (y_m - ay) / (by - ay):
            crossed = not crossed
    return crossed


def points_of(track: Track, most_m: float) -> Iterator[Point]:
    """Points all along a flight, none farther apart than some metres."""
    way = np.stack([track.x_m, track.y_m], axis=1)
    for a, b in pairwise(way):
        for share in np.linspace(0.0, 1.0, 2 + int(math.dist(a, b) / most_m)):
            x_m, y_m = a + share * (b - a)
            yield float(x_m), float(y_m)


@st.composite
def stars(draw: st.DrawFn, near: float = 20_000.0, size: float = 6_000.0) -> list[Point]:
    """A polygon that does not cross itself: corners around a point, by rising bearing."""
    x_m, y_m = draw(st.tuples(*2 * [st.floats(-near, near)]))
    corners = draw(st.integers(3, 7))
    radii = draw(st.lists(st.floats(size / 20, size), min_size=corners, max_size=corners))
    turns = [2.0 * math.pi * k / corners for k in range(corners)]
    return [
        (x_m + r * math.cos(turn), y_m + r * math.sin(turn))
        for r, turn in zip(radii, turns, strict=True)
    ]


def test_a_way_that_is_clear_is_straight() -> None:
    space = Airspace(no_fly=SQUARE)
    assert space.shortest_path((0.0, 3.0), (10.0, 3.0)) == [(0.0, 3.0), (10.0, 3.0)]


def test_the_way_around_a_square() -> None:
    way = Airspace(no_fly=SQUARE).shortest_path((0.0, 0.5), (10.0, 0.5))
    edge_m = 1.0 + MARGIN_M
    corners = [(4.0 - MARGIN_M, edge_m), (6.0 + MARGIN_M, edge_m)]
    assert way == [(0.0, 0.5), *map(pytest.approx, corners), (10.0, 0.5)]


def test_what_is_cut_off_is_refused() -> None:
    ring = shapely.box(-9.0, -9.0, 9.0, 9.0).difference(shapely.box(-5.0, -5.0, 5.0, 5.0))
    space = Airspace(no_fly=ring)
    with pytest.raises(InputError, match=r"no way from \(0, 0\) to \(20, 0\) m"):
        space.shortest_path((0.0, 0.0), (20.0, 0.0))
    assert not space.connects((0.0, 0.0), (20.0, 0.0))
    assert space.connects((0.0, 0.0), (1.0, 0.0))


def test_forbidden_places_are_told() -> None:
    space = Airspace(no_fly=SQUARE, fence=shapely.box(0.0, -5.0, 10.0, 5.0))
    assert "no-fly area" in space.forbids((5.0, 0.0))
    assert "no-fly area" in space.forbids((4.0, 0.0))
    assert "outside the fence" in space.forbids((11.0, 0.0))
    assert space.forbids((2.0, 0.0)) == ""


def test_flights_that_break_the_airspace_are_refused() -> None:
    space = Airspace(no_fly=SQUARE, fence=shapely.box(0.0, -5.0, 10.0, 5.0))

    def track(*way: Point) -> Track:
        x_m, y_m = np.array(way).T
        return Track(np.arange(len(way)), x_m, y_m, np.zeros((0, 2)))

    space.refuse(track((1.0, 0.0), (4.0, 1.0), (6.0, 1.0), (9.0, 0.0)))
    space.refuse(track((1.0, 0.0)))
    with pytest.raises(InputError, match="no-fly area"):
        space.refuse(track((1.0, 0.0), (9.0, 0.0)))
    with pytest.raises(InputError, match="leaves the fence"):
        space.refuse(track((1.0, 0.0), (1.0, 6.0), (2.0, 0.0)))


@settings(max_examples=40)
@given(
    st.lists(stars(), min_size=1, max_size=4),
    st.lists(st.floats(-3e4, 3e4), min_size=4, max_size=4),
)
def test_ways_are_the_shortest_in_the_graph_of_all_corners(
    polygons: list[list[Point]], ends: list[float]
) -> None:  # fmt: skip
    space = Airspace(no_fly=shapely.union_all([shapely.Polygon(one) for one in polygons]))
    a, b = (ends[0], ends[1]), (ends[2], ends[3])
    assume(a != b and space.connects(a, b))
    graph = nx.Graph()
    places = [a, b, *map(tuple, space.ways.corners[:, 1].tolist())]
    for i, p in enumerate(places):
        for q in places[:i]:
            if space.free.covers(shapely.LineString([p, q])):
                graph.add_edge(p, q, length=math.dist(p, q))
    way = space.shortest_path(a, b)
    shortest_m = nx.dijkstra_path_length(graph, a, b, weight="length")
    assert length_m(way) == pytest.approx(shortest_m)
    assert (way[0], way[-1]) == (a, b)


@settings(max_examples=60)
@given(
    st.lists(stars(), max_size=4),
    st.one_of(st.none(), stars(near=1_000.0, size=60_000.0)),
    st.lists(st.integers(0, 13), min_size=1, max_size=8),
    st.booleans(),
)
def test_no_point_of_a_flight_is_forbidden(
    polygons: list[list[Point]], fence: list[Point] | None, order: list[int], lands: bool
) -> None:
    space = Airspace(
        no_fly=shapely.union_all([shapely.Polygon(one) for one in polygons]) if polygons else None,
        fence=None if fence is None else shapely.Polygon(fence),
    )
    assume(space.allows((0.0, 0.0)))
    uav = Uav(0.0, 0.0, 0.0, 100.0, return_to_m=(0.0, 0.0) if lands else None)
    open_ = space.roads_searched(NET, (0.0, 0.0))
    legs = Legs.of(NET, uav)
    flown = [leg for leg in order if open_[Legs.road(leg)]]
    stops = [(leg * 900.0, leg * -700.0, 5.0) for leg in order]
    near = space.nearest_searched(np.array(stops)[:, :2], (0.0, 0.0))
    hovers = [(x_m, y_m, 5.0) for x_m, y_m in near]
    for plan in (
        legs_around(uav, legs, flown, airspace=space, method="", in_transit=True),
        stops_around(uav, hovers, 1e4, airspace=space, method="", in_transit=True),
    ):
        (track,) = plan.tracks
        space.refuse(track)
        for x_m, y_m in points_of(track, 50.0):
            assert not any(inside(x_m, y_m, one) for one in polygons)
            assert fence is None or inside(x_m, y_m, fence)
        steps_m = np.hypot(np.diff(track.x_m), np.diff(track.y_m))
        assert np.all(steps_m <= 100.0 * np.diff(track.time_s) + 1e-6)
        assert not lands or (track.x_m[-1], track.y_m[-1]) == (0.0, 0.0)
        named = [leg.leg for leg in plan.legs[0]]
        assert named == (flown if plan.legs[0] else [])


def test_where_nothing_is_in_the_way_flights_are_those_without_an_airspace() -> None:
    uav = Uav(*START, 3.0, 100.0, max_flight_time_s=2_000.0, return_to_m=(0.0, 500.0))
    legs, order = Legs.of(NET, uav), [0, 5, 2, 9, 1]
    space = Airspace(no_fly=shapely.box(5e4, 5e4, 6e4, 6e4))
    free = legs_flown(uav, legs, order, method="", in_transit=False)
    kept = legs_around(uav, legs, order, airspace=space, method="", in_transit=False)
    assert kept.legs == free.legs
    for column in ("time_s", "x_m", "y_m", "sensor_on"):
        assert np.array_equal(getattr(kept.tracks[0], column), getattr(free.tracks[0], column))


def test_whoever_has_to_land_turns_in_time_for_the_way_around() -> None:
    space = Airspace(no_fly=shapely.box(-5_000.0, -20_000.0, -4_000.0, 20_000.0))
    free = Uav(*START, 0.0, 100.0, return_to_m=START)
    how: Any = {"airspace": space, "method": "", "in_transit": True}
    takes_s = legs_around(free, Legs.of(NET, free), [0], **how).end_s
    assert takes_s > 2 * math.hypot(20_000.0, 25_000.0) / 100.0
    for spare_s, roads in ((-1.0, 0), (0.0, 1)):
        uav = replace(free, max_flight_time_s=takes_s + spare_s)
        plan = legs_around(uav, Legs.of(NET, uav), [0], **how)
        assert plan.roads == roads
        assert plan.end_s <= uav.landing_s + 1e-6


def test_the_nearest_place_that_is_searched() -> None:
    touching = shapely.union_all(
        [shapely.box(0.0, 1.0, 4.0, 3.0), shapely.box(6.0, -1.0, 9.0, 0.0)]
    )
    space = Airspace(no_fly=SQUARE, within=touching)
    start = (0.0, 5.0)
    near = space.nearest_searched(np.array([[1.0, 2.0], [2.0, 0.0], [5.0, 9.0]]), start)
    assert near[0] == (1.0, 2.0)
    assert near[1] == pytest.approx((2.0, 1.0), abs=1e-3)
    assert math.dist(near[2], (3.9, 3.0)) < 0.2
    assert all(space.searched(start).covers(shapely.Point(place)) for place in near)


def test_roads_outside_are_not_searched() -> None:
    space = Airspace(within=shapely.box(-1.0, -5e3, 10_001.0, 5e3))
    names = [NET.road_ids[k] for k in np.flatnonzero(space.roads_searched(NET, START))]
    assert names == ["AB", "BC", "BD"]
    space = Airspace(no_fly=shapely.box(6_000.0, -1_000.0, 9_000.0, 1_000.0))
    closed = [NET.road_ids[k] for k in np.flatnonzero(~space.roads_searched(NET, START))]
    assert closed == ["BC", "BD"]
