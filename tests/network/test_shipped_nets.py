"""The shipped sources: valid, exactly what the tool writes, found by name."""

import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from lxml import etree

from planner.files import shipped, shipped_names
from planner.network.sumo import sumo_home

ROOT = Path(__file__).parents[2]
SOURCES = sorted([*ROOT.glob("sumo_nets/*/*.xml"), *ROOT.glob("tests/nets/*/*.xml")])
KIND = {".nod": "nodes", ".edg": "edges", ".turns": "datamode"}
make_grid = runpy.run_path(str(ROOT / "tools" / "make_grid.py"))["main"]


def schema(kind: str) -> etree.XMLSchema:
    return etree.XMLSchema(file=str(sumo_home() / "data" / "xsd" / f"{kind}_file.xsd"))


def valid(path: Path) -> bool:
    kind = KIND[Path(path.stem).suffix]
    checker = schema(kind)
    tree = etree.parse(str(path))
    (location,) = tree.getroot().attrib.values()
    assert location == f"http://sumo.dlr.de/xsd/{kind}_file.xsd"
    assert checker.validate(tree), checker.error_log
    return True


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_sources_are_valid_for_sumo(path: Path) -> None:
    assert valid(path)


def test_grid_is_exactly_what_the_tool_writes(tmp_path: Path) -> None:
    make_grid([str(tmp_path / "grid5x5")])
    for name in ("grid5x5.nod.xml", "grid5x5.edg.xml"):
        shipped_bytes = (ROOT / "sumo_nets" / "grid5x5" / name).read_bytes()
        assert (tmp_path / "grid5x5" / name).read_bytes() == shipped_bytes


def test_tool_writes_any_size(tmp_path: Path) -> None:
    wanted = ["--rows", "2", "--columns", "3", "--road-m", "250.5", "--speed-mps", "30"]
    make_grid([str(tmp_path / "g"), *wanted])
    assert valid(tmp_path / "g" / "g.nod.xml")
    assert valid(tmp_path / "g" / "g.edg.xml")
    nodes = etree.parse(str(tmp_path / "g" / "g.nod.xml")).getroot()
    corner = nodes.find("node[@id='r1c2']")
    assert (corner.get("x"), corner.get("y")) == ("501", "-250.5")
    edges = etree.parse(str(tmp_path / "g" / "g.edg.xml")).getroot()
    assert len(edges) == 2 * 2 + 3
    assert {edge.get("speed") for edge in edges} == {"30"}


@pytest.mark.parametrize(
    "wrong", [["--rows", "0"], ["--rows", "1", "--columns", "1"], ["--road-m", "-5"]]
)
def test_tool_refuses_what_is_no_grid(tmp_path: Path, wrong: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        make_grid([str(tmp_path / "g"), *wrong])
    assert caught.value.code == 2
    assert not (tmp_path / "g").exists()


def test_tool_explains_itself() -> None:
    tool = [sys.executable, str(ROOT / "tools" / "make_grid.py"), "--help"]
    said = subprocess.run(tool, capture_output=True, text=True, check=True).stdout
    for taught in ("--road-m", "r<row>c<column>", "example: python tools/make_grid.py"):
        assert taught in said


def test_scenarios_are_found_by_name() -> None:
    folder = shipped("grid5x5")
    assert folder is not None
    assert (folder / "scenario.toml").is_file()
    assert {"figure1", "figure3", "figure3-gone", "grid5x5"} <= set(shipped_names())
    assert [shipped(name) for name in ("nowhere", "", ".", "..", "grid5x5/..")] == [None] * 5
