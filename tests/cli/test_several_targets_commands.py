"""Several targets at the command line: what plans for them, and what says that it cannot."""

import csv
import json
from pathlib import Path

import pytest

from planner.cli import main
from planner.files import RECORD

BLUE = '{start={"r3c0-r4c0"=0.5,"r3c0-r3c1"=0.5},name="blue",probability_present=0.8}'
RED = '{start={"r0c0-r0c1"=1},distance_m={uniform=[0,7500]}}'
FEW = ["--set", "search.particles=40", "--set", "search.sampling=iid", "--method", "rate"]


def planned(folder: Path, *settings: str) -> Path:
    overrides = [part for setting in settings for part in ("--set", setting)]
    assert main(["plan", "grid5x5", *FEW, *overrides, "--targets", "60", "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return planned(tmp_path_factory.mktemp("two") / "run", f"target=[{RED},{BLUE}]")


def test_a_plan_tells_of_each_target_and_of_all(run: Path) -> None:
    content = json.loads((run / "plan.json").read_text())
    assert content["targets"] == ["target 0", "blue"]
    assert content["planned"]["sought"] == 2
    several = content["evaluated"]["several"]
    times_s = [one["expected_detection_time_s"] for one in several["each"]]
    assert content["evaluated"]["expected_detection_time_s"] == pytest.approx(sum(times_s))
    first_s, last_s = (several[key]["expected_detection_time_s"] for key in ("first", "last"))
    assert first_s + last_s == pytest.approx(sum(times_s))
    assert 0.0 < several["last"]["found_probability"] <= 0.8


def test_a_list_of_one_plans_the_same(tmp_path: Path) -> None:
    one, same = planned(tmp_path / "a", f"target={RED}"), planned(tmp_path / "b", f"target=[{RED}]")
    files = sorted(path.name for path in one.iterdir() if path.name != RECORD)
    assert "plan.json" in files
    for name in files:
        assert (one / name).read_bytes() == (same / name).read_bytes(), name


def test_tables_tell_of_each_and_of_the_first_and_the_last(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fly", str(run), "--targets", "30", "--force"]) == 0
    shown = capsys.readouterr().out
    for words in ("30 flights", "sum of 2 detection times", "the first find", "blue", "all found"):
        assert words in shown
    with (run / "flights.csv").open() as file:
        rows = [*csv.DictReader(file)]
    assert len(rows) == 60
    assert [(row["flight"], row["target"]) for row in rows[:3]] == [
        ("0", "target 0"),
        ("0", "blue"),
        ("1", "target 0"),
    ]


def test_one_mission_says_who_is_found_when(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fly", str(run), "--targets", "1", "--force"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "target 0: found" in said or "target 0: not found" in said
    assert "blue: found" in said or "blue: not found" in said


@pytest.mark.parametrize(
    "command",
    [
        ["certify", "RUN"],
        ["ask", "RUN"],
        ["fly", "RUN", "--live", "news.jsonl"],
        ["fly", "RUN", "--alarms", "1/600"],
        ["fly", "RUN", "--route", "r0c0-r0c1", "--target-speed", "20", "--force"],
        ["replan", "RUN", "--at", "1500", "--lost-at", "r2c2"],
        ["compare", "RUN/run.json", "--beliefs"],
        ["validate", "RUN/run.json", "--truths", "fcd.xml"],
    ],
)
def test_what_takes_one_target_says_so(
    run: Path, command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([part.replace("RUN", str(run)) for part in command]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "is for one target yet, and grid5x5 has 2; give each a scenario of its own" in line
