"""`planner validate`: a table of checks, and what it refuses."""

from pathlib import Path

import pytest

from support.command_line import Commands
from support.queues import grid_scenario


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


def test_a_belief_against_recorded_days(run: Commands, tmp_path: Path) -> None:
    days = []
    for seed in (2, 3, 4):
        folder = tmp_path / f"day{seed}"
        assert run("futures", "figure3", "-s", str(seed), "-o", folder).code == 0
        days.append(folder / "futures.parquet")
    right = run("validate", "figure3", "--truths", *days)
    assert right.code == 0
    assert "300 truths of 3 runs" in right.out
    assert "nothing is seen against the belief" in right.out
    assert "the smallest effect that 3 runs could have seen: " in right.out
    covered = run("validate", "figure3", "--truths", *days, "--json").json["checks"]
    assert all(0.8 < check["covered"] <= 1.0 for check in covered)  # ties are not broken by noise
    assert all(len(line) <= 80 for line in right.out.splitlines())
    slower = ("--set", "target.speed_mps={ list = [5, 9] }")
    wrong = run("validate", "figure3", *slower, "--truths", *days, "--json").json
    assert wrong["is_off"]
    assert all(check["way_off"] > check["way_smallest_seen"] for check in wrong["checks"][:1])
    one = run("validate", "figure3", "--truths", days[0])
    assert (one.code, "give at least two" in one.err) == (2, True)
    none = run("validate", "figure3")
    assert (none.code, "nothing is said of any" in none.err) == (2, True)


@pytest.mark.usefixtures("empty_cache")
def test_a_belief_against_unseen_realisations(run: Commands, tmp_path: Path) -> None:
    some = ("--realisations", "2", "--each", "2", "--set", "search.horizon_s=20")
    found = run("validate", grid_scenario(tmp_path), *some, "--json").json
    assert (found["truths"], found["truth_runs"], found["particle_runs"]) == (4, 2, 2)
    assert (found["is_off"], found["can_show"]) == (False, False)
    assert found["smallest_seen"] >= 0.9
    told = run("validate", grid_scenario(tmp_path), *some)
    assert "nothing can be told from 2 runs" in told.out
    assert "so few can show nothing: a belief that covers none would pass; take 20 runs" in told.out
