"""The public names: one list, which type checkers and the running package both read."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import planner

PACKAGE = Path(planner.__file__).parent
LISTED = {
    alias.name: f"planner.{node.module}"
    for node in ast.parse((PACKAGE / "__init__.pyi").read_text()).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
# What a planner is written with; see CONTRIBUTING.md.
FOR_PLANNERS = {
    "Budget",
    "Legs",
    "Objective",
    "Plan",
    "Problem",
    "SearchResult",
    "SearchState",
    "WhatIf",
    "candidate_legs",
    "plan_of_legs",
}


def python(code: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_all_is_the_stub_s_list_sorted() -> None:
    assert planner.__all__ == sorted(LISTED)
    assert dir(planner) == planner.__all__
    assert set(LISTED) >= FOR_PLANNERS


@pytest.mark.parametrize("name", LISTED)
def test_every_public_name_can_be_imported(name: str) -> None:
    assert getattr(planner, name) is getattr(sys.modules[LISTED[name]], name)


def test_names_are_listed_only_once() -> None:
    """The package's own code names none of them again."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    strings = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert not LISTED.keys() & (strings | names)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        planner.no_such_name  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(ImportError):
        exec("from planner import no_such_name")


def test_nothing_is_loaded_before_it_is_used() -> None:
    loaded = python(
        "import sys, planner; planner.stream;"
        "print(*sorted(set(sys.modules) & {'numba', 'pandas', 'scipy', 'matplotlib', 'libsumo',"
        "'networkx', 'planner.search.problem', 'planner.mission.opening'}))"
    )
    assert loaded == ""


def test_all_names_load_together() -> None:
    assert python("import planner; dir(planner); print('loaded')", EAGER_IMPORT="1") == "loaded"
