"""Sources and cycles, against plain walking."""

from dataclasses import replace

import networkx as nx
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.network.road_network import RoadNetwork
from planner.network.topology import find_cycle, road_graph, sources
from support.instances import by_two_letters, figure1, figure3, grid

PLACES = {name: (i * 100.0, i * i * 10.0) for i, name in enumerate("ABCDEF")}
pairs = st.tuples(st.sampled_from("ABCDEF"), st.sampled_from("ABCDEF")).map("".join)
nets = st.lists(pairs, min_size=1, max_size=9, unique=True).map(
    lambda roads: by_two_letters(PLACES, " ".join(roads))
)


def names(network: RoadNetwork, nodes: object) -> str:
    return "".join(network.node_ids[node] for node in nodes)  # type: ignore[attr-defined]


def test_papers_nets() -> None:
    assert names(figure1(), sources(figure1())) == "A"
    assert names(figure3(), sources(figure3())) == "A"
    assert find_cycle(grid(6, 6)) == ()


def test_shortest_cycle_is_named() -> None:
    assert find_cycle(by_two_letters(PLACES, "AB BC CD DB CB")) == ("BC", "CB")
    assert find_cycle(by_two_letters(PLACES, "AB BB")) == ("BB",)


def test_parallel_roads_are_two() -> None:
    network = by_two_letters(PLACES, "AB AB BC")
    assert road_graph(network).number_of_edges() == 3


def test_a_road_driven_both_ways_is_a_cycle_and_no_source() -> None:
    network = by_two_letters({name: PLACES[name] for name in "ABC"}, "AB BC")
    both = replace(network, both_ways=np.array([False, True]))
    assert find_cycle(both) == ("BC", "BC")
    assert names(both, sources(both)) == "A"
    assert names(both, sources(replace(network, both_ways=np.ones(2, bool)))) == ""


@given(nets)
def test_cycle_is_one_and_is_found(network: RoadNetwork) -> None:
    cycle = find_cycle(network)
    assert bool(cycle) != nx.is_directed_acyclic_graph(road_graph(network))
    for road, following in zip(cycle, cycle[1:] + cycle[:1], strict=True):
        assert road[1] == following[0]


@given(nets)
def test_sources(network: RoadNetwork) -> None:
    assert names(network, sources(network)) == "".join(
        n for n in "ABCDEF" if not any(road[1] == n for road in network.road_ids)
    )
