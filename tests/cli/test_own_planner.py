"""The planner of thirty lines in docs/own-planner.md, from the command line."""

import csv
import hashlib
import json
import re
from pathlib import Path

import pytest

from support import plan_schema
from support.command_line import Commands

PAGE = Path(__file__).parents[2] / "docs" / "own-planner.md"
SMALL = ("--set", "search.particles=100", "--set", "search.work=500", "--targets", "200", "-j", "1")


@pytest.fixture
def nearest(tmp_path: Path) -> Path:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(code.splitlines()) <= 30
    (tmp_path / "nearest.py").write_text(code)
    return tmp_path / "nearest.py"


def test_the_page_s_planner_keeps_the_contract(
    nearest: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Commands(capsys)
    said = run("check-planner", f"{nearest}:nearest")
    assert said.code == 0, said.out
    assert "nearest.py:nearest keeps the contract on 6 problems" in said.out
    told = run("check-planner", f"{nearest}:nearest", "--json").json
    assert (told["keeps_the_contract"], told["found"]) == (True, [])
    nearest.write_text("def nearest(problem, budget, rng): return 3", encoding="utf-8")
    said = run("check-planner", f"{nearest}:nearest")
    assert said.code == 1
    assert "broken: a flight that the UAV can fly" in said.out
    assert "all problems: returned an int, no SearchResult" in said.out
    assert "remedy: " in said.out
    nearest.write_text("def nearest(problem, budget, rng): return 1 / 0", encoding="utf-8")
    said = run("check-planner", f"{nearest}:nearest")
    assert "all problems: raised ZeroDivisionError" in said.out
    assert "remedy" not in said.out  # of flights, of which it has made none
    said = run("check-planner", f"{nearest}:farthest")
    assert (said.code, said.err.count("\n")) == (2, 1)
    assert "has no function 'farthest'; did you mean nearest?" in said.err


def test_it_plans_and_says_who_planned(
    nearest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Commands(capsys)
    named, out = f"{nearest}:nearest", tmp_path / "run"
    said = run("plan", "figure3", *SMALL, "--method", named, "-o", out)
    assert said.code == 0, said.err
    assert "nearest.py:nearest" in said.out
    plan = json.loads((out / "plan.json").read_text())
    plan_schema.refuse(plan)
    assert plan["method"] == "nearest.py:nearest"
    digest = hashlib.sha256(nearest.read_bytes()).hexdigest()
    assert plan["planner"] == {"file": "nearest.py", "function": "nearest", "sha256": digest}
    assert str(tmp_path) not in (out / "plan.json").read_text()
    assert run("fly", out, "--targets", 50, "-j", 1).code == 0


def test_it_stands_beside_all_others(
    nearest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Commands(capsys)
    out = tmp_path / "methods.csv"
    said = run("compare", "figure3", *SMALL, "--method", f"{nearest}:nearest", "-o", out)
    assert said.code == 0, said.err
    with out.open(newline="") as file:
        table = {row["method"]: row for row in csv.DictReader(file)}
    assert next(iter(table)) == "nearest.py:nearest"
    assert "best" in table
    mine, chance = (
        float(table[name]["expected_detection_time_s"]) for name in ("nearest.py:nearest", "random")
    )
    assert mine < chance


def test_it_is_a_level_of_an_experiment(
    nearest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Commands(capsys)
    file, out = tmp_path / "own.toml", tmp_path / "out"
    file.write_text(
        'title = "own"\nscenario = "figure3"\ntargets = 100\n'
        '[set]\n"search.particles" = 50\n[factors]\nmethod = ["rate", "nearest.py:nearest"]\n'
    )
    told = run("experiment", file, "-o", out, "-j", 1, "--json").json
    assert (told["conditions"], told["run"], told["failed"]) == (2, 2, 0)
    with (out / "results.csv").open(newline="") as table:
        assert [row["method"] for row in csv.DictReader(table)] == ["rate", "nearest.py:nearest"]
    with nearest.open("a", encoding="utf-8") as code:
        code.write("# changed\n")
    assert run("experiment", file, "-o", out, "-j", 1, "--json").json["run"] == 1
    file.write_text(file.read_text().replace(', "nearest.py:nearest"', ""))
    added = ("--method", f"{nearest}:nearest")
    told = run("experiment", file, "-o", out, "-j", 1, "--json", *added).json
    assert (told["conditions"], told["run"]) == (2, 0)
    said = run("experiment", "paper", "--method", "rate", "--dry-run")
    assert said.code == 2
    assert said.err == "planner: --method: goes with one experiment, not with paper\n"
