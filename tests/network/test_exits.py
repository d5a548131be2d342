"""The edge of the map: which edges lead off it, and what becomes of targets there."""

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from planner.arrays import Floats
from planner.belief.predefined import predefined
from planner.belief.sampling import sample
from planner.errors import InputError, ScenarioError
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.recorder import Recorder
from planner.network.exits import AROUND_M, found_exits
from planner.network.read import read_net
from planner.network.road_network import RoadNetwork
from planner.network.signals import signals_of
from planner.streams import stream

# A ring road with a lane inwards and one outwards, both of which end blind.
NODES = {
    **{
        f"r{k}": (800 * math.cos(k * math.pi / 4), 800 * math.sin(k * math.pi / 4))
        for k in range(8)
    },
    "in": (500.0, 0.0),
    "out": (1000.0, 0.0),
}
PAIRS = [(f"r{k}", f"r{(k + 1) % 8}") for k in range(8)] + [("r0", "in"), ("r0", "out")]
SCENARIO = """
[network]
nodes = "ring.nod.xml"
edges = "ring.edg.xml"
{exits}
[target]
start = ["r1-r0"]
speed_mps = {{ uniform = [8, 14] }}
driving = "free"
[uav]
start = {{ x_m = 0, y_m = 0 }}
speed_mps = 60
[search]
horizon_s = 600
particles = 60
"""


@pytest.fixture
def ring(tmp_path: Path) -> Path:
    nodes = [f'<node id="{n}" x="{x:.2f}" y="{y:.2f}"/>' for n, (x, y) in NODES.items()]
    ways = [way for a, b in PAIRS for way in ((a, b), (b, a))]
    edges = [f'<edge id="{a}-{b}" from="{a}" to="{b}" numLanes="1" speed="14"/>' for a, b in ways]
    (tmp_path / "ring.nod.xml").write_text(f"<nodes>{''.join(nodes)}</nodes>")
    (tmp_path / "ring.edg.xml").write_text(f"<edges>{''.join(edges)}</edges>")
    return tmp_path


def opened(folder: Path, exits: str = "", *overrides: str) -> OpenScenario:
    (folder / "scenario.toml").write_text(SCENARIO.format(exits=exits))
    return open_scenario(folder, overrides=overrides)


def exits_of(network: RoadNetwork) -> list[str]:
    return [network.edge_ids[edge] for edge in np.flatnonzero(network.edge_exit)]


def test_a_blind_end_at_the_hull_is_an_exit_and_one_inside_is_none(ring: Path) -> None:
    network = opened(ring).network
    assert exits_of(network) == ["r0-out"]
    edge = network.edge_index["r0-out"]
    assert len(network.turns(edge, back=True)) == 0
    assert len(network.turns(network.edge_index["r0-in"], back=True)) == 1


@pytest.mark.parametrize(
    ("exits", "expected"),
    [("exits = []", []), ('exits = ["r0-in", "r1-r2"]', ["r0-in", "r1-r2"])],
)
def test_the_scenario_says_which(ring: Path, exits: str, expected: list[str]) -> None:
    network = opened(ring, exits).network
    assert exits_of(network) == expected
    for name in expected:
        assert len(network.turns(network.edge_index[name], back=True)) == 0
    assert ("r0-out" in expected) == (
        len(network.turns(network.edge_index["r0-out"], back=True)) == 0
    )


def test_an_exit_that_is_no_edge_is_among_the_faults(ring: Path) -> None:
    with pytest.raises(ScenarioError) as refused:
        opened(ring, 'exits = ["r0-ot"]', "target.start=['r9-r0']")
    assert "network.exits.r0-ot: is not an edge of the network; did you mean r0-out?" in str(
        refused.value
    )
    assert "target.start.r9-r0" in str(refused.value)
    with pytest.raises(InputError, match="exits: r0-ot is not an edge"):
        read_net(opened(ring).network.path, exits=["r0-ot"])


def test_nothing_starts_on_an_exit_and_nobody_is_said_to_turn_there(ring: Path) -> None:
    with pytest.raises(ScenarioError, match=r"target\.start\.r0-out: is an exit: a target"):
        opened(ring, "", "target.start=['r0-out']")
    with pytest.raises(ScenarioError, match=r"turning\.r0-out\.out-r0: r0-out is an exit"):
        opened(ring, "", "target.turning={ 'r0-out' = { 'out-r0' = 1 } }")


def test_a_turn_file_may_tell_of_turns_there(ring: Path) -> None:
    relations = '<edgeRelation from="r0-out" to="out-r0" count="1"/>'
    relations += '<edgeRelation from="r1-r0" to="r0-out" count="1"/>'
    (ring / "turns.xml").write_text(
        f'<data><interval begin="0" end="3600">{relations}</interval></data>'
    )
    scenario = opened(ring, "", "target.turning={ file = 'turns.xml' }")
    (note,) = scenario.notes
    assert note.endswith("turns.xml: left out: 1 turn from exits of the map")
    particles = sample(scenario.prior, scenario.network, 20, stream(1), horizon_s=600.0)
    assert all(particles.route(k).tolist()[-1] in _exits(scenario) for k in range(20))


def _exits(scenario: OpenScenario) -> list[int]:
    return np.flatnonzero(scenario.network.edge_exit).tolist()


def test_who_reaches_an_exit_has_left_whatever_becomes_of_others(ring: Path) -> None:
    scenario = opened(ring)
    assert not scenario.prior.gone
    particles = sample(scenario.prior, scenario.network, 60, stream(1), horizon_s=600.0)
    last = np.array([particles.route(k)[-1] for k in range(60)])
    assert 10 <= particles.gone.sum() < 60
    np.testing.assert_array_equal(particles.gone, scenario.network.edge_exit[last])
    one = predefined(
        scenario.network, scenario.prior, ["r1-r0", "r0-out"], stream(1), speed_mps=10.0
    )
    assert one.gone.tolist() == [True]


def test_recorded_targets_vanish_at_an_exit(ring: Path) -> None:
    scenario = opened(ring)
    futures = Recorder(scenario, workers=1).planning().futures
    assert futures.gone.any()
    end = NODES["out"]
    for k in np.flatnonzero(futures.gone):
        x_m, y_m = (
            futures.x_m[futures.first_knot[k + 1] - 1],
            futures.y_m[futures.first_knot[k + 1] - 1],
        )
        if futures.end_s[k] < 600.0:
            assert math.dist((x_m, y_m), end) < 20.0
            assert np.isnan(futures.positions(599.0)[k]).all()


def test_signals_are_kept_for_each_choice_of_exits(ring: Path) -> None:
    """As many turns are left, but not the same ones."""
    path = opened(ring).network.path
    for name in ("r0-in", "r0-out"):
        network = read_net(path, exits=[name])
        ends = signals_of(network).first_point[:-1][len(network.edge_ids) :]
        at = signals_of(network).xy_m[ends]
        left = np.repeat(np.arange(len(network.edge_ids)), np.diff(network.first_turn))
        away_m = np.linalg.norm(at - network.node_xy_m[network.road_to[left]], axis=1)
        assert away_m.max() < 30.0


def test_berlin_has_sixteen_exits(berlin: OpenScenario) -> None:
    assert berlin.network.edge_exit.sum() == 16


def test_luxembourg_has_twenty_nine_exits(luxembourg: OpenScenario) -> None:
    assert luxembourg.network.edge_exit.sum() == 29


@pytest.mark.parametrize("name", ["grid5x5", "figure3", "figure3-gone"])
def test_abstract_nets_have_none(name: str) -> None:
    assert not open_scenario(name).network.edge_exit.any()


def test_one_straight_road_ends_at_both_of_its_exits() -> None:
    line = np.array([[0.0, 0.0], [300.0, 0.0]])
    assert found_exits([line, line[::-1]], np.zeros(2, bool)).tolist() == [True, True]
    assert found_exits([line, line[::-1]], np.ones(2, bool)).tolist() == [False, False]


def slow_free_deg(end: Floats, shapes: Sequence[Floats]) -> float:
    """Widest sector in whole degrees, by looking along each direction for a road."""
    seen = np.zeros(3600, bool)
    for shape in shapes:
        for a, b in pairwise(shape):
            for share in np.linspace(0, 1, max(2, int(math.dist(a, b) / 5))):
                x, y = a + (b - a) * share - end
                if 30.0 < math.hypot(x, y) <= AROUND_M:
                    seen[int(math.degrees(math.atan2(y, x)) * 10) % 3600] = True
    widest = run = 0
    for taken in np.concatenate((seen, seen)):
        run = 0 if taken else run + 1
        widest = max(widest, run)
    return min(widest, 3600) / 10


def test_the_free_sector_is_that_of_a_slow_look_around() -> None:
    """Roads fan out from one blind end; the sector before it is 140 or 160 degrees wide."""
    far = np.array([[4000.0, 4000.0], [4000.0, -4000.0], [-4000.0, -4000.0], [-4000.0, 4000.0]])
    box = [np.array([a, b]) for a, b in zip(far, np.roll(far, -1, axis=0), strict=True)]
    for free_deg, expected in ((140, False), (160, True)):
        fan_deg = np.arange(free_deg / 2, 360 - free_deg / 2 + 1, 20)
        fan = [
            np.array([[1200 * math.cos(t), 1200 * math.sin(t)], [0.0, 0.0]])
            for t in np.radians(fan_deg)
        ]
        shapes = [*box, *fan]
        leads_on = np.ones(len(shapes), bool)
        leads_on[len(box)] = False
        assert (slow_free_deg(np.zeros(2), shapes) >= 150.0) == expected
        assert found_exits(shapes, leads_on)[len(box)] == expected
