"""Turn files as SUMO's own tools write them."""

import logging
from pathlib import Path

import numpy as np
import pytest

from planner.belief.prior import turn_probability
from planner.belief.turn_file import read_turns
from planner.clock import sumo_seconds
from planner.errors import InputError
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.remarks import scenario_remarks
from planner.network.read import read_net

# From a to b, and from b on to c, back to a, or over a path that is not for cars to d.
NODES = "".join(
    f'<node id="{name}" x="{x}" y="{y}"/>'
    for name, x, y in (("a", 0, 0), ("b", 500, 0), ("c", 900, 300), ("d", 900, -300))
)
EDGES = "".join(
    f'<edge id="{name}" from="{name[0]}" to="{name[1]}" numLanes="1" speed="14" {more}/>'
    for name, more in (("ab", ""), ("ba", ""), ("bc", ""), ("bd", ""), ("bq", 'allow="bicycle"'))
).replace('to="q"', 'to="d"')
SCENARIO = """
[network]
nodes = "n.nod.xml"
edges = "n.edg.xml"
exits = []
[target]
start = ["ab"]
turning = { file = "turns.xml" }
[uav]
start = { x_m = 0, y_m = 0 }
[search]
horizon_s = 3600
"""


def turns(folder: Path, text: str, horizon_s: float = 3600) -> dict[str, dict[str, float]]:
    (folder / "turns.xml").write_text(text)
    return read_turns(folder / "turns.xml", horizon_s)


def relation(end: str, share: str, start: str = "ab") -> str:
    return f'<edgeRelation from="{start}" to="{end}" {share}/>'


def interval(begin: str, end: str, *relations: str) -> str:
    return f'<interval begin="{begin}" end="{end}">{"".join(relations)}</interval>'


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ('count="3"', 'count="1"', (0.75, 0.25)),
        ('probability="75"', 'probability="25"', (0.75, 0.25)),
        ('probability="0.33"', 'probability="0.33"', (0.5, 0.5)),
        ('probability="0.66"', 'probability="0.33"', (2 / 3, 1 / 3)),
        ('count="3" probability="0.1"', 'count="1" probability="0.9"', (0.75, 0.25)),
    ],
)
def test_shares_become_parts_of_one(
    tmp_path: Path, first: str, second: str, expected: tuple[float, float]
) -> None:
    body = interval("0", "3600", relation("bc", first), relation("bd", second))
    found = turns(tmp_path, f"<data>{body}</data>")
    assert found["ab"]["bc"] == pytest.approx(expected[0], abs=1e-12)
    assert found["ab"]["bd"] == pytest.approx(expected[1], abs=1e-12)


def test_the_older_format(tmp_path: Path) -> None:
    text = '<fromEdge id="ab"><toEdge id="bc" probability="3"/><toEdge id="bd" probability="1"/>'
    found = turns(
        tmp_path, f'<turns><interval begin="0" end="9">{text}</fromEdge></interval></turns>'
    )
    assert found == {"ab": {"bc": 0.75, "bd": 0.25}}


def test_intervals_count_for_as_long_as_they_hold(tmp_path: Path) -> None:
    text = "<data>{}{}{}</data>".format(
        interval("0:00:00", "0:15:00", relation("bc", 'count="1"')),
        interval("0:0:15:0", "0:2:00:00", relation("bd", 'count="50"')),
        interval("1:0:00:00", "2:0:00:00", relation("ba", 'count="9"')),
    )
    notes: list[str] = []
    turns(tmp_path, text)
    found = read_turns(tmp_path / "turns.xml", 3600, note=notes.append)
    assert found["ab"] == pytest.approx({"bc": 0.25, "bd": 0.75}, abs=1e-12)
    assert "2 intervals" in notes[0]
    assert turns(tmp_path, text, 600)["ab"] == {"bc": 1.0}
    late = interval("28800", "30000", relation("bc", 'count="1"'))
    with pytest.raises(InputError, match="within the search"):
        turns(tmp_path, f"<data>{late}{late}</data>")


@pytest.mark.parametrize(
    ("text", "expected"),
    [("90", 90.0), ("0:01:30", 90.0), ("1:02:03:04.5", 93784.5), ("-1:00:00:00", -86400.0)],
)
def test_times_as_sumo_writes_them(text: str, expected: float) -> None:
    assert sumo_seconds(text) == expected


@pytest.fixture
def town(tmp_path: Path) -> Path:
    (tmp_path / "n.nod.xml").write_text(f"<nodes>{NODES}</nodes>")
    (tmp_path / "n.edg.xml").write_text(f"<edges>{EDGES}</edges>")
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    return tmp_path


def with_turns(town: Path, *elements: str) -> OpenScenario:
    (town / "turns.xml").write_text(f"<data>{interval('0', '3600', *elements)}</data>")
    return open_scenario(town)


def shares_of_ab(opened: OpenScenario) -> dict[str, float]:
    network, edge = opened.network, opened.network.edge_index["ab"]
    ways = slice(network.first_turn[edge], network.first_turn[edge + 1])
    names = [network.edge_ids[end] for end in network.turns(edge, back=True)]
    return dict(zip(names, opened.prior.turn_probability[ways].tolist(), strict=True))


def test_a_way_straight_back_is_taken_by_who_is_said_to(town: Path) -> None:
    opened = with_turns(town, relation("ba", 'count="1"'), relation("bc", 'count="3"'))
    assert shares_of_ab(opened) == {"ba": 0.25, "bc": 0.75, "bd": 0.0}
    assert [opened.network.edge_ids[e] for e in opened.network.turns(0)] == ["bc", "bd"]
    assert np.isclose(turn_probability(opened.network, {})[opened.network.turn_back], 0).all()
    equally = with_turns(town, relation("ab", 'count="1"', start="ba"))
    assert shares_of_ab(equally) == {"ba": 0.0, "bc": 0.5, "bd": 0.5}


def test_trips_end_on_a_sink(town: Path) -> None:
    opened = with_turns(town, relation("ba", 'count="1"'), '<sink edges="ba bc"/>')
    network = opened.network
    edge = network.edge_index["ba"]
    first, last = network.first_turn[edge : edge + 2]
    assert last > first
    assert opened.prior.turn_probability[first:last].tolist() == [0.0] * (last - first)


def test_edges_not_for_cars(town: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        opened = with_turns(town, relation("bq", 'count="8"'), relation("bc", 'count="2"'))
    assert not caplog.records  # it is told by `planner check` alone
    (note,) = (line for line in scenario_remarks(opened) if "turns" in line)
    assert note.endswith("left out: 1 turn from or to edges not for cars")
    assert shares_of_ab(opened) == {"ba": 0.0, "bc": 1.0, "bd": 0.0}
    assert opened.network.closed_edge_ids == ("bq",)
    assert read_net(opened.network.path).closed_edges == {"bq"}
    with pytest.raises(InputError, match=r"target\.start\.bq: is not for cars"):
        open_scenario(town, overrides=["target.start=['bq']"])
