"""The measures of nets, against nets small enough to count by hand, and slow looks at a town."""

from collections.abc import Mapping
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest

from planner.mission.opening import OpenScenario
from planner.network.exits import with_exits
from planner.network.road_network import RoadNetwork
from planner.network.survey import reach_m, remarks, survey
from support.instances import by_two_letters, figure3, town

PLACES: Mapping[str, tuple[float, float]] = {
    name: (100.0 * x, 100.0 * y)
    for name, x, y in (
        ("A", 0, 0), ("B", 1, 0), ("C", 1, 1), ("D", 0, 1), ("E", 2, 0), ("F", 3, 0), ("G", 3, 1),
        ("H", 8, 8), ("I", 9, 8), ("J", 9, 9),
    )
}  # fmt: skip


def net(roads: str) -> RoadNetwork:
    return replace(by_two_letters(PLACES, roads), path=town().path)  # for its signals alone


def told(network: RoadNetwork) -> str:
    return "\n".join(remarks(survey(network), network))


def test_a_circle_with_a_way_in_and_a_yard() -> None:
    """A-B-C-D is a circle; E leads into it, and F is reached from it but not left."""
    network = net("AB BC CD DA EB BF")
    found = survey(network)
    assert (found.edges, found.roads, found.components) == (6, 6, 1)
    assert found.main_share == pytest.approx(400 / 700)
    assert found.not_reached == ("EB",)
    assert found.not_left == ("BF",)
    assert found.dead_ends == 1
    assert found.pieces == 1
    assert "1 edge that no car gets to from elsewhere: EB" in told(network)
    assert "1 edge that no car gets away from: BF" in told(network)


def test_an_exit_is_a_way_out() -> None:
    network = net("AB BC CD DA BF")
    exits = np.array([name == "BF" for name in network.edge_ids])
    opened = with_exits(network, exits)
    found = survey(opened)
    assert (found.exits, found.dead_ends, found.not_left) == (1, 0, ())
    assert reach_m(opened, 0) == float("inf")
    assert reach_m(network, network.edge_index["BF"]) == pytest.approx(200.0)


def test_two_components_and_two_pieces() -> None:
    joined = net("AB BA BE EF FG GE")
    assert survey(joined).components == 2
    assert survey(joined).pieces == 1
    assert "pieces" not in told(joined)
    apart = net("AB BC CD DA HI IJ JH")
    assert survey(apart).components == survey(apart).pieces == 2
    assert "it is in 2 pieces, which no road joins: a target stays in its own" in told(apart)
    assert "3 edges that no car gets to from elsewhere: HI, IJ, JH" in told(apart)


def test_one_road_and_a_roundabout_alone() -> None:
    for roads in ("AB", "AB BA"):
        assert "there is one road only: nothing to choose" in told(net(roads))
    assert "one road only" not in told(net("AB BC"))
    assert "nothing but a ring of one-way roads" in told(net("AB BC CD DA"))
    for roads in ("AB BC CD DA BE", "AB BA", "AB BC"):
        assert "ring" not in told(net(roads))


def test_what_the_net_does_not_say() -> None:
    network = net("AB BC CD DA")
    assert "no projection: places are metres in the net's frame" in told(network)
    assert "no street has a name" in told(network)
    odd = replace(network, projection="+proj=nothing")
    assert "PROJ does not know its projection, +proj=nothing: places are metres only" in told(odd)
    assert survey(odd).projection is survey(odd).lonlat_deg is None


def test_the_papers_nets_have_no_circle_to_be_on() -> None:
    found = survey(replace(figure3(), path=town().path))
    assert (found.components, found.main_share, found.not_left) == (0, 0.0, ())
    assert not found.rings


def test_the_small_town() -> None:
    found = survey(town())
    assert (found.signals, found.roundabouts, found.dead_ends, found.exits) == (1, 0, 1, 0)
    assert (found.components, found.pieces, found.main_share) == (1, 1, 1.0)
    assert "a closed box" in told(town())


def test_berlin_by_a_slow_look(berlin: OpenScenario) -> None:
    network = berlin.network
    found = survey(network)
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(network.edge_ids)))
    graph.add_edges_from(
        (edge, int(to)) for edge in range(len(network.edge_ids)) for to in network.turns(edge)
    )
    strong = [part for part in nx.strongly_connected_components(graph) if len(part) > 1]
    assert found.components == len(strong)
    main = max(strong, key=lambda part: network.edge_length_m[list(part)].sum())
    first = min(main)
    reached = nx.descendants(graph, first) | {first}
    assert set(found.not_reached) == {
        name for edge, name in enumerate(network.edge_ids) if edge not in reached
    }
    exits = set(np.flatnonzero(network.edge_exit).tolist())
    left = [e for e in graph if e in exits or (nx.descendants(graph, e) | {e}) & (main | exits)]
    assert set(found.not_left) == set(network.edge_ids) - {network.edge_ids[e] for e in left}
    assert found.exits == 16
    assert found.named_share > 0.99
    assert found.lonlat_deg is not None
    west, south, east, north = found.lonlat_deg
    assert 13.45 < west < east < 13.58
    assert 52.42 < south < north < 52.46
    # tan of the convergence is tan of the longitude off the meridian of 15 degrees times sin of
    # the latitude.
    away, latitude = np.radians([(west + east) / 2 - 15.0, (south + north) / 2])
    expected_deg = np.degrees(np.arctan(np.tan(away) * np.sin(latitude)))
    assert found.convergence_deg == pytest.approx(expected_deg, abs=1e-3)


def test_luxembourg(luxembourg: OpenScenario) -> None:
    found = survey(luxembourg.network)
    assert (found.edges, found.exits, found.signals) == (5749, 29, 202)
    assert round(found.edge_km) == 905
