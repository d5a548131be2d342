"""Nets from sources: built once, the same bytes, plain words when something is wrong."""

import gzip
import shutil
import subprocess
from pathlib import Path

import pytest

from planner.errors import InputError, OutputError, SumoError
from planner.network import build
from planner.network.build import build_net, import_osm
from planner.network.sumo import binary, netconvert, sumo_environment, sumo_home, sumo_version

NETS = Path(__file__).parents[2] / "sumo_nets"
OSM = """<osm version="0.6">
<node id="1" lat="49.60" lon="6.10"/><node id="2" lat="49.60" lon="6.11"/>
<node id="3" lat="49.61" lon="6.11"/><node id="4" lat="49.60" lon="6.12"/>
<way id="7"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="highway" v="primary"/></way>
<way id="9"><nd ref="2"/><nd ref="4"/><tag k="highway" v="primary"/></way>
<way id="8"><nd ref="1"/><nd ref="3"/><tag k="highway" v="footway"/></way>
</osm>
"""


@pytest.fixture
def sources(tmp_path: Path) -> tuple[Path, Path]:
    for end in ("nod", "edg"):
        shutil.copy(NETS / "figure3" / f"figure3.{end}.xml", tmp_path)
    return tmp_path / "figure3.nod.xml", tmp_path / "figure3.edg.xml"


def test_second_call_takes_no_netconvert(
    empty_cache: Path, sources: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = build_net(*sources)

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("netconvert was called again")

    monkeypatch.setattr(build, "netconvert", refuse)
    assert build_net(*sources) == first
    assert list(first.parent.iterdir()) == [first]  # nothing half-written stays


def test_names_that_sumo_refuses_are_told_together(sources: tuple[Path, Path]) -> None:
    nodes, edges = sources
    for file, old, new in (
        (nodes, '"A"', '"A 1"'),
        (edges, '"A"', '"A 1"'),
        (edges, '"AB"', '"A to B"'),
        (edges, '"CE"', '"C;E"'),
    ):
        file.write_text(file.read_text().replace(old, new))
    with pytest.raises(InputError) as caught:
        build_net(*sources)
    assert str(caught.value) == (
        f'{nodes}: node "A 1", {edges}: edge "A to B", edge "C;E": '
        "SUMO takes no name with a space or any of | \\ ; , '; rename them"
    )


def test_other_refusals_stay_netconvert_s(sources: tuple[Path, Path]) -> None:
    sources[1].write_text(sources[1].read_text().replace('to="B"', 'to="nowhere"'))
    with pytest.raises(InputError, match=r"netconvert refuses it: .*nowhere"):
        build_net(*sources)


def test_same_sources_elsewhere_give_the_same_bytes(
    tmp_path: Path, sources: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    nets = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        moved = [shutil.copy(path, tmp_path / name) for path in sources]
        monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / name / "cache"))
        nets.append(build_net(Path(moved[0]), Path(moved[1])))
    assert nets[0].name == nets[1].name
    content = nets[0].read_bytes()
    assert content == nets[1].read_bytes()
    assert b"<!--" not in content
    assert str(tmp_path).encode() not in content


def test_content_and_options_name_the_net(empty_cache: Path, sources: tuple[Path, Path]) -> None:
    abstract, streets = build_net(*sources), build_net(*sources, abstract=False)
    sources[1].write_text(sources[1].read_text().replace("55.55", "44.44"))
    assert len({abstract, streets, build_net(*sources)}) == 3


def test_signals_and_connections_are_used(empty_cache: Path, tmp_path: Path) -> None:
    head = '<{0} xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">'
    town = Path(__file__).parents[1] / "nets" / "town"
    connections = tmp_path / "town.con.xml"
    connections.write_text('<connections><delete from="e-se" to="se-quay"/></connections>')
    sources = (town / "town.nod.xml", town / "town.edg.xml")
    plain = build_net(*sources, abstract=False).read_text()
    changed = build_net(*sources, connections=connections, abstract=False).read_text()
    wanted = 'from="e-se" to="se-quay"'
    assert wanted in plain
    assert wanted not in changed
    signals = tmp_path / "town.tll.xml"
    phases = '<phase duration="77" state="{}"/>'.format("G" * plain.count('tl="centre"'))
    signals.write_text(
        head.format("tlLogics")
        + f'<tlLogic id="centre" programID="0" type="static" offset="0">{phases}</tlLogic>'
        + "</tlLogics>"
    )
    assert 'duration="77"' in build_net(*sources, signals=signals, abstract=False).read_text()


def test_osm_keeps_the_roads_for_cars(empty_cache: Path, tmp_path: Path) -> None:
    plain, packed = tmp_path / "a.osm", tmp_path / "a.osm.gz"
    plain.write_text(OSM)
    packed.write_bytes(gzip.compress(OSM.encode()))
    nets = [import_osm(path).read_text() for path in (plain, packed)]
    assert nets[0] == nets[1]
    assert '<edge id="7' in nets[0]
    assert '<edge id="8' not in nets[0]


def test_missing_source_is_named(
    empty_cache: Path, tmp_path: Path, sources: tuple[Path, Path]
) -> None:
    with pytest.raises(InputError, match=r"absent\.edg\.xml: cannot be read .*correct the path"):
        build_net(sources[0], tmp_path / "absent.edg.xml")
    assert not empty_cache.exists()


def test_many_messages_are_cut(empty_cache: Path, sources: tuple[Path, Path]) -> None:
    sources[0].write_text("<nodes></nodes>")
    with pytest.raises(InputError, match=r"'A' is not known.*\(and \d+ more\)$"):
        build_net(*sources)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('<edges><edge id="XY" from="X" to="B"/></edges>', "node 'X' is not known"),
        ("<edges><edge id=", "XML|xml|expected|unterminated"),
        ("", "netconvert refuses it"),
    ],
)
def test_netconvert_tells_what_is_wrong(
    empty_cache: Path, sources: tuple[Path, Path], text: str, said: str
) -> None:
    sources[1].write_text(text)
    with pytest.raises(InputError, match=said) as caught:
        build_net(*sources)
    message = str(caught.value)
    assert "figure3.edg.xml" in message
    assert "\n" not in message
    assert list(empty_cache.rglob("*.xml")) == []


def test_unwritable_cache_is_named(
    sources: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / "file"))
    with pytest.raises(OutputError, match="cannot be written"):
        build_net(*sources)


def test_sumo_is_found_without_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUMO_HOME", "/nowhere")
    sumo_environment()
    said = subprocess.run([str(binary("sumo")), "--version"], capture_output=True, text=True)
    assert f"sumo {sumo_version()}" in said.stdout
    assert (sumo_home() / "data" / "xsd" / "net_file.xsd").is_file()
    with pytest.raises(SumoError, match="is missing"):
        binary("no-such-program")


def test_netconvert_that_dies_is_a_sumo_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "netconvert"
    program.write_text("#!/bin/sh\nkill -9 $$\n")
    program.chmod(0o755)
    monkeypatch.setattr("planner.network.sumo.binary", lambda _: program)
    with pytest.raises(SumoError, match="signal 9 on the town"):
        netconvert([], subject="the town")
    program.chmod(0o644)
    with pytest.raises(SumoError, match="cannot be run"):
        netconvert([], subject="the town")
