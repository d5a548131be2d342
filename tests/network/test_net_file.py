"""Any file that a net stands behind, and whose data it is."""

import gzip
from pathlib import Path

import pytest

from planner.errors import InputError
from planner.network.build import import_osm
from planner.network.net_file import credit_in, is_net_file, net_behind
from planner.network.read import open_network, read_net
from planner.network.street_names import crossing, road_phrase
from planner.network.sumo import sumo_file
from planner.scenario.sections import OF_OSM, NetworkSection
from support.instances import town

OSM = """<osm version="0.6">
<node id="1" lat="49.600" lon="6.100"/><node id="2" lat="49.602" lon="6.100"/>
<node id="3" lat="49.604" lon="6.100"/><node id="4" lat="49.602" lon="6.104"/>
<way id="7"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="highway" v="residential"/>
<tag k="name" v="Rue d'Épernay"/></way>
<way id="8"><nd ref="2"/><nd ref="4"/><tag k="highway" v="residential"/>
<tag k="name" v="Rue B"/></way>
</osm>
"""


def opened(path: Path) -> tuple[str, ...]:
    return open_network(NetworkSection(net=path.name), path.parent).edge_ids


@pytest.mark.parametrize(
    "text",
    [
        '<configuration><input><net-file value="{}"/></input></configuration>',
        '<sumoConfiguration><net value="{}"/></sumoConfiguration>',
        '<?xml version="1.0"?>\n<configuration><input><n v="{}"/></input></configuration>',
    ],
)
def test_a_configuration_stands_for_its_net(tmp_path: Path, text: str) -> None:
    (tmp_path / "nets").mkdir()
    (tmp_path / "nets" / "town.net.xml").write_bytes(town().path.read_bytes())
    (tmp_path / "town.sumocfg").write_text(text.format("nets/town.net.xml"))
    assert net_behind(tmp_path / "town.sumocfg") == tmp_path / "nets" / "town.net.xml"
    assert opened(tmp_path / "town.sumocfg") == town().edge_ids


def test_a_packed_net_is_one(tmp_path: Path) -> None:
    packed = tmp_path / "town.net.xml.gz"
    packed.write_bytes(gzip.compress(town().path.read_bytes()))
    assert opened(packed) == town().edge_ids
    (tmp_path / "a.sumocfg").write_text(
        '<configuration><net-file value="town.net.xml.gz"/></configuration>'
    )
    assert opened(tmp_path / "a.sumocfg") == town().edge_ids


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            '<configuration><net-file value="no.net.xml"/></configuration>',
            "there is no file .*no.net",
        ),
        ("<configuration><net-file/></configuration>", "there is no file"),
        ("<configuration><input/></configuration>", "names no net; give it a <net-file"),
        (
            '<configuration><net-file value="a.net.xml, b.net.xml"/></configuration>',
            r"names 2 nets \(a.net.xml, b.net.xml\); leave one",
        ),
        (
            '<configuration><net-file value="a.net.xml"/><n value="b.net.xml"/></configuration>',
            r"names 2 nets \(a.net.xml, b.net.xml\); leave one",
        ),
    ],
)
def test_a_configuration_without_its_net_is_refused(tmp_path: Path, text: str, fault: str) -> None:
    (tmp_path / "a.sumocfg").write_text(text)
    with pytest.raises(InputError, match=fault):
        opened(tmp_path / "a.sumocfg")


def test_an_extract_without_roads_is_refused(empty_cache: Path, tmp_path: Path) -> None:
    osm = tmp_path / "field.osm"
    osm.write_text('<osm version="0.6"><node id="1" lat="49.6" lon="6.1" version="1"/></osm>')
    with pytest.raises(InputError, match=r"field.osm: netconvert .* loaded; export an area"):
        import_osm(osm)
    assert list(empty_cache.rglob("*.xml")) == []


def test_an_extract_may_stand_where_a_net_may(tmp_path: Path) -> None:
    osm = tmp_path / "town.osm.xml"
    osm.write_text(OSM, encoding="utf-8")
    network = open_network(NetworkSection(net="town.osm.xml"), tmp_path)
    assert network.path == import_osm(osm)
    assert network.given_as == osm
    assert network.attribution == OF_OSM
    assert network.projection is not None
    assert set(network.edge_street) == {"Rue d'Épernay", "Rue B"}
    middle = [crossing(network, node) for node in range(len(network.node_ids))]
    assert "Rue d'Épernay / Rue B" in middle
    road = network.edge_street.index("Rue B")
    assert "Rue d'Épernay" in road_phrase(network, 2 * int(network.edge_road[road]))


def test_what_is_made_of_openstreetmap_says_so_wherever_it_is_copied_to(tmp_path: Path) -> None:
    osm = tmp_path / "town.osm"
    osm.write_text(OSM, encoding="utf-8")
    copy = tmp_path / "elsewhere.net.xml"
    copy.write_bytes(import_osm(osm).read_bytes())
    assert read_net(copy).attribution == OF_OSM
    assert read_net(copy, attribution="Town of A").attribution == "Town of A"
    assert credit_in(sumo_file("tools/game/DRT/osm.net.xml")) == OF_OSM  # as netconvert says it
    assert credit_in(town().path) == ""


def test_files_that_are_nets(tmp_path: Path) -> None:
    for name, text in {
        "a.net.xml": "<net/>",
        "a.osm": "<osm/>",
        "a.sumocfg": "<sumoConfiguration/>",
    }.items():
        (tmp_path / name).write_text(text)
        assert is_net_file(tmp_path / name)
    (tmp_path / "scenario.toml").write_text("title = 'x'")
    (tmp_path / "a.rou.xml").write_text("<routes/>")
    for other in ("scenario.toml", "a.rou.xml", "absent", ""):
        assert not is_net_file(tmp_path / other)
