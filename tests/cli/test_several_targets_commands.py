"""Several targets at the command line: what plans for them, and what says that it cannot."""

import csv
import json
import shutil
import sys
from argparse import Namespace
from importlib import import_module
from pathlib import Path

import pyarrow.parquet
import pytest

from planner.cli import main
from planner.cli.news_arguments import heard_of
from planner.errors import InputError
from planner.files import RECORD
from planner.mission.news_values import Setting
from planner.mission.opening import open_scenario
from support.instances import figure3

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
    assert content["targets"] == ["target 1", "blue"]
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
        ("0", "target 1"),
        ("0", "blue"),
        ("1", "target 1"),
    ]


def test_one_mission_says_who_is_found_when(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fly", str(run), "--targets", "1", "--force"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "target 1: found" in said or "target 1: not found" in said
    assert "blue: found" in said or "blue: not found" in said


@pytest.mark.parametrize(
    "command",
    [
        ["certify", "RUN"],
        ["ask", "RUN"],
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
    assert "takes one target so far, and grid5x5 has 2; give each a scenario of its own" in line


def test_a_find_is_news_and_the_rest_is_planned_for_the_others(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rest = ["--at", "1500", "--method", "rate", "--targets", "60"]
    assert main(["replan", str(run), *rest, "--found", "blue", "-o", str(tmp_path / "a")]) == 0
    assert "found: blue" in capsys.readouterr().out
    content = json.loads((tmp_path / "a" / "plan.json").read_text())
    assert "sought" not in content["planned"]
    assert content["evaluated"]["expected_detection_time_s"] < 10_000
    heard = json.loads((tmp_path / "a" / RECORD).read_text())["scenario"]["news"]["heard"]
    assert {"kind": "found", "target": 1} in heard
    again = ["replan", str(tmp_path / "a"), "--at", "1600", "--method", "rate", "--found", "1"]
    assert main([*again, "-o", str(tmp_path / "b")]) == 2
    assert "every target that it is found" in capsys.readouterr().err
    assert main(["replan", str(run), *rest, "--found", "green", "-o", str(tmp_path / "c")]) == 2
    assert (
        '--found: target: "green" is none of the targets; known: target 1, blue'
        in capsys.readouterr().err
    )


def test_the_only_target_is_not_found_in_between() -> None:
    said = Namespace(found=["red"], report=[], same_source=False, insist=False)
    with pytest.raises(InputError, match="--found: there is one target"):
        heard_of(said, Setting(figure3(), None, 100.0))


def test_the_rest_of_a_flight_tells_of_each_target_too(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    late = ["--at", "1500", "--delay", "60", "--method", "rate", "--targets", "60"]
    assert main(["replan", str(run), *late, "-o", str(tmp_path / "late")]) == 0
    shown = capsys.readouterr().out
    for words in ("sum of 2 detection times", "the first find", "blue", "all found"):
        assert words in shown


def test_where_tells_of_each_target(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = [str(run / RECORD), "--at", "900", "--json", "-o", str(tmp_path / "where")]
    assert main(["where", *place]) == 0
    content = json.loads(capsys.readouterr().out)["targets"]
    assert [one["target"] for one in content] == ["target 1", "blue"]
    for one, present in zip(content, (1.0, 0.8), strict=True):
        assert sum(road["probability"] for road in one["roads"]) == pytest.approx(present)
        assert one["elsewhere_probability"] == pytest.approx(1.0 - present)
    with (tmp_path / "where" / "where.csv").open() as file:
        assert {row["target"] for row in csv.DictReader(file)} == {"target 1", "blue"}


def test_the_figures_follow_from_waypoints_alone(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["futures", str(run / RECORD), "-o", str(tmp_path / "futures")]) == 0
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2] / "tools"), *sys.path])
    check = import_module("verify").main
    assert check([str(run), "--futures", str(tmp_path / "futures")]) == 0
    content = json.loads((run / "plan.json").read_text())
    del content["planned"]["sought"]  # as if there were one, which cannot weigh so much
    (tmp_path / "plan.json").write_text(json.dumps(content))
    shutil.copy(run / RECORD, tmp_path)
    assert check([str(tmp_path), "--futures", str(tmp_path / "futures")]) == 1


def test_the_shipped_example_opens() -> None:
    opened = open_scenario("grid5x5-two")
    assert opened.scenario.target_names == ("red", "blue")
    assert opened.sought == 2


def test_the_page_tells_targets_apart(run: Path) -> None:
    page = (run / "page.html").read_text()
    assert "There are 2 targets: odds and times above are of one of them, on average." in page
    for words in ("blue may be here", "All of them: found ", 'class="targets t1"', '"kind":"'):
        assert words in page


def test_live_goes_on_until_all_targets_are_found(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    news, out = tmp_path / "news.jsonl", tmp_path / "live.jsonl"
    found = ['{"kind": "found", "target": "blue", "now": 1500}', '{"kind": "found", "target": 1}']
    news.write_text("\n".join(found) + "\n")
    assert main(["fly", str(run), "--live", str(news), "--auto", "-o", str(out), "-j", "1"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert [line for line in said if line.startswith("found: ")] == [
        "found: blue",
        "found: target 1",
    ]


def test_the_checker_says_what_of_several_it_takes_as_given_where_some_are_missed(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["futures", str(run / RECORD), "-o", str(tmp_path / "futures")]) == 0
    content = json.loads((run / "plan.json").read_text())
    content["planned"]["rate_per_s"] = 0.1
    (tmp_path / "plan.json").write_text(json.dumps(content))
    shutil.copy(run / RECORD, tmp_path)
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2] / "tools"), *sys.path])
    check = import_module("verify").main
    capsys.readouterr()
    check([str(tmp_path), "--futures", str(tmp_path / "futures")])
    said = capsys.readouterr().out.splitlines()
    assert [line for line in said if line.startswith("assumed: first {")]
    assert not [line for line in said if line.startswith(("first: ", "last: "))]


def test_the_checker_reads_particles_that_name_no_target(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["futures", str(run / RECORD), "-o", str(tmp_path)]) == 0
    table = pyarrow.parquet.read_table(tmp_path / "particles.parquet")
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2] / "tools"), *sys.path])
    read = import_module("verify_odds")._particles
    assert {one.target for one in read(tmp_path)} == {0, 1}
    pyarrow.parquet.write_table(table.drop_columns("target"), tmp_path / "particles.parquet")
    assert {one.target for one in read(tmp_path)} == {0}


def test_the_checker_finds_when_any_and_all_are_found(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    particles = tmp_path / "particles"
    assert main(["futures", str(run / "run.json"), "-o", str(particles)]) == 0
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2] / "tools"), *sys.path])
    check = import_module("verify").main
    capsys.readouterr()
    assert check([str(run), "--futures", str(particles)]) == 0
    assert "last: found_probability" in capsys.readouterr().out
    content = json.loads((run / "plan.json").read_text())
    for name, key in (("first", "expected_detection_time_s"), ("last", "found_probability")):
        told = {"expected_detection_time_s", "found_probability"}  # the particles have no interval
        assert {*content["planned"][name]} == told
        forged = json.loads(json.dumps(content))
        forged["planned"][name][key] *= 0.999
        (tmp_path / "plan.json").write_text(json.dumps(forged))
        shutil.copy(run / RECORD, tmp_path)
        assert check([str(tmp_path), "--futures", str(particles)]) == 1
        (wrong,) = [line for line in capsys.readouterr().out.splitlines() if "WRONG" in line]
        assert wrong.startswith(f"{name}: {key}")
