"""Gaps beside plans: `planner plan --gap`, and the column of `planner compare`."""

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from planner.mission.certificate_file import PROOF
from planner.search.methods import is_pattern
from support.command_line import Commands

VERIFY = Path(__file__).parents[2] / "tools" / "verify.py"
OFF_ROADS = ("wait", "anneal-waypoints", "cells")
SMALL = ("--set", "search.particles=40", "--targets", "40")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


def gap_of(value: float, bound: float) -> float:
    return abs(value - bound) / bound


def holds(folder: Path) -> bool:
    command = [sys.executable, str(VERIFY), str(folder)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def by_method(told: Any) -> dict[str, Any]:
    return {row["method"]: row for row in told["methods"]}


def test_a_plan_within_a_gap(run: Commands, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    told = run("plan", "figure3", *SMALL, "--gap", "0.1", "-o", folder, "--json").json
    certificate, value = told["certificate"], told["planned"]["expected_detection_time_s"]
    assert certificate["gap"] <= 0.1
    assert certificate["gap"] == pytest.approx(gap_of(value, certificate["lower_bound_s"]))
    stored = json.loads((folder / "plan.json").read_text())
    assert stored["certificate"] == certificate
    assert holds(folder)
    again = tmp_path / "again"
    assert run("plan", "figure3", *SMALL, "--gap", "0.1", "-o", again, "--json").code == 0
    for name in ("plan.json", *PROOF):
        assert (again / name).read_bytes() == (folder / name).read_bytes()


def test_certify_writes_the_same(run: Commands, tmp_path: Path) -> None:
    """A run planned with a gap and one certified to it have the same certificate and proof."""
    plan = ("plan", "figure3", *SMALL, "--method", "rate")
    assert run(*plan, "--gap", "0.2", "-o", tmp_path / "at_once").code == 0
    assert run(*plan, "-o", tmp_path / "later").code == 0
    assert run("certify", tmp_path / "later", "--gap", "0.2").code == 0
    for name in ("plan.json", *PROOF):
        at_once, later = tmp_path / "at_once" / name, tmp_path / "later" / name
        assert at_once.read_bytes() == later.read_bytes(), name


def test_what_is_out_of_reach_is_said(run: Commands, tmp_path: Path) -> None:
    options = (*SMALL, "--gap", "0", "--time-limit", "1", "--method", "rate")
    said = run("plan", "figure3", *options, "-o", tmp_path / "run").out
    assert "no road plan is below" in said
    assert "gap asked for, 0.0 %, is not reached" in said
    assert holds(tmp_path / "run")


def test_a_deadline_and_a_gap(run: Commands, tmp_path: Path) -> None:
    deadline = ("--objective", "probability", "--by", "900", "--time-limit", "2")
    options = (*SMALL, *deadline, "--gap", "0.05", "-o", tmp_path / "run", "--json")
    told = run("plan", "figure3", *options).json
    bound = told["certificate"]["upper_bound_probability"]
    assert bound >= told["planned"]["found_by_probability"]
    assert holds(tmp_path / "run")


def test_a_plan_without_a_bound_is_kept(run: Commands, tmp_path: Path) -> None:
    home = ("--set", 'uav.return_to="start"', "--set", "uav.max_flight_time_s=3000")
    options = (*SMALL, *home, "--method", "rate", "--gap", "0.1", "-o", tmp_path / "run")
    said = run("plan", "figure3", *options)
    assert said.code == 0
    assert "there is no certificate: " in said.out
    assert "certificate" not in json.loads((tmp_path / "run" / "plan.json").read_text())
    told = run("plan", "figure3", *options[:-2], "--json").json
    assert told["certificate"] is None


def test_a_new_plan_drops_the_old_proof(run: Commands, tmp_path: Path) -> None:
    plan = ("plan", "figure3", *SMALL, "--method", "rate", "-o", tmp_path)
    assert run(*plan, "--gap", "0.3").code == 0
    assert all((tmp_path / name).exists() for name in PROOF)
    assert run(*plan).code == 2
    assert run(*plan, "--force").code == 0
    assert not any((tmp_path / name).exists() for name in PROOF)


def test_bad_requests(run: Commands) -> None:
    for options, fault in (
        (("plan", "figure3", "--gap", "-1"), "share from 0 to 1"),
        (("certify", "runs/none", "--gap", "5"), "not '5'; give 0.05 for 5 %"),
        (("compare", "figure3", "--time-limit", "3"), "--bound"),
        (("compare", "--instances", "--bound"), "--instances"),
    ):
        refused = run(*options)
        assert (refused.code, fault in refused.err) == (2, True), refused.err


def test_compare_shows_gaps(run: Commands, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    options = (*SMALL, "--bound", "--time-limit", "2", "-o", table, "--json")
    rows = by_method(run("compare", "figure3", *options).json)
    road, free = rows["exact"]["bound"], rows["wait"]["bound"]
    assert 0.0 < free <= road <= rows["exact"]["planned_expected_detection_time_s"]
    for name, row in rows.items():
        if row["why_not"]:
            continue
        if name in OFF_ROADS or is_pattern(name):  # prices begin with what a plan earns
            assert 0.0 < row["bound"] <= road
        else:
            assert row["bound"] == road
        value = row["planned_expected_detection_time_s"]
        assert row["gap"] == pytest.approx(gap_of(value, row["bound"]))
    with table.open(newline="") as file:
        written = {row["method"]: row["gap"] for row in csv.DictReader(file)}
    assert float(written["rate"]) == pytest.approx(rows["rate"]["gap"])


def test_compare_shows_a_stored_certificate(run: Commands, tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    assert run("plan", "figure3", *SMALL, "--method", "rate", "-o", folder).code == 0
    compare = ("compare", folder / "run.json", "--targets", "40", "--json")
    rows = by_method(run(*compare).json)
    assert rows["mine: rate"]["gap"] is None
    assert rows["mine: rate"]["planned_expected_detection_time_s"] == pytest.approx(
        rows["rate"]["planned_expected_detection_time_s"]
    )
    certified = run("certify", folder, "--gap", "0.2", "--json").json
    rows = by_method(run(*compare).json)
    assert rows["mine: rate"]["gap"] == pytest.approx(certified["gap"])
    assert rows["lns"]["bound"] == certified["lower_bound_s"]
    assert rows["wait"]["gap"] is None
    assert "gap" in run(*compare[:-1]).out
    other = by_method(run(*compare, "--set", "sensor.radius_m=600").json)
    assert "mine: rate" not in other
    assert other["rate"]["gap"] is None
