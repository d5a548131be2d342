"""The documentation as a site: built without a warning, and complete; the tutorial as typed."""

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
TUTORIAL = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs", reason="MkDocs is not installed: [docs]")
    pytest.importorskip("mkdocstrings", reason="mkdocstrings is not installed: [docs]")
    folder = tmp_path_factory.mktemp("site")
    build = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "-f",
        "tools/mkdocs.yml",
        "--site-dir",
        str(folder),
    ]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


def hook() -> dict[str, Any]:
    pytest.importorskip("mkdocs", reason="MkDocs is not installed: [docs]")
    return runpy.run_path(str(ROOT / "tools" / "docs_site.py"))


@pytest.mark.slow
def test_every_page_is_in_the_menu(site: Path) -> None:
    menu = (ROOT / "tools" / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    for page in (ROOT / "docs").glob("*.md"):
        assert f": {page.name}\n" in f"{menu}\n", page.name
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    for page in (ROOT / "docs").glob("*.md"):
        assert page.name == "README.md" or f"({page.name})" in index, page.name
    assert (site / "index.html").is_file()
    assert (site / "files" / "sumo_nets" / "grid5x5" / "plan.png").is_file()


@pytest.mark.slow
def test_every_public_name_is_explained(site: Path) -> None:
    page = (site / "api.html").read_text(encoding="utf-8")
    names = [name for stage in hook()["public_names"]().values() for name in stage]
    assert len(names) > 50
    for name in names:
        assert f'id="{name}"' in page, name


@pytest.mark.long
def test_the_tutorial_works_as_typed(tmp_path: Path) -> None:
    typed = re.findall(r"```sh\n(.*?)```", TUTORIAL, re.DOTALL)
    (code,) = re.findall(r"```python\n(.*?)```", TUTORIAL, re.DOTALL)
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": programs, "PYTHONPATH": str(ROOT), "COLUMNS": "80"}

    def said(*command: str) -> str:
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return " ".join(done.stdout.split())

    out = said("sh", "-e", "-c", "\n".join(typed))
    for shown in re.findall(r"```text\n(.*?)```", TUTORIAL, re.DOTALL):
        for line in shown.splitlines():
            assert " ".join(line.split()) in out, line
    assert (tmp_path / "runs" / "berlin" / "page.html").is_file()
    assert (tmp_path / "runs" / "berlin" / "flight" / "flight.txt").is_file()
    assert re.search(r"rate: \d+ s, \d+\.\d% found", said(sys.executable, "-c", code))
