"""Roads are merged by the rules that stand at the head of `planner.network.roads`."""

import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from planner.belief.sampling import sample
from planner.errors import InputError
from planner.futures.edges_driven import EdgesDriven
from planner.futures.record import session_of
from planner.futures.rides import drive_session
from planner.futures.tracks import tracks_of_rides
from planner.futures.workers import in_processes
from planner.mission.opening import OpenScenario, open_scenario
from planner.network import roads
from planner.network.links import Lane
from planner.network.read import open_network
from planner.network.road_network import RoadNetwork
from planner.network.roads import merged_fields, with_roads
from support import sumo_instances
from support.drawn_streets import BESIDE_M, both, drawn, merged

PARTICLES = 200


def of_road(network: RoadNetwork) -> dict[str, str]:
    """The road of each edge, by their names."""
    return {
        edge: network.road_ids[road]
        for edge, road in zip(network.edge_ids, network.edge_road, strict=True)
    }


def test_opposite_edges_are_one_road_in_their_middle() -> None:
    network = merged({"A": (0, 0), "B": (300, 0)}, both("AB"))
    assert network.road_ids == ("AB",)
    assert network.both_ways.tolist() == [True]
    assert of_road(network) == {"AB": "AB", "BA": "AB"}
    assert network.node_ids == ("A", "B")
    np.testing.assert_allclose(network.shape(0), [[0, 0], [300, 0]])
    assert network.half_width_m[0] == pytest.approx(BESIDE_M)


def test_a_road_has_the_direction_of_the_edge_that_it_is_named_after() -> None:
    nodes = {"A": (0.0, 0.0), "B": (300.0, 0.0)}
    network = merged(nodes, {"-1": ("A", "B", ()), "1": ("B", "A", ())})
    assert network.road_ids == ("1",)  # SUMO names the opposite of an edge with a minus
    assert (network.road_from.tolist(), network.road_to.tolist()) == ([1], [0])
    alone = merged(nodes, {"-1": ("B", "A", ())})
    assert alone.road_ids == ("-1",)
    assert alone.both_ways.tolist() == [False]
    np.testing.assert_array_equal(alone.shape(0)[[0, -1]], [[300, 0], [0, 0]])


def test_the_two_ways_of_a_dual_carriageway_are_one_road() -> None:
    nodes = {"A": (0.0, 0.0), "B": (500.0, 0.0), "C": (500.0, 12.0), "D": (0.0, 12.0)}
    network = merged(nodes, {"AB": ("A", "B", ()), "CD": ("C", "D", ())})
    assert network.road_ids == ("AB",)
    assert network.node_ids == ("A", "B")
    np.testing.assert_allclose(network.node_xy_m, [[0, 6], [500, 6]])
    np.testing.assert_allclose(network.shape(0), [[0, 6], [500, 6]], atol=0.5)
    assert network.half_width_m[0] == pytest.approx(6 + BESIDE_M, abs=0.5)


@pytest.mark.parametrize(("bow_m", "found"), [(25.0, 1), (40.0, 2)])
def test_parallel_edges_are_one_road_within_one_and_a_half_tolerances(
    bow_m: float, found: int
) -> None:
    nodes = {"A": (0.0, 0.0), "B": (400.0, 0.0)}
    bow = [(100.0, bow_m), (300.0, bow_m)]
    network = merged(nodes, {"a": ("A", "B", ()), "b": ("A", "B", bow)})
    assert len(network.road_ids) == found


def test_ways_farther_apart_than_the_tolerance_stay_apart() -> None:
    nodes = {"A": (0.0, 0.0), "B": (500.0, 0.0), "C": (500.0, 35.0), "D": (0.0, 35.0)}
    network = merged(nodes, {"AB": ("A", "B", ()), "CD": ("C", "D", ())})
    assert network.road_ids == ("AB", "CD")
    assert len(network.node_ids) == 4


def test_a_roundabout_is_a_node() -> None:
    ring = {"E": (10.0, 0.0), "N": (0.0, 10.0), "S": (0.0, -10.0), "W": (-10.0, 0.0)}
    ends = {name.lower(): (30 * x, 30 * y) for name, (x, y) in ring.items()}
    round_it = {way: (way[0], way[1], ()) for way in ("EN", "NW", "WS", "SE")}
    network = merged({**ring, **ends}, {**round_it, **both("Ee", "Nn", "Ss", "Ww")})
    assert network.road_ids == ("Ee", "Nn", "Ss", "Ww")
    assert network.node_ids == ("E", "e", "n", "s", "w")
    np.testing.assert_allclose(network.node_xy_m[0], [0, 0], atol=1e-9)
    assert {of_road(network)[way] for way in round_it} <= {"Ee", "Nn", "Ss", "Ww"}
    assert network.half_width_m.max() <= 20 + BESIDE_M


def test_what_is_contracted_spans_no_more_than_its_limit() -> None:
    """A row of crossings 15 m apart is not drawn together to one, nor step by step."""
    nodes = {chr(97 + k): (15.0 * k, 0.0) for k in range(12)}
    ends = {name.upper(): (x, 100.0) for name, (x, _) in nodes.items()}
    row = both(*(a + b for a, b in zip("abcdefghijk", "bcdefghijkl", strict=True)))
    network = merged({**nodes, **ends}, {**row, **both(*(n + n.upper() for n in nodes))})
    on_row = network.node_xy_m[:, 1] < 50.0
    assert on_row.sum() == 2  # of four times three crossings; the outer two are bends
    assert network.half_width_m.max() < 2 * 20


def test_a_street_shorter_than_the_tolerance_counts_to_the_nearest_road() -> None:
    nodes = {"A": (0.0, 0.0), "B": (200.0, 0.0), "C": (215.0, 0.0), "D": (400.0, 0.0)}
    more = {"E": (200.0, 200.0), "F": (215.0, -200.0)}
    network = merged({**nodes, **more}, both("AB", "BC", "CD", "BE", "CF"))
    assert network.road_ids == ("AB", "BE", "CD", "CF")
    places_m = np.stack([np.linspace(200, 215, 20), np.full(20, -BESIDE_M)], axis=1)
    off_m = [
        network.road_lines.off(np.full(20, road), places_m, places_m).max() for road in range(4)
    ]
    assert network.edge_road[network.edge_index["BC"]] == np.argmin(off_m)
    assert network.half_width_m.max() < 20


def test_a_chain_is_one_road() -> None:
    nodes = {"A": (0.0, 0.0), "B": (100.0, 5.0), "C": (200.0, -5.0), "D": (300.0, 0.0)}
    network = merged(nodes, both("AB", "BC", "CD"))
    assert network.road_ids == ("AB",)
    assert set(of_road(network).values()) == {"AB"}
    assert network.node_ids == ("A", "D")


def test_chains_beside_each_other_are_one_road() -> None:
    """Once they are joined at their crossings, which lie at different places."""
    nodes = {"A": (0.0, 0.0), "B": (150.0, 10.0), "C": (450.0, -10.0), "D": (600.0, 0.0)}
    arms = {"E": (0.0, 200.0), "F": (0.0, -200.0), "G": (600.0, 200.0), "H": (600.0, -200.0)}
    edges = {"AB": ("A", "B", ()), "BD": ("B", "D", ()), "DC": ("D", "C", ()), "CA": ("C", "A", ())}
    network = merged(nodes | arms, edges | both("AE", "AF", "DG", "DH"))
    assert network.road_ids == ("AB", "AE", "AF", "DG", "DH")


def test_a_loop_stays() -> None:
    square = [(200.0, 0.0), (200.0, 200.0), (0.0, 200.0)]
    nodes = {"A": (0.0, 0.0), "B": (-300.0, 0.0)}
    network = merged(nodes, {"a": ("A", "A", square), **both("AB")})
    assert network.road_ids == ("AB", "a")
    assert network.road_from[1] == network.road_to[1]
    assert network.road_length_m[1] == pytest.approx(800, abs=20)


def test_a_ring_of_streets_is_no_single_road() -> None:
    nodes = {"A": (0.0, 0.0), "B": (300.0, 0.0), "C": (150.0, 200.0), "D": (-300.0, 0.0)}
    network = merged(nodes, both("AB", "BC", "CA", "AD"))
    assert network.road_ids.count("AD") == 1
    assert len(network.road_ids) == 3


def test_what_is_as_small_as_the_tolerance_does_not_vanish() -> None:
    far = {"X": (5000.0, 0.0), "Y": (5008.0, 0.0)}
    network = merged({"A": (0.0, 0.0), "B": (300.0, 0.0), **far}, both("AB", "XY"))
    assert network.road_ids == ("AB", "XY")
    assert network.half_width_m.max() < 20
    alone = merged(far, both("XY"), tolerance_m=500.0)
    assert alone.road_ids == ("XY",)


def test_ways_through_junctions_count_to_the_road_after_them() -> None:
    network, file = drawn(
        {"A": (0.0, 0.0), "B": (300.0, 0.0), "C": (300.0, 300.0), "D": (600.0, 0.0)},
        both("AB", "BC", "BD"),
    )
    way = np.array([(285.0, -3.0), (303.0, -3.0), (303.0, 15.0)])
    link = {"from": "AB", "to": "BC", "fromLane": "0", "toLane": "0", "via": ":B_0"}
    lanes = {**file.lanes, ":B_0": Lane(36.0, 9.0, True, way)}
    found = merged_fields(network, file._replace(lanes=lanes, every=[link]), 20.0)
    width_m = dict(zip(found["road_ids"], found["half_width_m"], strict=True))
    assert width_m["BC"] == pytest.approx(np.hypot(15, 3), abs=0.5)
    assert width_m["AB"] < 3


def test_the_order_of_the_file_does_not_matter() -> None:
    town = sumo_instances.town()
    nodes = {name: tuple(xy) for name, xy in zip(town.node_ids, town.node_xy_m, strict=True)}
    edges = {
        name: (
            town.node_ids[town.road_from[k]],
            town.node_ids[town.road_to[k]],
            [tuple(point) for point in town.shape(k)[1:-1]],
        )
        for k, name in enumerate(town.edge_ids)
    }
    one = merged(nodes, edges)
    other = merged(dict(reversed(nodes.items())), dict(reversed(edges.items())))
    assert len(one.road_ids) < len(one.edge_ids)
    for name in (*roads.TEXTS, *roads.ARRAYS):
        if name != "edge_road":
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert of_road(one) == of_road(other)


def test_only_roads_change() -> None:
    """Recordings, beliefs and messages go by edges, which stay as they were."""
    town = sumo_instances.town()
    found = with_roads(town, 20.0)
    assert with_roads(town, 0.0) is town
    for field in fields(RoadNetwork):
        if field.name not in (*roads.TEXTS, *roads.ARRAYS):
            np.testing.assert_array_equal(getattr(found, field.name), getattr(town, field.name))
    at_m = town.edge_length_m / 3
    every = np.arange(len(town.edge_ids))
    np.testing.assert_array_equal(found.edge_xy(every, at_m), town.edge_xy(every, at_m))
    assert found.junction_ids == town.node_ids
    assert not found.is_abstract


def test_roads_begin_and_end_at_their_nodes() -> None:
    found = with_roads(sumo_instances.town(), 20.0)
    ends = found.first_point[:-1], found.first_point[1:] - 1
    np.testing.assert_array_equal(found.shape_xy_m[ends[0]], found.node_xy_m[found.road_from])
    np.testing.assert_array_equal(found.shape_xy_m[ends[1]], found.node_xy_m[found.road_to])


def test_what_is_kept_is_what_was_merged(empty_cache: Path) -> None:
    town = sumo_instances.town()
    roads._roads.cache_clear()
    first = with_roads(town, 20.0)
    roads._roads.cache_clear()
    again = with_roads(town, 20.0)
    (kept,) = (empty_cache / "nets").glob("*merged*")
    for name in (*roads.TEXTS, *roads.ARRAYS):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    kept.write_bytes(b"damaged")
    roads._roads.cache_clear()
    np.testing.assert_array_equal(with_roads(town, 20.0).shape_xy_m, first.shape_xy_m)


def test_what_cannot_be_merged_is_told(empty_cache: Path, tmp_path: Path) -> None:
    town = sumo_instances.town()
    with pytest.raises(InputError, match="its roads are merged already"):
        with_roads(with_roads(town, 20.0), 20.0)
    broken = tmp_path / "broken.net.xml"
    broken.write_text(re.sub(' shape="[^"]*"', ' shape="1,x 2,y"', town.path.read_text()))
    with pytest.raises(InputError, match=r"xml: its lanes or links cannot be read \(ValueError"):
        with_roads(replace(town, path=broken, sha256="1" * 64), 20.0)


def test_a_tolerance_is_a_length() -> None:
    for wrong in (-1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="tolerance_m"):
            with_roads(sumo_instances.town(), wrong)


@pytest.mark.parametrize("name", ["grid5x5", "figure1", "figure3"])
def test_roads_of_abstract_nets_are_their_edges(name: str) -> None:
    opened = open_scenario(name)
    assert opened.network is open_network(opened.scenario.network, opened.scenario.folder)
    assert opened.network.road_ids == opened.network.edge_ids


def test_a_scenario_merges_by_a_third_of_the_radius(berlin: OpenScenario) -> None:
    assert berlin.scenario.sensor.radius_m == 60.0
    as_said = open_scenario("berlin", overrides=["network.road_tolerance_m=20"])
    assert as_said.network.road_ids == berlin.network.road_ids
    wide = open_scenario("berlin", overrides=["sensor.radius_m=120"])
    assert len(wide.network.road_ids) < len(berlin.network.road_ids)
    edges = open_scenario("berlin", overrides=["network.road_tolerance_m=0"])
    assert edges.network.road_ids == edges.network.edge_ids


def test_roads_wider_than_the_sensor_sees_are_noted(caplog: pytest.LogCaptureFixture) -> None:
    open_scenario("berlin")
    assert "road_tolerance_m" not in caplog.text
    open_scenario("berlin", overrides=["network.road_tolerance_m=60"])
    assert "network.road_tolerance_m: a target may be" in caplog.text


def test_take_off_is_at_any_node_of_the_net(berlin: OpenScenario) -> None:
    lost = next(name for name in berlin.network.junction_ids if name not in berlin.network.node_ids)
    opened = open_scenario("berlin", overrides=[f"uav.start={{node='{lost}'}}"])
    edges = open_scenario("berlin", overrides=["network.road_tolerance_m=0"]).network
    assert opened.starts_m[0] == tuple(edges.node_xy_m[edges.node_index[lost]])


def test_berlin_has_149_roads(berlin: OpenScenario) -> None:
    assert len(berlin.network.road_ids) == pytest.approx(149, rel=0.03)


def test_luxembourg_has_2990_roads(luxembourg: OpenScenario) -> None:
    assert len(luxembourg.network.road_ids) == pytest.approx(2990, rel=0.03)
    assert np.quantile(luxembourg.network.half_width_m, 0.99) < 30


def test_recorded_motion_stays_within_the_half_width(berlin: OpenScenario) -> None:
    """All samples as SUMO gives them, before any is left out."""
    network, horizon_s = berlin.network, 600.0
    rng = np.random.default_rng(5)
    anywhere = open_scenario("berlin", overrides=["target.start='anywhere'"])
    particles = sample(anywhere.prior, network, PARTICLES, rng, horizon_s=horizon_s)
    session = session_of(network, particles, np.arange(PARTICLES), 7, horizon_s)
    (rides,) = in_processes(drive_session, [session], workers=1)
    # Where a ride arrives is not SUMO's sample, but straight on from its last ones.
    rides = [replace(ride, arrival=None) for ride in rides]
    tracks = tracks_of_rides(rides, network, step_s=session.step_s)
    driven = EdgesDriven(tracks.first_change, tracks.change_s, tracks.change_edge)
    road = network.edge_road[driven.of_times(tracks.time_s, tracks.first_sample)]
    places_m = np.stack([tracks.x_m, tracks.y_m], axis=1)
    off_m = network.road_lines.off(road, places_m, places_m)
    assert len(off_m) > 100 * PARTICLES
    assert np.all(off_m <= network.half_width_m[road] + 1e-6)
    assert off_m.max() > 0.5 * network.half_width_m.max()  # which is not there for nothing
