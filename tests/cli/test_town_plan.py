"""A plan in a town: announced, shown before it is evaluated, the same on a terminal or a pipe."""

import json
import re
from pathlib import Path

import pytest

from cli.test_cli import on_a_terminal
from planner.cli import session
from planner.futures import record
from support.command_line import TOWN, Commands

FREE = ("--set", "target.driving=free", "--set", "search.horizon_s=300")
SMALL = ("plan", TOWN, *FREE, "--set", "search.particles=4", "--method", "rate", "--targets", "5")
MADE = "the plan is made; what it is worth shows on 5 fresh targets"


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


def test_a_terminal_gets_the_plan_first_and_the_same_files(
    run: Commands, tmp_path: Path, empty_cache: Path
) -> None:
    shown = on_a_terminal(*SMALL, "-o", str(tmp_path / "seen"), NO_COLOR="1")
    assert shown.count("roads in the order flown") == 1
    assert shown.index("roads in the order flown") < shown.index(MADE)
    assert shown.index(MADE) < shown.index("expected detection time")
    cached = on_a_terminal(*SMALL, NO_COLOR="1")
    assert MADE not in cached  # nothing has to be driven
    assert cached.count("roads in the order flown") == 1
    piped = run(*SMALL, "-o", tmp_path / "piped")
    assert MADE not in piped.out
    assert piped.out.count("roads in the order flown") == 1
    # What to do next stands at the end.
    said = " ".join(piped.out.split())
    news = ("expected detection time", "page.html in a browser", "planner export ", "planner fly ")
    assert [*news] == sorted(news, key=said.index)
    for name in ("plan.json", "plan.png", "plan.add.xml", "evaluation.parquet"):
        pair = [(tmp_path / folder / name).read_bytes() for folder in ("seen", "piped")]
        assert pair[0] == pair[1], name


def test_a_method_that_chooses_is_preceded_by_one_that_does_not(
    run: Commands, tmp_path: Path, empty_cache: Path
) -> None:
    best = [word if word != "rate" else "best" for word in SMALL]
    best += ["--set", "search.work=200"]
    shown = on_a_terminal(*best, "-o", str(tmp_path / "seen"), NO_COLOR="1")
    first = "a first plan, by rate; best makes its own"
    assert shown.count("roads in the order flown") == 2
    assert shown.index("roads in the order flown") < shown.index(first) < shown.index(MADE)
    assert first not in run(*best, "-o", tmp_path / "piped").out
    pair = [(tmp_path / folder / "plan.json").read_bytes() for folder in ("seen", "piped")]
    assert pair[0] == pair[1]


def test_at_constant_speed_nothing_is_shown_beforehand(empty_cache: Path) -> None:
    constant = [word for word in SMALL if word != "target.driving=free"]
    constant.remove("--set")
    assert "the plan is made" not in on_a_terminal(*constant, NO_COLOR="1")


def test_the_estimate_sharpens_and_portions_change_nothing(
    run: Commands, tmp_path: Path, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(record, "SESSION", 2)
    whole = run(*SMALL, "--json").json
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / "other"))
    monkeypatch.setattr(record, "FIRST_NOTED", 2)
    monkeypatch.setattr("planner.cli.progress.EVERY_S", 0.0)
    said = run(*SMALL, "--json", "-j", "1")  # two processes need not answer in order
    assert said.json == whole
    notes = re.findall(
        r"recording fresh targets: (\d) of 5.*; (\d+) s \((-?\d+) .. \d+\) so", said.err
    )
    assert [int(done) for done, *_ in notes] == [2, 4]


def test_what_takes_long_is_announced(
    run: Commands, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(*SMALL[:6], "--set", "search.particles=2", "--targets", "2").err == ""
    monkeypatch.setattr(session, "LONG_S", 0.0)
    said = run(*SMALL, "-j", "2").err.splitlines()
    assert said == [
        "planner: recording futures: 4 SUMO runs, about 1 s with 2 processes; "
        "fewer (--set search.particles=2) take less",
        "planner: recording fresh targets: 5 SUMO runs, about 1 s with 2 processes; "
        "fewer (--targets 300) take less",
    ]
    assert run(*SMALL, "-j", "2").err == ""  # all of them are kept


def test_a_run_says_how_many_targets_were_driven(run: Commands, tmp_path: Path) -> None:
    assert run(*SMALL, "-o", tmp_path / "rate").code == 0
    record = json.loads((tmp_path / "rate" / "run.json").read_text(encoding="utf-8"))
    assert record["targets"] == {"planning": 4, "holdout": 0, "evaluation": 5}
    best = [word if word != "rate" else "best" for word in SMALL]
    assert run(*best, "--set", "search.work=200", "-o", tmp_path / "best").code == 0
    record = json.loads((tmp_path / "best" / "run.json").read_text(encoding="utf-8"))
    assert record["targets"] == {"planning": 4, "holdout": 4, "evaluation": 5}
