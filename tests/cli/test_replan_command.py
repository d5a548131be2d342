"""`planner replan` and `planner fly --live`: runs of what is left, and what is refused."""

import json
from pathlib import Path
from typing import Any

import pytest

from planner.cli import live
from support.command_line import Commands

SMALL = ("search.particles=256", "search.work=4000", "search.sampling=sobol")
CHANGES = [word for change in SMALL for word in ("--set", change)]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from planner.cli import main

    folder = tmp_path_factory.mktemp("runs") / "first"
    words = ["plan", "grid5x5", *CHANGES, "--method", "rate", "--targets", "300", "-j", "1"]
    assert main([*words, "-o", str(folder), "--json"]) == 0
    return folder


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


WATCHED = "nothing at r2c2 from 0:00:10 to 0:10:00, 80 %"


def replanned(command: Commands, run: Path, *words: object) -> Any:
    quick = ("--method", "rate", "--targets", 300, "-j", 1, "--force", "--json")
    return command("replan", run, "--at", 650, *words, *quick)


def test_a_run_of_the_rest_names_its_parent_and_is_a_run_like_any(
    command: Commands, run: Path, tmp_path: Path
) -> None:
    said = replanned(command, run, "--report", WATCHED, "-o", tmp_path / "rest").json
    plan = json.loads((tmp_path / "rest" / "plan.json").read_text())
    assert said["parent"] == plan["parent"]
    assert (plan["parent"]["run"], plan["parent"]["at_s"]) == ("first", 650.0)
    assert plan["uavs"][0]["waypoints"][0][0] == 650.0
    heard = json.loads((tmp_path / "rest" / "run.json").read_text())["scenario"]["news"]["heard"]
    assert [one["kind"] for one in heard] == ["nothing", "searched"]
    flown = command("fly", tmp_path / "rest", "--targets", 300, "-j", 1, "--json").json
    assert flown["expected_detection_time_s"] > 650.0
    assert (
        "certify the run that it was planned anew from" in command("certify", tmp_path / "rest").err
    )
    again = replanned(command, tmp_path / "rest", "--at", 700, "-o", tmp_path / "again").json
    assert again["parent"]["run"] == "rest"


def test_the_same_words_give_the_same_plan(command: Commands, run: Path, tmp_path: Path) -> None:
    for name in ("one", "two"):
        assert replanned(command, run, "--delay", 60, "-o", tmp_path / name).code == 0
    one, two = ((tmp_path / name / "plan.json").read_bytes() for name in ("one", "two"))
    assert one == two


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("--report", "hello"), '--report: "hello" is no news that is understood'),
        (("--report", "seen at r5c5 at 10, 70 %"), "only 0.0 % of what is believed is there"),
        (("--searched", "x.gpx"), "--searched: goes with --radius-m"),
        (("--radius-m", 5), "go with --searched"),
        (("--gap", 5), "--gap: goes with --lost-at"),
        (("--same-source", "--report", "seen at r0c0 at 10, 70 %"), "no earlier report"),
        (("--at", "-5"), '--at: "-5" is before the target was last seen; give seconds since then'),
        (("--at", 99999), "the flight is over at"),
        (
            ("--delay", 651),
            "--delay 651: at 0:10:50 the UAV has been at its height for 650 s; give",
        ),
        (("--battery", "0min"), "uav.in_air.left_s: should be greater than 0, not 0; give for how"),
        (("--uav-at", "r1c1", "--at", "1e13"), "uav.in_air.at_s: should be at most"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    command: Commands, run: Path, tmp_path: Path, words: tuple[object, ...], fault: str
) -> None:
    said = replanned(command, run, *words, "-o", tmp_path / "rest")
    assert (said.code, said.out) == (2, "")
    assert fault in said.err
    assert said.err.count("\n") == 1
    assert not (tmp_path / "rest").exists()


def test_a_line_of_a_file_is_named(command: Commands, run: Path, tmp_path: Path) -> None:
    news = tmp_path / "news.jsonl"
    news.write_text('{"kind": "delay", "lasts": 5}\n{"kind": "delay"}\n')
    said = replanned(command, run, "--news", news, "-o", tmp_path / "rest")
    assert f"{news}: line 2: lasts: is missing" in said.err


def test_more_news_than_can_count_is_refused(command: Commands, run: Path, tmp_path: Path) -> None:
    file = tmp_path / "news.jsonl"
    file.write_text('{"kind": "delay", "lasts": 1}\n' * 1001)
    said = replanned(command, run, "--news", file, "-o", tmp_path / "rest")
    assert said.code == 2
    assert said.err.count("\n") == 1
    assert "news.jsonl: has more than 1000 pieces of news" in said.err


def test_news_is_read_while_it_flies(command: Commands, run: Path, tmp_path: Path) -> None:
    news, out = tmp_path / "news.jsonl", tmp_path / "live.jsonl"
    lines = [
        {"kind": "delay", "lasts": 400, "now": 1100},
        {"kind": "delay"},
        {"kind": "found", "now": 1200},
    ]
    news.write_text("".join(json.dumps(line) + "\n" for line in lines))
    said = command("fly", run, "--live", news, "--auto", "-o", out, "-j", 1)
    assert said.code == 0
    assert "the plan there was stands: line 2: lasts: is missing" in said.out
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert rows
    for row in rows:
        assert row["waypoints"][0][0] == row["from_s"] >= 1101.0


def test_nobody_says_yes_and_the_plan_there_was_stands(
    command: Commands, run: Path, tmp_path: Path
) -> None:
    news, out = tmp_path / "news.jsonl", tmp_path / "live.jsonl"
    news.write_text('{"kind": "delay", "lasts": 400, "now": 1100}\n{"kind": "found"}\n')
    said = command("fly", run, "--live", news, "-o", out, "-j", 1)
    assert said.code == 0
    assert "no plan was taken" in said.out
    assert not out.exists()


def test_alarms_are_flown_late_and_anew(command: Commands, run: Path) -> None:
    words = ("--alarms", "1/2000", "--alarm-s", 600, "--sequences", 2, "--targets", 200)
    said = command("fly", run, *words, "-j", 1, "--json").json
    assert said["late_s"] > said["without_alarms_s"]
    assert said["anew_s"] < said["late_s"]


def test_a_lost_target_is_searched_from_where_it_was_lost(
    command: Commands, run: Path, tmp_path: Path
) -> None:
    words = ("--lost-at", "r1c1", "--gap", 100, "-o", tmp_path / "rest")
    said = replanned(command, run, *words).json
    assert said["parent"]["at_s"] == 100.0  # since the loss
    assert 0.0 < said["in_contact"] < 1.0
    plan = json.loads((tmp_path / "rest" / "plan.json").read_text())
    assert plan["uavs"][0]["waypoints"][0][:3] == [100.0, 15000.0, -15000.0]


def test_of_a_file_that_is_written_anew_what_is_new_is_read(tmp_path: Path) -> None:
    news, over = tmp_path / "news.jsonl", []
    news.write_text("one\none\n")
    lines = live._lines(news, lambda: bool(over))
    assert [next(lines), next(lines)] == [(1, "one"), (2, "one")]
    news.write_text("two\none\n\nhalf")
    assert next(lines) == (1, "two")
    news.write_text("one\none\none\n")
    assert next(lines) == (3, "one")
    over.append(True)
    assert [*lines] == []
