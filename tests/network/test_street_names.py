"""Streets and crossings in place of ids."""

from dataclasses import replace

import numpy as np
import pytest

from planner.mission.opening import OpenScenario
from planner.network.road_network import RoadNetwork
from planner.network.street_names import (
    crossed,
    crossing,
    has_street_names,
    named_share,
    nearest_node,
    no_edge,
    road_phrase,
    street_at,
    street_names,
)
from support.instances import by_two_letters

# A main street A-B-C-D along x, split at a zebra crossing C; side streets at B and D; a lane at A.
PLACES = {
    "A": (0.0, 0.0),
    "B": (100.0, 0.0),
    "C": (200.0, 0.0),
    "D": (300.0, 0.0),
    "E": (100.0, 100.0),
    "F": (300.0, 200.0),
    "G": (0.0, 50.0),
}
STREETS = {"AB": "Main Street", "BC": "Main Street", "CD": "Main Street"}
STREETS |= {"BE": "Side Street", "DF": "Long Lane"}


def net(**streets: str) -> RoadNetwork:
    network = by_two_letters(PLACES, "AB BC CD BE DF AG")
    named = {**STREETS, **streets}
    return replace(network, edge_street=tuple(named.get(name, "") for name in network.edge_ids))


def leg(network: RoadNetwork, name: str, against: int = 0) -> int:
    return 2 * network.road_index[name] + against


def test_a_road_is_told_by_its_street_and_those_that_cross_it() -> None:
    network = net()
    assert road_phrase(network, leg(network, "BC")) == (
        "Main Street, from Side Street towards Long Lane"
    )
    assert road_phrase(network, leg(network, "CD", 1)) == (
        "Main Street, from Long Lane towards Side Street"
    )


def test_a_place_is_told_by_its_street_and_what_crosses_there() -> None:
    network = net()
    near = street_at(network, np.array([150.0, -40.0]))
    assert (near.name, network.edge_ids[near.edge], near.away_m) == ("Main Street", "BC", 40.0)
    assert street_at(network, np.array([0.0, 30.0])).name == ""
    at_b = np.array([110.0, 0.0])
    assert nearest_node(network, at_b) == (network.node_ids.index("B"), 10.0)
    assert crossed(network, at_b, "Main Street", 60.0) == "Side Street"
    assert crossed(network, at_b, "", 60.0) == "Main Street / Side Street"
    assert crossed(network, at_b, "Main Street", 5.0) == ""


def test_what_has_no_name_is_left_out_or_an_id() -> None:
    network = net()
    assert road_phrase(network, leg(network, "AB")) == "Main Street, towards Side Street"
    assert road_phrase(network, leg(network, "AB", 1)) == "Main Street, from Side Street"
    assert road_phrase(network, leg(network, "AG")) == "AG, from Main Street"
    bare = by_two_letters(PLACES, "AB BC")
    assert not has_street_names(bare)
    assert has_street_names(network)
    assert road_phrase(bare, 0) == "AB"
    assert crossing(bare, bare.node_index["B"]) == "B"


def test_another_street_is_not_sought_far_along() -> None:
    network = net()
    far = replace(network, node_xy_m=network.node_xy_m * 50, shape_xy_m=network.shape_xy_m * 50)
    assert road_phrase(far, leg(far, "BC")) == "Main Street, from Side Street"
    places = {chr(65 + k): (500.0 * k, 0.0) for k in range(5)}
    chain = by_two_letters(places, "AB BC CD DE")
    named = replace(chain, edge_street=("High Street",) * 3 + ("End Road",))
    assert road_phrase(named, 0) == "High Street"


def test_crossings_begin_with_the_longer_street() -> None:
    network = net()
    assert crossing(network, network.node_index["B"]) == "Main Street / Side Street"
    assert crossing(network, network.node_index["D"]) == "Main Street / Long Lane"
    assert crossing(network, network.node_index["C"]) == "Main Street, C"
    assert crossing(network, network.node_index["G"]) == "G"


def test_a_road_of_several_edges_has_the_name_of_most_of_its_metres() -> None:
    network = net(BC="Bridge")
    merged = replace(network, edge_road=network.edge_road * 0)
    assert street_names(merged).road[0] == "Main Street"
    assert street_names(merged).road[1] == ""


def test_the_named_share_is_of_lengths() -> None:
    network = net()
    assert named_share(network) == pytest.approx(600 / 650)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("main street", "is a street; its edges are AB, BC, CD"),
        ("Main Stret", "did you mean the street Main Street? its edges are AB, BC, CD"),
        ("ABC", "is not an edge of the network; did you mean BC?"),
        ("nowhere at all", "is not an edge of the network; known: AB, BC"),
    ],
)
def test_a_name_that_is_no_edge_is_answered_with_what_was_meant(name: str, expected: str) -> None:
    assert expected in no_edge(name, net())


def test_berlin(berlin: OpenScenario) -> None:
    network = berlin.network
    assert named_share(network) > 0.99
    road = int(network.edge_road[network.edge_index["143308542#8"]])
    assert road_phrase(network, 2 * road).startswith("Rudower Chaussee, ")
    meets = {crossing(network, node) for node in range(len(network.node_ids))}
    assert "Rudower Chaussee / Groß-Berliner Damm" in meets or (
        "Groß-Berliner Damm / Rudower Chaussee" in meets
    )
