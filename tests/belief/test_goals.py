"""Targets that go somewhere: which goals, which routes, and what is refused."""

import logging
from itertools import pairwise
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

from planner.arrays import Flags, Floats
from planner.belief.kernels.trees import key_of, share_of
from planner.belief.known_routes import KnownRoutes
from planner.belief.particles import Particles
from planner.belief.sampling import Sampling, sample
from planner.belief.ways import BACK_S, DRIVERS, SPREAD, can_reach, quiet_streets, ways_to
from planner.errors import ScenarioError
from planner.mission.opening import OpenScenario, open_scenario
from planner.network.road_network import RoadNetwork
from planner.streams import stream
from support.sumo_instances import town
from support.towns import berlin

MIDDLE = "target.start={ x_m = 1100, y_m = 700, radius_m = 300 }"
ROUTES = """<routes>
<route id="straight" edges="AB BC CF"/>
<routeDistribution id="either">
<route refId="straight" probability="3"/><route edges="AB BD DF" probability="1"/>
</routeDistribution>
<vehicle id="a" depart="0" route="either"/>
<vehicle id="b" depart="1"><route edges="AB BE EF"/></vehicle>
</routes>"""


def going(goes: str, *overrides: str, scenario: str = "berlin") -> OpenScenario:
    middle = (MIDDLE,) if scenario == "berlin" else ()
    return open_scenario(scenario, overrides=(*middle, f"target.goes={goes}", *overrides))


def draw(opened: OpenScenario, n: int, sampling: Sampling = "sobol") -> Particles:
    rng = stream(1, "x")
    return sample(opened.prior, opened.network, n, rng, sampling=sampling, horizon_s=900.0)


def faults(*overrides: str, scenario: str = "figure1") -> list[str]:
    with pytest.raises(ScenarioError) as raised:
        open_scenario(scenario, overrides=overrides)
    return list(map(str, raised.value.faults))


def last_edges(particles: Particles) -> list[int]:
    return [int(particles.route(k)[-1]) for k in range(len(particles))]


def assert_turns(particles: Particles, network: RoadNetwork) -> None:
    for k in range(len(particles)):
        route = particles.route(k).tolist()
        for before, after in pairwise(route):
            assert after in network.turns(before, back=True)


def twin_graph(network: RoadNetwork, weight: Floats) -> "nx.DiGraph[int]":
    """The twin: edges as nodes, turns between them, weighted by networkx's own algorithm."""
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(network.edge_ids)))
    for edge in graph:
        for turn in range(network.first_turn[edge], network.first_turn[edge + 1]):
            onto = int(network.turn_edge[turn])
            back_s = BACK_S if network.turn_back[turn] else 0.0
            graph.add_edge(edge, onto, weight=back_s + weight[onto])
    return graph


def reached(network: RoadNetwork, source: int) -> Flags:
    found = nx.descendants(twin_graph(network, network.edge_length_m), source) | {source}
    return np.isin(np.arange(len(network.edge_ids)), sorted(found))


def cost(graph: "nx.DiGraph[int]", route: list[int]) -> float:
    return sum(graph.edges[before, after]["weight"] for before, after in pairwise(route))


@pytest.mark.parametrize("name", ["town", "berlin"])
def test_routes_are_the_quickest_to_a_driver_who_weighs_roads(name: str) -> None:
    network = town() if name == "town" else berlin().network
    goals, pace = quiet_streets(network), 1.0 / network.edge_limit_mps
    rng = np.random.default_rng(3)
    start = np.repeat(rng.choice(np.flatnonzero(can_reach(network, goals.edge)), 3), 2 * DRIVERS)
    rng.shuffle(start)
    ways = ways_to(goals, network, start, rng.random(len(start)), pace=pace, seed=7)
    seen: dict[int, int] = {}
    for k, source in enumerate(start.tolist()):
        rank = seen[source] = seen.get(source, -1) + 1
        key = np.uint64(key_of(7, source, rank // DRIVERS))
        shares = np.array([share_of(key, edge) for edge in range(len(network.edge_ids))])
        assert 0 <= shares.min() < shares.max() < 1
        graph = twin_graph(network, network.edge_length_m * pace * (1 + SPREAD * shares))
        route = ways.edge[ways.first_edge[k] : ways.first_edge[k + 1]].tolist()
        goal = int(goals.edge[ways.goal[k]])
        assert (route[0], route[-1]) == (source, goal)
        quickest = nx.dijkstra_path_length(graph, source, goal)
        assert cost(graph, route) == pytest.approx(quickest)


def test_drivers_of_other_trees_weigh_roads_differently() -> None:
    network = berlin().network
    goals = quiet_streets(network)
    start = np.full(40 * DRIVERS, np.flatnonzero(can_reach(network, goals.edge))[10])
    u = np.full(len(start), 0.97)
    pace = np.ones(len(network.edge_ids))
    ways = ways_to(goals, network, start, u, pace=pace, seed=7)
    assert len(set(ways.goal)) == 1
    routes = {
        tuple(ways.edge[ways.first_edge[k] : ways.first_edge[k + 1]]) for k in range(len(start))
    }
    assert 1 < len(routes) <= 40


@pytest.mark.parametrize("sampling", ["iid", "sobol"])
def test_somewhere_is_as_probable_as_the_street_is_long(sampling: Sampling) -> None:
    opened = going("somewhere")
    particles, network = draw(opened, 4000, sampling), opened.network
    assert_turns(particles.take(np.arange(300)), network)
    last = np.array(last_edges(particles))
    assert not network.edge_exit[last].any()
    assert not particles.gone.any()
    assert np.all(particles.end_m <= network.edge_length_m[last])
    share = particles.end_m / network.edge_length_m[last]
    assert share.mean() == pytest.approx(0.5, abs=0.03)
    # Every tenth of the streets within reach, by length, has a tenth of the targets.
    within = ~network.edge_exit & reached(network, int(particles.route(0)[0]))
    length_m = np.where(within, network.edge_length_m, 0.0) / network.edge_length_m[within].sum()
    tenth = np.clip(np.floor(10 * (np.cumsum(length_m) - 1e-9)), 0, 9).astype(int)
    found = np.bincount(tenth[last], minlength=10) / len(last)
    assert found == pytest.approx(np.bincount(tenth, length_m), abs=0.015)


def test_who_leaves_takes_exits_by_lanes_and_limit_and_is_gone() -> None:
    opened = going("leaves", "target.at_sink=stays")
    particles, network = draw(opened, 4000), opened.network
    last = np.array(last_edges(particles))
    assert network.edge_exit[last].all()
    assert particles.gone.all()
    assert np.all(np.isinf(particles.end_m))
    wanted = network.edge_exit * network.edge_lanes * network.edge_limit_mps
    wanted = np.where(reached(network, int(particles.route(0)[0])), wanted, 0.0)
    found = np.bincount(last, minlength=len(wanted)) / len(last)
    assert found == pytest.approx(wanted / wanted.sum(), abs=0.005)


def test_listed_goals_have_their_probabilities(tmp_path: Path) -> None:
    network = berlin().network
    street = network.edge_ids[np.argsort(network.edge_length_m)[-20]]
    exit_ = network.edge_ids[int(np.flatnonzero(network.edge_exit)[3])]
    zone = tmp_path / "zones.add.xml"
    zone.write_text(f'<additional><taz id="z" edges="{street}"/></additional>', encoding="utf-8")
    x_m, y_m = network.edge_xy(100, network.edge_length_m[100] / 2)
    opened = going(
        f'[{{ edge = "{exit_}", p = 0.5 }}, {{ taz = "z", file = "{zone}", p = 0.3 }}, '
        f"{{ x_m = {x_m}, y_m = {y_m}, p = 0.2 }}]"
    )
    particles = draw(opened, 1000)
    last = np.array(last_edges(particles))
    assert (last == network.edge_index[exit_]).mean() == pytest.approx(0.5, abs=0.002)
    assert (last == network.edge_index[street]).mean() == pytest.approx(0.3, abs=0.002)
    assert particles.gone.tolist() == network.edge_exit[last].tolist()
    rest = ~np.isin(last, [network.edge_index[exit_], network.edge_index[street]])
    assert len(np.unique(last[rest])) == 1
    place = network.edge_xy(int(last[rest][0]), float(particles.end_m[rest][0]))
    assert np.linalg.norm(place - (x_m, y_m)) < 8


@pytest.mark.parametrize("sampling", ["iid", "sobol"])
@pytest.mark.parametrize("goes", ["somewhere", "leaves"])
def test_neither_their_number_nor_the_horizon_changes_a_target(
    goes: str, sampling: Sampling
) -> None:
    opened = going(goes)
    many, few = draw(opened, 300, sampling), draw(opened, 77, sampling)
    for k in range(77):
        assert few.route(k).tolist() == many.route(k).tolist()
    for name in ("start_m", "end_m", "seed", "phase_s", "gone"):
        assert getattr(few, name).tolist() == getattr(many, name)[:77].tolist()


def test_routes_of_a_file_are_taken_by_their_weights(tmp_path: Path) -> None:
    path = tmp_path / "town.rou.xml"
    path.write_text(ROUTES, encoding="utf-8")
    opened = going(f'{{ file = "{path}" }}', "search.sampling=sobol", scenario="figure1")
    assert isinstance(opened.prior.goals, KnownRoutes)
    particles = draw(opened, 1024)
    names = [" ".join(opened.network.edge_ids[e] for e in particles.route(k)) for k in range(1024)]
    assert {name: names.count(name) for name in sorted(set(names))} == {
        "AB BC CF": 384,
        "AB BD DF": 128,
        "AB BE EF": 512,
    }


def test_on_their_way_targets_take_the_routes_that_come_by(tmp_path: Path) -> None:
    path = tmp_path / "town.rou.xml"
    path.write_text(ROUTES, encoding="utf-8")
    start = ("target.start={ BC = 0.5, BD = 0.25, CD = 0.25 }", "target.distance_m=anywhere")
    opened = going(f'{{ file = "{path}" }}', *start, "search.sampling=sobol", scenario="figure1")
    probability = opened.prior.edge_probability
    index = opened.network.edge_index
    assert probability[[index["BC"], index["BD"], index["CD"]]].tolist() == pytest.approx(
        [2 / 3, 1 / 3, 0]
    )
    particles = draw(opened, 100)
    names = {" ".join(opened.network.edge_ids[e] for e in particles.route(k)) for k in range(100)}
    assert names == {"BC CF", "BD DF"}


def test_trips_say_where_targets_go(tmp_path: Path) -> None:
    path = tmp_path / "town.trips.xml"
    trips = '<trip id="a" depart="0" from="AB" to="CF"/><trip id="b" depart="0" to="FG"/>'
    path.write_text(f"<routes>{trips}</routes>", encoding="utf-8")
    opened = going(f'{{ file = "{path}" }}', "search.sampling=sobol", scenario="figure1")
    last = [opened.network.edge_ids[edge] for edge in last_edges(draw(opened, 64))]
    assert sorted(set(last)) == ["CF", "FG"]
    assert last.count("CF") == 32


def test_starts_that_do_not_lead_there_are_left_out_and_told_of(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.WARNING)
    start = "target.start={ AB = 0.75, EF = 0.25 }"
    opened = going('[{ edge = "CD" }]', start, "search.sampling=sobol", scenario="figure1")
    assert opened.prior.edge_probability[opened.network.edge_index["AB"]] == 1
    assert "25 % of the starts, by probability, do not lead there" in caplog.text


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (
            ('target.goes=[{ edge = "CD" }]', 'target.start=["EF"]'),
            ["target.goes: none of the starts leads there; correct it, or target.start"],
        ),
        (
            ('target.goes=[{ edge = "CD" }, { edge = "FG" }]', 'target.start=["EF"]'),
            ["target.goes[0]: cannot be reached from any start; leave it out, or correct it"],
        ),
        (
            ("target.goes=leaves",),
            ['target.goes: "leaves" is by an exit of the map, of which there is none; name some in '
             'network.exits, or write "somewhere"'],
        ),
        (
            ('target.goes=[{ edge = "FG" }]', "target.turning={ AB = { BC = 1 } }"),
            ["target.turning: goes with turns by chance, but target.goes says where to; leave one "
             "of them out"],
        ),
        (
            ('target.goes=[{ edge = "FG" }]', "target.speed_drawn='per road'"),
            ['target.speed_drawn: "per road" goes with turns by chance, not with target.goes; '
             'write "once"'],
        ),
        (
            ('target.goes=[{ edge = "FG" }]', "search.sampling=all",
             "target.distance_m={ constant = 0 }",
             "target.speed_mps={ constant = 9 }"),
            ['target.goes: has endlessly many routes, but search.sampling is "all"; leave it out, '
             'or write search.sampling = "sobol"'],
        ),
        (
            ('target.goes=[{ edge = "XY", p = 1 }]',),
            ["target.goes[0].edge: XY is not an edge of the network; known: AB, BC, BD, BE, CD, "
             "CF, DF, ED, ..."],
        ),
        (
            ('target.goes=[{ edge = "CD", taz = "x" }]',),
            ["target.goes[0]: gives edge and taz; write { edge, p }, { x_m, y_m, radius_m, p }, "
             "{ lon, lat, radius_m, p } or { taz, file, p }"],
        ),
        (
            ('target.goes=[{ edge = "CD", p = 0.5 }, { edge = "FG", p = 0.4 }]',),
            ["target.goes: the probabilities sum to 0.9, not to one; change them until they do"],
        ),
        (
            ("target.goes=[]",),
            ['target.goes: is empty; name a place, or write "turns"'],
        ),
        (
            ("target.goes=[{ x_m = 90000, y_m = 0 }]",),
            ["target.goes[0]: lies 70,000 m from any road (FG is the nearest); give a place "
             "nearby, in metres as the net has them"],
        ),
        (
            ("target.goes=home",),
            ["target.goes: should be 'turns', 'somewhere' or 'leaves', not \"home\"; give "
             '"turns" by chance, "somewhere", "leaves", [{ edge, p }], or { file } of SUMO\'s '
             'routes; left out: "turns"'],
        ),
    ],
)  # fmt: skip
def test_faults_are_told_by_key(overrides: tuple[str, ...], expected: list[str]) -> None:
    assert faults("search.sampling=sobol", *overrides) == expected


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("<routes/>", "holds no route with a probability above 0 and no trip"),
        ('<routes><routeDistribution><route edges="AB" probability="0"/></routeDistribution>'
         "</routes>", "holds no route with a probability above 0 and no trip"),
        ('<routes><route edges="AB CD"/></routes>', "AB does not lead to CD, but to BC, BD, BE"),
        ('<routes><route edges="AB XX"/></routes>', "XX is not an edge of the network"),
        ('<routes><route edges=""/></routes>', "a route has no edges"),
        ('<routes><route edges="AB" probability="x"/></routes>', "is no probability"),
        ('<routes><vehicle id="a" route="no"/></routes>', "there is no route"),
        ('<routes><vehicle id="a"><route edges="AB"/></vehicle><trip id="b" to="FG"/></routes>',
         "holds routes and trips"),
    ],
)  # fmt: skip
def test_files_without_sound_routes_are_refused(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "town.rou.xml"
    path.write_text(content, encoding="utf-8")
    (fault,) = faults("search.sampling=sobol", f'target.goes={{ file = "{path}" }}')
    assert fault.startswith("target.goes: ")
    assert said in fault
