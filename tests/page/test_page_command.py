"""`planner page`, and the page that `planner plan` writes."""

import re
from argparse import ArgumentTypeError
from pathlib import Path

import pytest

from planner.cli.page import _methods
from support.command_line import Commands


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


def test_a_plan_comes_with_its_page(run: Commands, tmp_path: Path) -> None:
    folder, other = tmp_path / "run", tmp_path / "other.html"
    planned = run("plan", "figure1", "--method", "exhaustive", "--targets", "50", "-o", folder)
    assert planned.code == 0, planned.err
    first = (folder / "page.html").read_bytes()
    assert b"best-crossing" in first
    assert run("page", folder, "--json").json == {"page": str(folder / "page.html")}
    assert (folder / "page.html").read_bytes() == first
    more = run("page", folder, "--compare", "wait,exact", "-o", other)
    assert more.code == 0, more.err
    assert len(re.findall('scope="row"', other.read_text(encoding="utf-8"))) in (3, 4)
    again = run("page", folder, "-o", other)
    assert again.code == 2
    assert "--force" in again.err
    assert run("page", folder, "--compare", "none", "-o", other, "--force").code == 0
    assert "best-crossing" not in other.read_text(encoding="utf-8")


def test_faults_are_told(run: Commands, tmp_path: Path) -> None:
    nothing = run("page", tmp_path)
    assert nothing.code == 2
    assert "holds no run" in nothing.err
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ArgumentTypeError, match=r"should be some of best, .*, or none"):
        _methods("wait,nosuch")
