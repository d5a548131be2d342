"""Nets as columns: exact for the paper's, right for towns, clear when broken."""

import xml.etree.ElementTree as ET
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.network import read
from planner.network.read import open_network, read_net
from planner.network.road_network import RoadNetwork
from planner.scenario.sections import NetworkSection
from support import instances
from support.data import data_file

NETS = Path(__file__).parents[2] / "sumo_nets"


def section(**given: object) -> NetworkSection:
    return NetworkSection.model_validate({"abstract": True, **given})


def shipped_net(name: str) -> RoadNetwork:
    plain = section(nodes=f"{name}.nod.xml", edges=f"{name}.edg.xml")
    return open_network(plain, NETS / name)


@pytest.mark.parametrize("name", ["grid5x5", "figure1", "figure3"])
def test_abstract_nets_come_out_as_they_went_in(name: str) -> None:
    network = shipped_net(name)
    nodes = ET.parse(NETS / name / f"{name}.nod.xml").getroot()
    edges = ET.parse(NETS / name / f"{name}.edg.xml").getroot()
    place = {n.attrib["id"]: (float(n.attrib["x"]), float(n.attrib["y"])) for n in nodes}
    assert set(network.node_ids) == set(place)
    np.testing.assert_array_equal(network.node_xy_m, [place[n] for n in network.node_ids])
    assert sorted(network.edge_ids) == sorted(e.attrib["id"] for e in edges)
    for edge in edges:
        i = network.edge_index[edge.attrib["id"]]
        ends = np.array([place[edge.attrib[end]] for end in ("from", "to")])
        np.testing.assert_array_equal(network.shape(i), ends)
        length = np.hypot(*(ends[1] - ends[0]))
        assert network.edge_length_m[i] == pytest.approx(length, abs=1e-8)
        assert network.edge_limit_mps[i] == float(edge.attrib["speed"])


@pytest.mark.parametrize("name", ["figure1", "figure3", "grid5x5"])
def test_turns_follow_the_roads(name: str) -> None:
    network = shipped_net(name)
    for edge, end in enumerate(network.road_to):
        leaving = np.flatnonzero(network.road_from == end)
        np.testing.assert_array_equal(network.turns(edge), leaving)


@pytest.mark.parametrize("name", ["figure1", "figure3"])
def test_instances_for_tests_are_the_shipped_nets(name: str) -> None:
    made: RoadNetwork = getattr(instances, name)()
    network = shipped_net(name)
    for column in fields(RoadNetwork):
        if column.name not in ("path", "sha256", "source", "edge_limit_mps", "edge_length_m"):
            np.testing.assert_array_equal(
                getattr(made, column.name), getattr(network, column.name), err_msg=column.name
            )
    np.testing.assert_allclose(made.edge_length_m, network.edge_length_m, atol=1e-8)


def test_grid_is_the_papers() -> None:
    network = shipped_net("grid5x5")
    assert len(network.node_ids) == 36
    assert len(network.edge_ids) == 60
    assert set(network.edge_length_m) == {15000.0}
    east_or_south = np.diff(network.shape_xy_m.reshape(-1, 2, 2), axis=1)[:, 0]
    assert {tuple(step) for step in east_or_south} == {(15000.0, 0.0), (0.0, -15000.0)}


class TestTown:
    def test_roads_run_from_node_to_node(self) -> None:
        network = instances.town()
        for road in range(len(network.road_ids)):
            shape = network.shape(road)
            np.testing.assert_array_equal(shape[0], network.node_xy_m[network.road_from[road]])
            np.testing.assert_array_equal(shape[-1], network.node_xy_m[network.road_to[road]])

    def test_curves_keep_their_points(self) -> None:
        network = instances.town()
        road = network.road_ids.index("n-ne")
        bend = [(210, 410), (280, 440), (350, 430), (420, 390)]
        np.testing.assert_allclose(network.shape(road), bend, atol=0.01)
        back = network.road_ids.index("ne-n")
        np.testing.assert_allclose(network.shape(back), bend[::-1], atol=0.01)

    def test_lanes_limits_and_lengths_are_sumos(self) -> None:
        network = instances.town()
        assert network.edge_lanes[network.edge_index["e-centre"]] == 2
        assert network.edge_lanes[network.edge_index["e-ne"]] == 1
        assert network.edge_limit_mps[network.edge_index["e-centre"]] == 16.67
        root = ET.parse(network.path).getroot()
        for edge in root.iter("edge"):
            if edge.get("function") is None:
                lane = edge.find("lane")
                assert lane is not None
                length = network.edge_length_m[network.edge_index[edge.attrib["id"]]]
                assert length == float(lane.attrib["length"])
        assert not any(name.startswith(":") for name in network.edge_ids)

    def test_nobody_turns_back_unless_at_a_dead_end(self) -> None:
        network = instances.town()
        for edge, name in enumerate(network.edge_ids):
            onward = [network.edge_ids[turn] for turn in network.turns(edge)]
            start, end = name.split("-")
            others = [e for e in network.edge_ids if e.split("-")[0] == end]
            others.remove(f"{end}-{start}")
            assert set(onward) == set(others or [f"{end}-{start}"])
            assert onward == sorted(onward)


NET = """<net version="1.20">
<edge id="ab" from="a" to="b"><lane id="ab_0" index="0" speed="9" length="90" shape="0,0 90,0"
 allow="pedestrian"/><lane id="ab_1" index="1" speed="14" length="90" shape="0,3 90,3"/></edge>
<edge id="bc" from="b" to="c"><lane id="bc_0" index="0" speed="9" length="90" shape="90,0 180,0"
 {bc}/></edge>
<edge id="bd" from="b" to="d"><lane id="bd_0" index="0" speed="9" length="90" shape="90,0 90,90"
 {bd}/></edge>
<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0"/>
<junction id="b" type="priority" x="90" y="0" incLanes="ab_1" intLanes="" shape="90,0"/>
<junction id="c" type="dead_end" x="180" y="0" incLanes="bc_0" intLanes="" shape="180,0"/>
<junction id="d" type="dead_end" x="90" y="90" incLanes="bd_0" intLanes="" shape="90,90"/>
<connection from="ab" to="bc" fromLane="0" toLane="0" dir="s" state="M"/>
<connection from="ab" to="bd" fromLane="0" toLane="0" dir="l" state="M"/>
<connection from="ab" to="bd" fromLane="1" toLane="0" dir="l" state="M"/>
</net>
"""


class TestPermissions:
    def test_ways_without_cars_are_left_out(self, tmp_path: Path) -> None:
        path = tmp_path / "walk.net.xml"
        path.write_text(NET.format(bc='allow="bicycle"', bd=""))
        network = read_net(path)
        assert network.edge_ids == ("ab", "bd")
        assert network.node_ids == ("a", "b", "d")
        assert network.edge_limit_mps[0] == 14  # the pavement's does not count
        assert list(network.edge_lanes) == [1, 1]
        assert [network.edge_ids[turn] for turn in network.turns(0)] == ["bd"]

    def test_turn_from_a_pavement_is_none(self, tmp_path: Path) -> None:
        path = tmp_path / "walk.net.xml"
        path.write_text(NET.format(bc="", bd=""))
        network = read_net(path)
        assert network.edge_ids == ("ab", "bc", "bd")
        assert [network.edge_ids[turn] for turn in network.turns(0)] == ["bd"]

    def test_net_without_roads_for_cars(self, tmp_path: Path) -> None:
        path = tmp_path / "paths.net.xml"
        walk = NET.format(bc='allow="bicycle"', bd='allow="bicycle"')
        path.write_text(walk.replace('index="1"', 'index="1" allow="bus"'))
        with pytest.raises(InputError, match=r"paths\.net\.xml: no edge for passenger cars"):
            read_net(path)

    def test_a_net_in_degrees_or_millimetres_is_none(self, tmp_path: Path) -> None:
        edges = (NETS / "figure3" / "figure3.edg.xml").read_text()
        (tmp_path / "f.edg.xml").write_text(edges)
        nodes = ET.parse(NETS / "figure3" / "figure3.nod.xml")
        for factor, said in ((1 / 111_000 / 20, "measures 0.0072. m.* degrees"), (1e4, "Earth")):
            for node in nodes.iter("node"):
                for axis in "xy":
                    node.set(axis, repr(float(node.get(axis, "0")) * factor))
            nodes.write(tmp_path / "f.nod.xml")
            with pytest.raises(InputError, match=rf"f\.edg\.xml: the whole net .*{said}"):
                open_network(section(nodes="f.nod.xml", edges="f.edg.xml"), tmp_path)
            nodes = ET.parse(NETS / "figure3" / "figure3.nod.xml")

    def test_source_without_roads_for_cars_is_named(self, tmp_path: Path) -> None:
        for end in ("nod", "edg"):
            text = (NETS / "figure3" / f"figure3.{end}.xml").read_text()
            (tmp_path / f"f.{end}.xml").write_text(
                text.replace("numLanes", 'allow="tram" numLanes')
            )
        with pytest.raises(InputError, match=r"f\.edg\.xml: no edge for passenger cars"):
            open_network(section(nodes="f.nod.xml", edges="f.edg.xml"), tmp_path)


def test_what_was_read_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path))
    first = shipped_net("figure3")

    def refuse(path: Path) -> None:
        raise AssertionError("parsed again")

    monkeypatch.setattr(read, "parse_net", refuse)
    second = shipped_net("figure3")
    for column in fields(RoadNetwork):
        one, other = getattr(first, column.name), getattr(second, column.name)
        np.testing.assert_array_equal(one, other)
        assert type(one) is type(other)
    assert second.sha256 == first.sha256


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 half a file", b"\x93NUMPY"])
def test_damaged_columns_are_read_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: bytes
) -> None:
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path))
    first = shipped_net("figure3")
    (kept,) = tmp_path.glob("nets/*.npz")
    kept.write_bytes(damage)
    assert shipped_net("figure3").edge_ids == first.edge_ids


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("<net><edge", "not a readable SUMO network"),
        ("no xml at all", "not a readable SUMO network"),
        ("<routes/>", "no edge for passenger cars"),
        ("<net/>", "not a readable SUMO network"),
        ('<net><edge id="a" from="x" to="y"><lane id="a_0"/></edge></net>', "not a readable"),
        ("", "not a readable SUMO network"),
    ],
)
def test_broken_nets_are_named(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "broken.net.xml"
    path.write_text(content)
    with pytest.raises(InputError, match=said) as caught:
        read_net(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_missing_net_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"absent\.net\.xml: cannot be read"):
        open_network(section(net="absent.net.xml"), tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        read_net(tmp_path)
    with pytest.raises(InputError, match="needs nodes and edges, or net, or osm"):
        open_network(section(nodes="only.nod.xml"), tmp_path)


def test_a_net_tells_its_projection(tmp_path: Path) -> None:
    assert shipped_net("grid5x5").projection is None
    path = shipped_net("grid5x5").path
    utm = "+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
    text = path.read_text()
    assert 'projParameter="!"' in text
    (tmp_path / "town.net.xml").write_text(text.replace('"!"', f'"{utm}"'))
    for _ in range(2):  # read, and kept
        read._network.cache_clear()
        assert read_net(tmp_path / "town.net.xml").projection == utm
    assert read_net(tmp_path / "town.net.xml").half_width_m.tolist() == [0.0] * 60


def test_a_quarter_of_bologna() -> None:
    network = read_net(data_file("bologna_acosta/acosta_buslanes.net.xml"))
    assert len(network.edge_ids) > 100
    assert (network.road_length_m > 0).all()
    assert network.projection is None or network.projection.startswith("+proj")
