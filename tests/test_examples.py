"""The example scripts, and the code in README and docs, run as they stand."""

import csv
import os
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.cli import parser_for
from planner.mission.aircraft import FASTEST_MPS
from planner.scenario.draft import read_draft
from planner.scenario.sections import SECTIONS
from planner.search.contract import BUDGET, breaches, cost_s
from planner.search.contract_problems import PROBLEMS
from planner.search.methods import Method
from search import test_contract as contract
from test_layers import violations

ROOT = Path(__file__).parents[1]
PAGES = [path.relative_to(ROOT).as_posix() for path in ROOT.glob("docs/*.md")]


def run(monkeypatch: pytest.MonkeyPatch, script: str, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", [script, *arguments])
    runpy.run_path(str(ROOT / "tools" / script), run_name="__main__")


def test_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "waypoints.csv"
    run(monkeypatch, "example_plan.py", "figure3", str(output))
    said = capsys.readouterr().out
    assert "found 100%" in said
    with output.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert f"{len(rows)} waypoints" in said
    assert (rows[0]["time_s"], rows[0]["x_m"], rows[0]["y_m"]) == ("0.00", "-30000.00", "0.00")
    times_s = [float(row["time_s"]) for row in rows]
    assert times_s == sorted(times_s)


def test_compare_starts(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run(monkeypatch, "example_compare_starts.py", "figure3", "0", "200")
    near, far = (float(line.split()[1].replace(",", "")) for line in lines_of(capsys))
    assert near < 1000 < far


def lines_of(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()[1:]


def test_the_readme_s_python(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = blocks("README.md")
    assert 'print(f"{flown' in code
    run_block(code)
    assert re.fullmatch(r"\d+ s, \d+\.\d% found\n", capsys.readouterr().out)


def test_python_from_a_script(capsys: pytest.CaptureFixture[str]) -> None:
    for code in blocks("docs/python.md"):
        run_block(code)
    said = capsys.readouterr().out
    assert re.fullmatch(r"\d+ s \(\d+ to \d+\)\n\[450\. 450\.\]\n", said), said


def test_the_planner_in_docs_plans() -> None:
    (code,) = [block for block in blocks("docs/python.md") if "def best_of_random" in block]
    planner = run_block(code)["best_of_random"]
    problem = contract.instance("paper_figure3")
    plan = planner(problem, budget=BUDGET, rng=np.random.default_rng(1)).plan
    assert cost_s(problem, plan) < contract.random_s("paper_figure3", 3)


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_planner_in_contributing_keeps_the_contract(name: str) -> None:
    (code,) = blocks("CONTRIBUTING.md")
    nearest = run_block(code)["nearest"]
    method = Method("nearest", "as in CONTRIBUTING.md", True, lambda: nearest)
    assert [*breaches(nearest, {name: PROBLEMS[name]})] == []
    contract.test_the_budget_is_kept(method, name)
    contract.test_tracks_obey_the_uav(method, name)


def test_the_planner_in_contributing_could_be_merged(tmp_path: Path) -> None:
    """Ruff and mypy find nothing in it, and it imports what a stage may import."""
    (code,) = blocks("CONTRIBUTING.md")
    assert not violations("search/nearest.py", code)
    (tmp_path / "nearest.py").write_text(code)
    for check in (["ruff", "check"], ["ruff", "format", "--check"], ["mypy"]):
        settings = [] if check[0] == "mypy" else ["--config", str(ROOT / "pyproject.toml")]
        command = [sys.executable, "-m", *check, *settings, str(tmp_path / "nearest.py")]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


def test_an_own_net_works_as_typed(tmp_path: Path) -> None:
    (typed,) = [block for block in blocks("README.md", "sh") if "netgenerate" in block]
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["sh", "-e", "-c", typed],
        cwd=tmp_path,
        env={**os.environ, "PATH": programs},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "written to runs/town" in done.stdout
    assert "horizon_s = 1800.0  # " in done.stdout
    assert (tmp_path / "runs" / "town" / "plan.png").is_file()


@pytest.mark.parametrize("page", ["docs/scenario.md"])
def test_scenarios_in_the_text_are_sound(page: str, tmp_path: Path) -> None:
    written, *parts = blocks(page, "toml")
    for name in re.findall(
        r'"(\S+\.(?:(?:net|nod|edg)\.xml|sumocfg))"', " ".join([written, *parts])
    ):
        (tmp_path / name).touch()
    for part in ("", *parts):
        base = written
        for section in re.findall(r"^\[\[(\w+)\]\]", part, flags=re.MULTILINE):
            table = (
                rf"^\[{section}\].*\n(?:[^\[\n].*\n)*"  # which a list of them takes the place of
            )
            base = re.sub(table, "", base, flags=re.MULTILINE)
        (tmp_path / "scenario.toml").write_text(f"{base}\n{part}")
        assert read_draft(tmp_path).faults == ()


def test_every_key_of_a_scenario_is_in_its_reference() -> None:
    page = (ROOT / "docs" / "scenario.md").read_text()
    for name, section in SECTIONS.items():
        assert f"### `[{name}]`" in page
        told = page.partition(f"### `[{name}]`")[2].partition("\n### ")[0]
        for key in section.model_fields if name != "truth" else ():
            assert f"`{key}`" in told, f"{name}.{key}"


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", *PAGES])
def test_links_lead_somewhere(page: str) -> None:
    text = (ROOT / page).read_text()
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        file, _, heading = link.partition("#")
        if "://" in file:
            continue
        target = (ROOT / page).parent / file if file else ROOT / page
        assert target.exists(), link
        if heading:
            assert heading in map(anchor, re.findall(r"^#+ (.*)$", target.read_text(), re.M)), link


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", *PAGES])
def test_commands_in_the_text_can_be_typed(page: str) -> None:
    lines = "\n".join(blocks(page, "(?:sh|console)")).splitlines()
    for line in lines:
        program, *words = shlex.split(line.removeprefix("$ "), comments=True) or [""]
        if program == "planner":
            assert callable(parser_for(words).parse_args(words).run), line


@pytest.mark.parametrize("page", ["README.md", *PAGES])
def test_beliefs_are_compared_where_there_are_several(page: str) -> None:
    for line in "\n".join(blocks(page, "sh")).splitlines():
        words = shlex.split(line, comments=True)
        if words[:2] == ["planner", "compare"] and "--beliefs" in words:
            arguments = parser_for(words[1:]).parse_args(words[1:])
            draft = read_draft(arguments.scenario, preset=arguments.preset)
            assert draft.target is not None
            assert draft.target.mix is not None, line


def test_the_town_in_the_readme_is_searched_at_a_speed_that_is_exported() -> None:
    (town,) = [block for block in blocks("README.md", "toml") if "town.osm.gz" in block]
    assert tomllib.loads(town)["uav"]["speed_mps"] <= FASTEST_MPS


def anchor(heading: str) -> str:
    """The name under which a heading is linked to."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def blocks(page: str, language: str = "python") -> list[str]:
    """Return a page's blocks of code."""
    text = (ROOT / page).read_text()
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def run_block(code: str) -> dict[str, Any]:
    """Run code as it stands but for a smaller net and fewer targets; return what it defines."""
    lighter = code.replace('"grid5x5"', '"figure3"').replace("1000", "100")
    names: dict[str, Any] = {}
    exec(compile(re.sub(r", overrides=\[.*?\]", "", lighter), "example", "exec"), names)
    return names
