"""The tools that measure and verify answer, and say what they mean."""

import json
import os
import signal
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from support.instances import grid, physics_futures

TOOLS = Path(__file__).parents[1] / "tools"


def run(tool: str, *options: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"COLUMNS": "140"}
    command = [sys.executable, str(TOOLS / tool), *options]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


@pytest.fixture
def paper_table(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(TOOLS))
    return import_module("paper_table")


@pytest.mark.parametrize("tool", ["benchmark.py", "paper_table.py", "verify.py", "make_grid.py"])
def test_help(tool: str) -> None:
    done = run(tool, "--help")
    assert done.returncode == 0
    assert done.stdout.startswith(f"usage: {tool}")


@pytest.mark.parametrize(
    ("program", "option"),
    [("--search", "--u0-km"), ("--certificate", "--only"), ("--online", "--small")],
)
def test_longer_benchmarks_are_started(program: str, option: str) -> None:
    done = run("benchmark.py", program, "--help")
    assert done.returncode == 0, done.stderr
    assert option in done.stdout


def test_the_call_is_measured_from_enter() -> None:
    done = run("benchmark.py", "--call", "--help")
    assert done.returncode == 0, done.stderr
    assert "wall-clock seconds from Enter" in done.stdout


def test_the_flight_law_is_held_against_both_recordings() -> None:
    done = run("benchmark.py", "--flight", "--only", "recordings")
    assert done.returncode == 0, done.stderr
    assert "sitl_10, predicted" in done.stdout
    assert "NO" not in done.stdout
    assert "There is no third recording." in done.stdout


def test_benchmark_measures_against_the_slow_twin() -> None:
    done = run("benchmark.py", "--only", "detection", "--repeats", "1")
    assert done.returncode == 0, done.stderr
    assert "slow twin" in done.stdout


def test_benchmark_measures_one_section(tmp_path: Path) -> None:
    done = run("benchmark.py", "--only", "help", "--repeats", "3", "--json", str(tmp_path / "b"))
    assert done.returncode == 0, done.stderr
    told = json.loads((tmp_path / "b").read_text())
    (figure,) = told["figures"]
    assert (figure["section"], figure["at_most"]) == ("help", 0.3)
    assert len(figure["values"]) == 3
    assert 0 < figure["median"] == sorted(figure["values"])[1]
    assert told["machine"]["cores"] == os.cpu_count()
    assert "planner --help" in done.stdout


def test_paper_table(tmp_path: Path) -> None:
    small = ("--seeds", "1", "--particles", "50", "--targets", "50", "--u0-km", "700")
    methods = ("--only", "wait", "--only", "exhaustive")
    done = run("paper_table.py", *small, *methods, "--json", str(tmp_path / "rows"))
    assert done.returncode == 0, done.stderr
    rows = {one["method"]: one for one in json.loads((tmp_path / "rows").read_text())}
    assert rows["exhaustive"]["mean_s"] == pytest.approx(10000)
    # From 700 km the sink is first reached after 8,060 s, when most targets rest there.
    assert 8060 < rows["wait"]["mean_s"] < 8600
    assert rows["wait"]["found"] == pytest.approx(1)


def test_faulty_arguments_are_refused(tmp_path: Path) -> None:
    assert run("paper_table.py", "--seeds", "0").returncode == 2
    assert run("verify.py").returncode == 2
    done = run("verify.py", str(tmp_path))
    assert done.returncode == 2
    assert "planner certify" in done.stderr


def test_verify_loads_nothing_of_the_planner() -> None:
    code = "import sys, verify; sys.exit(any(name.startswith('planner') for name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], cwd=TOOLS, check=False)
    assert done.returncode == 0


def test_verdict(paper_table: Any) -> None:
    """Chance is allowed for where it is: between seeds, in the targets, in the reference."""

    def verdict(values: list[float], reference: Any) -> bool:
        row = paper_table.Row("one", "greedy", {0: reference}, random=True)
        return bool(paper_table.cell(row, 0, [evaluation(value) for value in values]).agrees)

    # Four seeds 100 s apart in standard deviation: 50 s, and 100 / sqrt(10) = 32 s in the
    # reference; together 59 s, of which 1.96 times are allowed.
    spread = [1000.0 - 86.6, 1000.0 - 86.6, 1000.0 + 86.6, 1000.0 + 86.6]
    assert verdict(spread, 1110.0)
    assert not verdict(spread, 1125.0)
    assert not verdict(spread, 875.0)
    assert verdict(spread, (1100.0, 1300.0))
    assert not verdict([1000.0] * 4, 1001.0)
    assert verdict([1000.0] * 4, 1000.4)


def evaluation(value_s: float) -> Any:
    from planner import Evaluation, Objective

    return Evaluation(
        np.full(10, value_s), np.full(10, 0.1), np.full(10, np.inf), Objective(10000.0)
    )


def test_targets_turn_back_on_the_way_they_came(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TOOLS))
    turned_back = import_module("benchmarks.beliefs").turned_back
    routes = [["r0c0-r0c1", "r0c1-r1c1"], ["r0c1-r1c1"]]
    futures = physics_futures(grid(2, 2, road_m=1000.0), routes, 0.0, np.array([5.0, 4.0]))
    back = turned_back(futures, np.random.default_rng(3))
    assert not back.gone.any()
    for k in range(len(back)):
        turns_s = 0.5 * float(back.end_s[k])
        before_s = np.linspace(0.0, turns_s, 30)
        np.testing.assert_allclose(back.xy(k, before_s), futures.xy(k, before_s))
        np.testing.assert_allclose(back.xy(k, 2.0 * turns_s - before_s), back.xy(k, before_s))


# The table of gaps


@pytest.fixture
def gaps(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(TOOLS))
    return import_module("benchmarks.certificate")


def test_gaps_stand_beside_those_aimed_at(gaps: Any) -> None:
    near = gaps.Condition("near", 60.0, aims=(0.05, 0.02))
    points = [gaps.Point(60.5, 1100.0, 1000.0, 0.1), gaps.Point(600.2, 1010.0, 1000.0, 0.01)]
    rows = [gaps.Row(near, points), gaps.Row(gaps.Condition("far"), (), "too large a table")]
    assert gaps.table(rows, 600.0).splitlines()[2:] == [
        "| near | 1,010.0 | 1,000.0 | **10.00** | 5 | 1.00 | 2 |",
        "| far |  | none | - | - | - | - |",
    ]
    assert "| **10.00** | 5 | - | 2 |" in gaps.table([gaps.Row(near, points[:1])], 60.0)
    soon = [gaps.Row(near, [gaps.Point(3.0, 1000.0, 1000.0, 0.0)])]
    assert "| 0.00 | 5 | 0.00 | 2 |" in gaps.table(soon, 60.0)


def test_gaps_that_are_known_when_it_is_interrupted_are_printed(
    gaps: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def curve(condition: Any, *_: object) -> list[Any]:
        if condition.name == "120 km":
            signal.raise_signal(signal.SIGINT)
        return [gaps.Point(1.0, 200.0, 200.0, 0.0)]

    monkeypatch.setattr(gaps, "curve", curve)
    assert gaps.main(["--only", "60 km", "--only", "120 km"]) == 130
    said = capsys.readouterr()
    assert said.out.splitlines()[2:] == ["| 60 km | 200.0 | 200.0 | 0.00 | 0 | 0.00 | 0 |"]
    assert "2 of 2: 120 km; about " in said.err
    assert gaps.main(["--only", "60 km"]) == 0
