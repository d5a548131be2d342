"""Files from strangers: they read no other file, and nothing in them takes all memory."""

import gzip
import re
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from planner.errors import InputError
from planner.guard import opened, parsed_json, parsed_toml, read_json, read_text, read_toml
from planner.messages import plain
from planner.network.build import build_net
from planner.network.read import read_net
from planner.xml_guard import elements_in, kind_of_xml, xml_elements

LAUGHS = '<!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;&b;&b;">]><a>&c;</a>'
NODES = '<nodes><node id="a" x="0" y="0"/><node id="b" x="900" y="0"/>{}</nodes>'
EDGES = '<edges><edge id="ab" from="a" to="b" numLanes="1" speed="9"/></edges>'


def refusal(read: object, path: Path) -> str:
    with pytest.raises(InputError) as raised:
        list(read(path))  # type: ignore[operator]
    assert "\n" not in str(raised.value)
    return str(raised.value)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(
    "text", [LAUGHS, '<!DOCTYPE a SYSTEM "file:///etc/hostname"><a/>', "<!DOCTYPE a><a/>"]
)
def test_no_document_type(tmp_path: Path, text: str, packed: bool) -> None:
    path = tmp_path / "a.xml"
    path.write_bytes(gzip.compress(text.encode()) if packed else text.encode())
    assert "document type" in refusal(xml_elements, path)
    assert "document type" in str(refusal(lambda file: [read_net(file)], path))
    if not packed:
        (tmp_path / "e.xml").write_text(EDGES)
        with pytest.raises(InputError, match="document type"):
            build_net(path, tmp_path / "e.xml")


@pytest.mark.parametrize("encoding", ["big5", "rot13", "utf-7", "idna", "nosuch", "hex"])
def test_encodings_that_sumo_does_not_write(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "a.xml"
    path.write_text(f'<?xml version="1.0" encoding="{encoding}"?><a/>')
    assert f"its encoding is {encoding}" in refusal(xml_elements, path)


def test_a_bomb_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "a.net.xml.gz"
    with gzip.open(path, "wb") as file:
        file.write(b"<net>")
        for _ in range(130):
            file.write(bytes(1 << 20).replace(b"\0", b" "))
    assert "holds more than" in refusal(xml_elements, path)


@pytest.mark.parametrize("read", [xml_elements, lambda path: elements_in(path, re.compile(b"<a "))])
def test_a_comment_without_end_takes_no_longer_than_its_length(
    tmp_path: Path, read: Callable[[Path], Iterable[object]]
) -> None:
    path = tmp_path / "a.xml"
    path.write_bytes(b"<b><a /><!--" + b"x" * (24 << 20))
    begins_s = time.process_time()
    assert "is not XML" in refusal(read, path)
    assert time.process_time() - begins_s < 3.0  # with each 16 kB read anew, half a minute


def test_a_file_that_is_too_large_is_not_begun(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    path.write_text("no XML")
    assert "holds more than" in refusal(lambda file: xml_elements(file, largest=5), path)


def test_a_cut_gzip_file(tmp_path: Path) -> None:
    path = tmp_path / "a.xml.gz"
    path.write_bytes(gzip.compress(b"<a>" + bytes(range(32, 60)) * 99)[:40])
    refusal(xml_elements, path)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a = " + "[" * 5000, "nests deeper"),
        ("a = " + "[" * 200 + "]" * 200, "nests deeper"),
        (".".join("a" * 30000) + " = 1", "more than 100 parts"),
        ("a = " + "1" * 5000, "number that is too large"),
        ("a = 0x" + "f" * 50, "number that is too large"),
        ("a = 9223372036854775808", "number that is too large"),
    ],
)
def test_toml_within_limits(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        parsed_toml(text)
    (tmp_path / "a.toml").write_text(text)
    assert why in refusal(read_toml, tmp_path / "a.toml")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a": ' * 300 + "1" + "}" * 300, "9" * 5000])
def test_json_within_limits(tmp_path: Path, text: str) -> None:
    with pytest.raises(ValueError, match=r"nests deeper|too large"):
        parsed_json(text)
    (tmp_path / "a.json").write_text(text)
    refusal(read_json, tmp_path / "a.json")


def test_a_byte_order_mark_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_bytes(b"\xef\xbb\xbfa = 9223372036854775807")
    assert read_toml(tmp_path / "a.toml") == {"a": 2**63 - 1}
    (tmp_path / "a.json").write_bytes(b'\xef\xbb\xbf{"a": 1}')
    assert read_json(tmp_path / "a.json") == {"a": 1}
    (tmp_path / "a.xml").write_bytes(b"\xef\xbb\xbf<net/>")
    assert [element.tag for element in xml_elements(tmp_path / "a.xml")] == ["net"]
    assert kind_of_xml(tmp_path / "a.xml") == "net"
    assert kind_of_xml(tmp_path / "a.toml") is None


def test_only_plain_files_are_read(tmp_path: Path) -> None:
    assert "cannot be read" in refusal(read_text, tmp_path)
    assert "no plain file" in refusal(read_text, Path("/dev/null"))
    assert "NUL" in refusal(read_text, Path("a\0b"))
    (tmp_path / "a").write_text("12345")
    with pytest.raises(InputError, match="holds more than"):
        read_text(tmp_path / "a", 4)
    with opened(tmp_path / "a") as file:
        assert file.read() == b"12345"


class TestIncludes:
    def test_below_the_folder_they_are_read_and_count(self, tmp_path: Path) -> None:
        folder = tmp_path / "a, b ${HOME} ä"
        (folder / "parts").mkdir(parents=True)
        (folder / "parts" / "more.xml").write_text('<nodes><node id="c" x="0" y="9"/></nodes>')
        (folder / "n.nod.xml").write_text(NODES.format('<include href="parts/more.xml"/>'))
        edges = EDGES.replace(
            "</edges>",
            EDGES[7:-8].replace("ab", "bc").replace('from="a" to="b"', 'from="b" to="c"')
            + "</edges>",
        )
        (folder / "e.edg.xml").write_text(edges)
        net = build_net(folder / "n.nod.xml", folder / "e.edg.xml", folder=folder)
        network = read_net(net)
        assert network.node_xy_m[network.node_index["c"]].tolist() == [0, 9]
        (folder / "parts" / "more.xml").write_text('<nodes><node id="c" x="0" y="99"/></nodes>')
        again = read_net(build_net(folder / "n.nod.xml", folder / "e.edg.xml", folder=folder))
        assert again.node_xy_m[again.node_index["c"]].tolist() == [0, 99]

    @pytest.mark.parametrize("href", ["../secret.xml", "{}/secret.xml", "link.xml"])
    def test_from_elsewhere_they_are_refused(self, tmp_path: Path, href: str) -> None:
        (tmp_path / "secret.xml").write_text("<nodes/>")
        folder = tmp_path / "scenario"
        folder.mkdir()
        (folder / "link.xml").symlink_to(tmp_path / "secret.xml")
        include = f'<include href="{href.format(tmp_path)}"/>'
        (folder / "n.nod.xml").write_text(NODES.format(include))
        (folder / "e.edg.xml").write_text(EDGES)
        with pytest.raises(InputError, match="not below"):
            build_net(folder / "n.nod.xml", folder / "e.edg.xml", folder=folder)

    @pytest.mark.parametrize(
        "foreign", ['<include href="x.xml"/>', '<e1Detector file="/tmp/x" id="1" lane="ab_0"/>']
    )
    def test_a_net_holds_nothing_but_a_net(self, tmp_path: Path, foreign: str) -> None:
        (tmp_path / "n.nod.xml").write_text(NODES.format(""))
        (tmp_path / "e.edg.xml").write_text(EDGES)
        text = build_net(tmp_path / "n.nod.xml", tmp_path / "e.edg.xml").read_text()
        net = tmp_path / "n.net.xml"
        net.write_text(text.replace("</net>", f"<!-- {foreign} --></net>"))
        assert read_net(net).edge_ids == ("ab",)
        net.write_text(text.replace("</net>", f"{foreign}</net>"))
        with pytest.raises(InputError, match="no part of a net"):
            read_net(net)


def test_what_a_terminal_obeys_is_shown() -> None:
    assert plain("a\x1b[31m\n\x9b\u202eb\udcff") == "a\\x1b[31m\\n\\x9b\\u202eb\\udcff"
    assert plain("Straße 東京 [x] \\") == "Straße 東京 [x] \\"
    assert str(InputError("a\nb\x1b")) == "a b\\x1b"
