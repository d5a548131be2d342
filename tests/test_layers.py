"""The flow reads off the folder list: a stage imports only stages to its left, and no circles."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import networkx as nx
import pytest

STAGES = (
    "scenario",
    "network",
    "belief",
    "futures",
    "flight",
    "telemetry",
    "detection",
    "search",
    "bounds",
    "mission",
    "export",
    "experiments",
    "report",
    "page",
    "paper",
)
DOORS = ("__init__.py", "__main__.py")  # may import any stage, as all below cli/ may
ROOT = Path(__file__).parents[1] / "planner"
LAZY = ("__init__.py", "__main__.py", "search/methods.py")  # import when called, as cli/ may
WORKER = ("futures/worker.py", "futures/riders.py")  # what a process that runs SUMO begins with
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
    if top == "libsumo":
        return folders == ["futures"]
    if top == "traci":
        return file == "export/gui_window.py"
    if top == "sumolib":
        return folders == ["network"]
    if top == "pandas":
        return False  # half a second to load, and csv and pyarrow do what is needed
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


def package_of(file: str) -> str:
    return ".".join(["planner", *file.split("/")[:-1]])


def violations(file: str, source: str) -> list[str]:
    return [name for name in imported(source, package_of(file)) if not may_import(file, name)]


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
        ("futures/record.py", "import traci"),
        ("search/greedy.py", "from planner import fly"),
        ("search/greedy.py", "import planner"),
        ("report/doctor.py", "def f():\n    import libsumo.constants"),
        ("futures/record.py", "import sumolib.net"),
        ("network/check.py", "from pydantic import BaseModel"),
        ("report/tables.py", "def f():\n    import pandas"),
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
        ("export/gui_window.py", "def f():\n    import traci"),
        ("network/read.py", "import sumolib\nfrom planner.errors import InputError"),
        ("scenario/sections.py", "import pydantic"),
        ("cli/plan.py", "from planner.report import tables"),
        ("detection/first.py", "from .track import Track\nfrom . import kernels"),
    ],
)
def test_what_is_allowed_passes(file: str, source: str) -> None:
    assert violations(file, source) == []


# Circles


def file_of(name: str, files: Iterable[str]) -> str | None:
    """Return the file in which an imported name is, or None if it is not the package's own."""
    parts = name.split(".")[1:] if name.split(".")[0] == "planner" else []
    while parts:
        path = "/".join(parts)
        for file in (f"{path}.py", f"{path}/__init__.py"):
            if file in files:
                return file
        parts.pop()
    return None


def import_graph(sources: Mapping[str, str]) -> nx.DiGraph:
    """Return which file imports which, in functions too."""
    graph = nx.DiGraph()
    graph.add_nodes_from(sources)
    for file, source in sources.items():
        names = imported(source, package_of(file))
        graph.add_edges_from((file, home) for n in names if (home := file_of(n, sources)))
    return graph


def circles(sources: Mapping[str, str]) -> list[set[str]]:
    graph = import_graph(sources)
    return [files for files in nx.strongly_connected_components(graph) if len(files) > 1]


def all_sources() -> dict[str, str]:
    return {file: (ROOT / file).read_text() for file in source_files()}


def test_no_files_import_each_other() -> None:
    assert circles(all_sources()) == []


def test_a_circle_is_seen() -> None:
    sources = {
        "a.py": "from planner.b import c",
        "b/__init__.py": "",
        "b/c.py": "from . import d",
        "b/d.py": "def f():\n    import planner.a",
        "b/e.py": "from planner.b import c, nosuch",
    }
    assert circles(sources) == [{"a.py", "b/c.py", "b/d.py"}]


# Imports in functions


def late_imports(file: str, source: str) -> list[str]:
    """Return the package's own names that are imported in functions, where they should not be."""
    if file in LAZY or file.startswith("cli/"):
        return []
    functions = [
        node
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    names = {name for node in functions for name in imported(ast.unparse(node), package_of(file))}
    return sorted(name for name in names if name.split(".")[0] == "planner")


@pytest.mark.parametrize("file", source_files())
def test_own_imports_stand_at_the_top(file: str) -> None:
    assert late_imports(file, (ROOT / file).read_text()) == []


def test_a_late_import_is_seen() -> None:
    source = "class C:\n    def f(self):\n        from .b import d\n        import numpy"
    assert late_imports("search/greedy.py", source) == ["planner.search.b.d"]
    assert late_imports("cli/plan.py", source) == []
    assert late_imports("search/greedy.py", "from planner.search import b") == []


# What a process that runs SUMO loads


def test_a_sumo_worker_needs_no_compiled_code() -> None:
    graph = import_graph(all_sources())
    needed = set(WORKER).union(*(nx.descendants(graph, file) for file in WORKER))
    assert {file for file in needed if "/kernels/" in file} | needed & {"jit.py"} == set()


def test_a_sumo_worker_loads_no_heavy_library() -> None:
    modules = [f"planner.{file.removesuffix('.py').replace('/', '.')}" for file in WORKER]
    code = f"import sys, {', '.join(modules)}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert loaded & {"numba", "numpy", "pyarrow", "pandas", "scipy", "pydantic"} == set()


# Who reads files that others wrote

PARSERS = re.compile(
    r"json\.loads?\(|tomllib|iterparse|ElementTree\.(parse|fromstring)|expat|make_parser|minidom"
)
READERS = ("guard.py", "xml_guard.py", "network/sumo.py", "npz.py")  # the last one: its own copies


@pytest.mark.parametrize("file", source_files())
def test_foreign_files_pass_the_guard(file: str) -> None:
    found = PARSERS.findall((ROOT / file).read_text(encoding="utf-8"))
    assert file in READERS or not found
