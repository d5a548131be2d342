"""The flow reads off the folder list: a stage imports only stages to its left."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

STAGES = (
    "scenario",
    "network",
    "belief",
    "futures",
    "flight",
    "detection",
    "search",
    "bounds",
    "mission",
    "export",
    "experiments",
    "report",
    "paper",
)
DOORS = ("__init__.py", "__main__.py")  # may import any stage, as all below cli/ may
ROOT = Path(__file__).parents[1] / "planner"
LOOSE = {path.stem for path in ROOT.glob("*.py") if path.name not in DOORS}


def imported(source: str, package: str) -> Iterator[str]:
    """Yield the full name of all that a file imports, in functions too."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1]
            base = ".".join([*above, *filter(None, [node.module])]) if node.level else node.module
            yield from (f"{base}.{name.name}" for name in node.names)


def may_import(file: str, name: str) -> bool:
    """Tell whether a file, named from the package's folder, may import a name."""
    *folders, _ = file.split("/")
    top, *rest = name.split(".")
    if top == "libsumo" or top == "traci":
        return folders == ["futures"]
    if top == "sumolib":
        return folders == ["network"]
    if top == "pydantic":
        return folders == ["scenario"]
    if top == "numba":
        return file == "jit.py"
    if top != "planner" or file in DOORS or folders == ["cli"]:
        return True
    if rest[:1] == ["jit"]:
        return folders[-1:] == ["kernels"]
    if not rest or rest[0] not in STAGES:
        return rest[:1] != [] and rest[0] in LOOSE  # not the public names, which know all stages
    return (
        folders[:1] != []
        and folders[0] in STAGES
        and STAGES.index(rest[0]) <= STAGES.index(folders[0])
    )


def violations(file: str, source: str) -> list[str]:
    package = ".".join(["planner", *file.split("/")[:-1]])
    return [name for name in imported(source, package) if not may_import(file, name)]


def source_files() -> list[str]:
    return sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.py"))


@pytest.mark.parametrize("file", source_files())
def test_imports_go_left(file: str) -> None:
    assert violations(file, (ROOT / file).read_text()) == []


def test_folders_are_stages() -> None:
    folders = {file.rsplit("/", 1)[0] for file in source_files() if "/" in file}
    assert folders <= {"cli", *STAGES, *(f"{stage}/kernels" for stage in STAGES)}


@pytest.mark.parametrize(
    ("file", "source"),
    [
        ("network/read.py", "from planner.futures.futures import Futures"),
        ("network/read.py", "import planner.belief"),
        ("network/read.py", "from planner import report"),
        ("detection/first.py", "def f():\n    from planner.search.plan import Plan"),
        ("detection/first.py", "from ..search import plan"),
        ("detection/first.py", "from ..search.plan import Plan"),
        ("streams.py", "from planner.network.road_network import RoadNetwork"),
        ("streams.py", "from .network import road_network"),
        ("search/greedy.py", "import numba"),
        ("search/kernels/beam.py", "from numba import njit"),
        ("search/greedy.py", "from planner.jit import compiled"),
        ("search/greedy.py", "from planner import jit"),
        ("search/greedy.py", "import libsumo"),
        ("search/greedy.py", "from planner import fly"),
        ("search/greedy.py", "import planner"),
        ("report/doctor.py", "def f():\n    import libsumo.constants"),
        ("futures/record.py", "import sumolib.net"),
        ("network/check.py", "from pydantic import BaseModel"),
    ],
)
def test_a_violation_is_seen(file: str, source: str) -> None:
    assert len(violations(file, source)) == 1


@pytest.mark.parametrize(
    ("file", "source"),
    [
        ("report/picture.py", "from planner.network.road_network import RoadNetwork"),
        ("search/greedy.py", "from planner.search import kernels"),
        ("search/kernels/exact.py", "from planner.jit import compiled"),
        ("jit.py", "import numba"),
        ("futures/record.py", "import libsumo"),
        ("network/read.py", "import sumolib\nfrom planner.errors import InputError"),
        ("scenario/sections.py", "import pydantic"),
        ("cli/plan.py", "from planner.report import tables"),
        ("detection/first.py", "from .track import Track\nfrom . import kernels"),
    ],
)
def test_what_is_allowed_passes(file: str, source: str) -> None:
    assert violations(file, source) == []
