"""Scenarios with their networks: what comes out, and faults that only the network shows."""

import logging
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from planner.belief.sampling import sample
from planner.belief.turn_file import read_turns
from planner.errors import InputError, ScenarioError
from planner.mission.opening import OpenScenario, open_scenario
from planner.search.greedy import GreedyOptions
from planner.streams import stream
from support.sumo_instances import NETS

TOWN = f"""
[network]
nodes = "{NETS}/town/town.nod.xml"
edges = "{NETS}/town/town.edg.xml"
[target]
start = "anywhere"
speed_mps = {{ uniform = [5, 12] }}
[uav]
start = {{ x_m = 3, y_m = 4 }}
[search]
horizon_s = 600
"""
TURNS = """<edgeRelations><interval begin="0" end="3600">
<edgeRelation from="AB" to="BC" probability="0.25"/>
<edgeRelation from="AB" to="BD" probability="0.75"/>
<edgeRelation from="AB" to="GONE" probability="0"/>
</interval></edgeRelations>"""


def opened(*overrides: str, name: str | Path = "figure3") -> OpenScenario:
    return open_scenario(name, overrides=overrides)


def faults(*overrides: str, name: str | Path = "figure3") -> list[str]:
    with pytest.raises(ScenarioError) as raised:
        open_scenario(name, overrides=overrides)
    return list(map(str, raised.value.faults))


def test_figure3() -> None:
    figure3 = opened()
    assert figure3.prior.edge_probability[figure3.network.edge_index["AB"]] == 1
    assert figure3.prior.edge_probability.sum() == 1
    assert figure3.starts_m[0] == (-30000, 0)
    assert not figure3.prior.gone
    assert opened(name="figure3-gone").prior.gone
    assert opened(name="figure3-gone").network.sha256 == figure3.network.sha256


@pytest.mark.parametrize(
    ("bearing", "expected"),
    [(0, (10000, 5000)), (90, (11000, 4000)), (180, (10000, 3000)), (270, (9000, 4000))],
)
def test_compass_bearing(bearing: float, expected: tuple[float, float]) -> None:
    start = f"uav.start={{node='C', bearing_deg={bearing}, distance_m=1000}}"
    assert opened(start).starts_m[0] == pytest.approx(expected)


def test_the_grids_uav_is_north_west_of_its_origin() -> None:
    grid = opened("uav.start.distance_m=100000", name="grid5x5")
    assert grid.starts_m[0] == pytest.approx((-100000 / np.sqrt(2), 100000 / np.sqrt(2)))


def test_turns_of_the_file_and_of_the_scenario(tmp_path: Path) -> None:
    path = tmp_path / "turns.xml"
    path.write_text(TURNS.replace("GONE", "CE"))
    listed = opened("target.turning={AB={BC=0.25, BD=0.75}}")
    by_file = opened(f"target.turning={{file='{path}'}}")
    network = listed.network
    shares = dict(zip(network.turn_edge.tolist(), listed.prior.turn_probability, strict=True))
    assert shares == {
        network.edge_index[edge]: share
        for edge, share in {
            "BC": 0.25,
            "BD": 0.75,
            "CE": 0.5,
            "CF": 0.5,
            "DF": 0.5,
            "DG": 0.5,
        }.items()
    }
    assert np.array_equal(listed.prior.turn_probability, by_file.prior.turn_probability)


def test_truth_has_a_prior_of_its_own() -> None:
    given = ["truth.start=['BC']", "truth.at_sink=gone", "truth.turning={AB={BC=1.0}}"]
    figure3 = opened(*given)
    assert figure3.truth_prior.gone
    assert not figure3.prior.gone
    assert figure3.truth_prior.edge_probability[figure3.network.edge_index["BC"]] == 1
    assert figure3.truth_prior.speed_mps.low == figure3.prior.speed_mps.low


@pytest.fixture
def town(tmp_path: Path) -> Path:
    (tmp_path / "scenario.toml").write_text(TOWN)
    return tmp_path


def test_town_anywhere_is_by_length(town: Path) -> None:
    found = opened(name=town)
    share = found.network.edge_length_m / found.network.edge_length_m.sum()
    assert found.prior.edge_probability == pytest.approx(share)
    for sampling in ("iid", "sobol"):
        particles = sample(
            found.prior, found.network, 300, stream(1), sampling=sampling, horizon_s=600.0
        )
        assert len(set(particles.route_edge.tolist())) == len(found.network.edge_ids)


def test_town_has_no_room_for_long_distances(town: Path) -> None:
    found = faults("target.distance_m={uniform=[0, 5000]}", name=town)
    assert len(found) == 1
    assert found[0].startswith("target.distance_m: reaches to 5000 m, but ")


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("target.start={AX=1}", "target.start.AX: is not an edge of the network; known: AB, BC"),
        ("target.start=['CE']", "target.start.CE: has no way on; choose"),
        ("target.distance_m={constant=6000}", "target.distance_m: reaches to 6000 m, but AB is 50"),
        ("target.distance_m={list=[0, 6000]}", "target.distance_m: reaches to 6000 m, but AB is "),
        ("target.turning={AX={BC=1}}", "target.turning.AX: is not an edge of the network; known"),
        ("target.turning={AB={BX=1}}", "target.turning.AB.BX: is not an edge of the network;"),
        ("target.turning={AB={CE=1}}", "target.turning.AB.CE: AB does not lead to CE; it leads to"),
        ("target.turning={CE={AB=1}}", "target.turning.CE.AB: CE does not lead to AB; it has no"),
        ("truth.start=['DG']", "truth.start.DG: has no way on; choose"),
        ("truth.distance_m={constant=6000}", "truth.distance_m: reaches to 6000 m, but AB is 5000"),
        ("uav.return_to={node='X'}", "uav.return_to.node: X is not a node of the network; known:"),
        ("uav.start={node='X'}", "uav.start.node: X is not a node of the network; known: A, B"),
    ],
)
def test_faults_that_the_network_shows(override: str, expected: str) -> None:
    found = faults(override)
    assert len(found) == 1
    assert found[0].startswith(expected)


def test_a_start_of_the_truth_may_be_too_short_for_the_belief() -> None:
    overrides = ["target.distance_m={constant=5000}", "truth.start=['BC']"]
    assert opened(*overrides).truth_prior.distance_m is not None
    grid = ["target.distance_m={constant=14000}", "truth.start=['r0c1-r0c2']"]
    assert opened(*grid, name="grid5x5")
    long = ["target.distance_m={constant=6000}", "target.start=['BC']", "truth.start=['AB']"]
    assert [fault.partition(":")[0] for fault in faults(*long)] == ["truth.distance_m"]


def test_faults_of_all_kinds_come_together(tmp_path: Path) -> None:
    path = tmp_path / "turns.xml"
    path.write_text(TURNS.replace('"0.25"', '"0.5"'))
    found = faults(
        "sensor.radios_m=3",
        "target.start={AB=0.5, BX=0.4}",
        "target.colour=red",
        "uav.start={node='X', bearng_deg=1}",
        "search.depth=0",
        f"target.turning={{file='{path}'}}",
        "target.distance_m={constant=6000}",
        "truth.start={}",
    )
    assert [fault.partition(": ")[0] for fault in found] == [
        "target.colour",
        "target.start",
        "truth.start",
        "uav.start.bearng_deg",
        "sensor.radios_m",
        "search.depth",
        "target.turning.file",
        "target.start.BX",
        "target.distance_m",
        "uav.start.node",
    ]


def test_an_unknown_start_does_not_blame_the_distance(town: Path) -> None:
    found = faults("target.start=7", "target.distance_m={constant=5000}", name=town)
    assert [fault.partition(":")[0] for fault in found] == ["target.start"]


def test_a_broken_network_is_told_as_it_is_or_with_the_rest(tmp_path: Path) -> None:
    (tmp_path / "town.net.xml").write_text("<net><edge")
    text = TOWN.split("[target]")[1]
    (tmp_path / "scenario.toml").write_text(f"[network]\nnet='town.net.xml'\n[target]{text}")
    with pytest.raises(InputError) as raised:
        open_scenario(tmp_path)
    assert not isinstance(raised.value, ScenarioError)
    found = faults("search.depth=0", name=tmp_path)
    assert [fault.partition(":")[0] for fault in found] == ["search.depth", "network"]


def test_a_missing_network_is_told_once(town: Path) -> None:
    assert len(faults("network.nodes=none.xml", name=town)) == 1


def test_slow_uav_is_warned_of_once(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        opened("uav.speed_mps=50")
    assert len(caplog.records) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<edgeRelations", "is not XML"),
        ("<edgeRelations/>", "holds no edgeRelation"),
        (TURNS.replace('to="BC"', ""), "lacks from or to"),
        (TURNS.replace("BD", "BC"), "gives the turn from AB to BC twice"),
        (TURNS.replace("0.25", "half"), 'from AB to BC has probability "half"; give'),
        (TURNS.replace("0.25", "-1"), 'has probability "-1"; give'),
        (TURNS.replace('probability="0.25"', ""), "has no probability; give"),
    ],
)
def test_broken_turn_files(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "turns.xml"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_turns(path)
    found = faults(f"target.turning={{file='{path}'}}")
    assert len(found) == 1
    assert message in found[0]


def test_no_turn_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_turns(tmp_path / "turns.xml")


def test_nothing_that_is_kept_in_memory_is_stale(tmp_path: Path) -> None:
    for kind in ("nod", "edg"):
        text = (NETS / f"town/town.{kind}.xml").read_text()
        (tmp_path / f"town.{kind}.xml").write_text(text)
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(TOWN.replace(f"{NETS}/town/", ""))
    before = opened("search.seed=5", name=tmp_path)
    assert opened("search.seed=5", name=tmp_path).network is before.network
    assert opened(name=tmp_path).scenario.search.seed == 1  # an override is not kept
    scenario.write_text(scenario.read_text().replace("x_m = 3", "x_m = 4"))
    assert opened(name=tmp_path).starts_m[0] == (4.0, 4.0)
    edges = tmp_path / "town.edg.xml"
    edges.write_text(edges.read_text().replace('speed="', 'speed="1'))
    after = opened(name=tmp_path).network
    assert after.sha256 != before.network.sha256
    assert (after.edge_limit_mps > before.network.edge_limit_mps).all()


def test_the_options_of_greedy_are_those_of_the_scenario() -> None:
    plain = opened().scenario.greedy.model_dump()
    assert plain == asdict(GreedyOptions())


def test_a_uav_that_never_comes_near_the_net() -> None:
    # Seen from 200 m, at 100 m/s for an hour: 360.2 km west of A.
    assert opened("uav.start.x_m=-360200").starts_m[0][0] == -360_200.0
    (told,) = faults("uav.start.x_m=-360201")
    assert told.startswith("uav.start: lies 360.201 km from the net (x 0 to 15000, y -8000 to 8000")
    (told,) = faults("uav.start={ x_m = 392000.0, y_m = 5820000.0 }")
    assert "farther than the UAV flies by search.horizon_s" in told
