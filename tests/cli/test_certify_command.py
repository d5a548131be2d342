"""`planner certify` from a run to a certificate that another program checks."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from support.command_line import Commands

ROOT = Path(__file__).parents[2]

SMALL = ("--set", "search.particles=40", "--targets", "40", "--method", "rate")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


def plan(run: Commands, folder: Path, *more: str) -> None:
    assert run("plan", "figure3", *SMALL, *more, "-o", folder).code == 0


def verify(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "tools" / "verify.py"), str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_certify(run: Commands, tmp_path: Path) -> None:
    plan(run, tmp_path / "run")
    told = run("certify", tmp_path / "run", "--work", "30", "--sets", "10", "--json").json
    stored = json.loads((tmp_path / "run" / "plan.json").read_text())
    assert stored["certificate"] == told
    value = stored["planned"]["expected_detection_time_s"]
    assert told["lower_bound_s"] <= value
    assert told["gap"] == pytest.approx((value - told["lower_bound_s"]) / told["lower_bound_s"])
    assert told["true_optimum_limit"] < stored["evaluated"]["ci95_s"][1]
    assert verify(tmp_path / "run").returncode == 0
    again = run("certify", tmp_path / "run")
    assert again.code == 2
    assert "--force" in again.err
    again = ("--work", "5", "--sets", "10", "--force")
    said = run("certify", tmp_path / "run", *again).out
    assert "no road plan is below" in said
    assert "this plan truly takes" in said


def test_a_better_bound_stays(run: Commands, tmp_path: Path) -> None:
    plan(run, tmp_path / "run")
    first = run("certify", tmp_path / "run", "--work", "200", "--sets", "10", "--json").json
    worse = run("certify", tmp_path / "run", "--work", "1", "--force")
    assert "the earlier bound is better and stays" in worse.out
    stored = json.loads((tmp_path / "run" / "plan.json").read_text())
    assert stored["certificate"] == first
    assert verify(tmp_path / "run").returncode == 0
    (tmp_path / "run" / "plan.json").write_text(
        json.dumps(stored | {"certificate": first | {"particles": 3, "gap": 0.0}})
    )
    again = run("certify", tmp_path / "run", "--work", "200", "--force", "--json").json
    assert again["particles"] == first["particles"]
    assert again["lower_bound_s"] == first["lower_bound_s"]


def test_certify_a_deadline(run: Commands, tmp_path: Path) -> None:
    plan(run, tmp_path / "run", "--objective", "probability", "--by", "900")
    told = run("certify", tmp_path / "run", "--work", "30", "--json").json
    stored = json.loads((tmp_path / "run" / "plan.json").read_text())
    assert told["upper_bound_probability"] >= stored["planned"]["found_by_probability"]
    assert verify(tmp_path / "run").returncode == 0


def test_bad_requests(run: Commands, tmp_path: Path) -> None:
    assert run("certify", tmp_path).code == 2
    assert run("certify", tmp_path, "--gap", "-1").code == 2
    plan(run, tmp_path / "run")
    refused = run("certify", tmp_path / "run", "--sets", "9")
    assert refused.code == 2
    assert "10 or more" in refused.err
    assert not (tmp_path / "run" / "prices.parquet").exists()


FCD = """<fcd-export>
<timestep time="0">
 <vehicle id="a" x="1000" y="0" speed="10" pos="1000" lane="AB_0"/>
 <vehicle id="b" x="0" y="0" speed="20" pos="0" lane="AB_0"/>
</timestep>
<timestep time="100">
 <vehicle id="a" x="2000" y="0" speed="10" pos="2000" lane="AB_0"/>
 <vehicle id="b" x="2000" y="0" speed="20" pos="2000" lane="AB_0"/>
</timestep>
</fcd-export>
"""


def test_certify_on_futures_of_ones_own(run: Commands, tmp_path: Path) -> None:
    """On the two vehicles of the file, also where it has moved; not once it has changed."""
    own, folder = tmp_path / "own.xml", tmp_path / "run"
    own.write_text(FCD, encoding="utf-8")
    plan(run, folder, "--futures", str(own))
    assert run("certify", folder, "--work", "3", "--json").json["particles"] == 2
    assert verify(folder).returncode == 0
    moved = own.rename(tmp_path / "moved.xml")
    gone = run("certify", folder, "--work", "3", "--force")
    assert (gone.code, "--futures FILE" in gone.err) == (2, True)
    there = ("certify", folder, "--work", "3", "--force", "--futures", moved)
    assert run(*there, "--json").json["particles"] == 2
    assert "leave it out" in run(*there, "--sets", "10").err
    moved.write_text(FCD.replace('pos="1000"', 'pos="1500"').replace('x="1000"', 'x="1500"'))
    changed = run(*there)
    assert (changed.code, "plan again" in changed.err) == (2, True)


def test_other_sets_that_take_long_are_announced(
    run: Commands, tmp_path: Path, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = ("--set", "search.sampling=iid", "--set", "search.particles=30")
    assert run("plan", "figure3", *small, "--method", "rate", "--targets", "5", "-o", tmp_path)
    monkeypatch.setattr("planner.cli.session.LONG_S", 0.0)
    said = run("certify", tmp_path, "--work", "2", "--sets", "10", "-j", "1")
    assert said.err == (
        "planner: recording other sets: 10 SUMO runs, about 1 s with 1 process; "
        "fewer (--set search.particles=15) take less\n"
    )
