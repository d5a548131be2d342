"""The run.json of a plan on a user's own futures stands for these, not for the belief."""

from pathlib import Path

import pytest

from support.command_line import Commands

FORTY = ("--set", "search.particles=40", "--set", "search.sampling=iid")
METHOD = ("--method", "wait", "--targets", "20")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.fixture
def own(run: Commands, tmp_path: Path) -> Path:
    """The record of a run that was planned on 40 futures from a file."""
    given, planned = tmp_path / "given", tmp_path / "run"
    assert run("futures", "figure3", *FORTY, "-o", given).code == 0
    futures = ("--futures", given / "futures.parquet")
    assert run("plan", "figure3", *METHOD, *futures, "-o", planned).code == 0
    return planned / "run.json"


def test_a_plan_for_a_run_is_made_on_the_futures_of_the_run(run: Commands, own: Path) -> None:
    again = run("plan", own, *METHOD, "--json", "-o", own.parent.with_name("again"))
    assert again.json["planned"]["particles"] == 40
    assert again.err.count("takes the futures that the run was planned on") == 1
    third = run("plan", own.parent.with_name("again") / "run.json", *METHOD, "--json")
    assert third.json["planned"] == again.json["planned"]


def test_where_of_a_run_shows_the_futures_of_the_run(run: Commands, own: Path) -> None:
    few = run("where", "figure3", *FORTY, "--at", "60", "--json").json
    many = run("where", "figure3", "--at", "60", "--json").json
    told = run("where", own, "--at", "60", "--json")
    assert told.json == few != many
    assert "takes the futures that the run was planned on" in told.err


@pytest.mark.parametrize("command", ["futures", "compare"])
def test_what_draws_from_the_belief_says_so(run: Commands, own: Path, command: str) -> None:
    more = ("--targets", "20") if command == "compare" else ()
    told = run(command, own, *more)
    assert told.code == 0
    assert "draws from its scenario's belief" in told.err


def test_futures_that_are_gone_are_refused(run: Commands, own: Path) -> None:
    (own.parent.with_name("given") / "futures.parquet").unlink()
    told = run("plan", own, *METHOD)
    assert told.code == 2
    assert "given/futures.parquet, which is gone; put it back" in told.err


def test_targets_go_unused_where_vehicles_are_kept_out(run: Commands, tmp_path: Path) -> None:
    given = tmp_path / "given"
    assert run("futures", "figure3", "-o", given).code == 0
    told = run("plan", "figure3", *METHOD, "--futures", given / "futures.parquet")
    assert "--targets 20: goes unused; the plan is evaluated on the 20 vehicles" in told.err
