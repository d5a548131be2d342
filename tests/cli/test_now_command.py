"""`planner new` and `planner now`: words in, a scenario or a run out, the same plan again."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from planner.cli import now as command
from planner.cli import planning
from planner.mission import now, now_events
from planner.mission.now_events import Rung
from planner.mission.run_folder import PAGE, RUN
from planner.page.document import AGAIN
from planner.report import call_screen
from planner.scenario.source import FILE
from support.command_line import TOWN, Commands

WORDS = (TOWN, "--last-seen", "n", "--at", "-1min", "--drone-at", "nw", "--target", "joyride")
LEAST = {"page.html", "plan.json", "plan.png", "run.json", FILE}


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Commands:
    monkeypatch.setattr(now_events, "RUNGS", (Rung(6, 200, 8), Rung(12, 400, 16)))
    monkeypatch.setattr(now, "OTHERS", 4)
    return Commands(capsys)


def test_new_writes_a_scenario_and_echoes_the_words(run: Commands, tmp_path: Path) -> None:
    file = tmp_path / "call.toml"
    said = run("new", *WORDS, "--radius-m", "50", "-o", file)
    assert (said.code, said.err) == (0, "")
    assert "last seen  node n: x 210 m, y 410 m, within 50 m\n" in said.out
    unwrapped = "".join(said.out.split())  # a long path breaks anywhere
    assert f"writtento{file}" in unwrapped
    assert f"plannerplan{file}" in unwrapped
    before = file.read_bytes()
    refused = run("new", *WORDS, "-o", file)
    assert refused.code == 2
    assert "already exists; name another file, or --force" in refused.err
    assert file.read_bytes() == before
    assert run("new", *WORDS, "-o", file, "--force", "--json").json["file"] == str(file)
    assert run("check", file).code == 0


@pytest.mark.parametrize("name", ["new", "now"])
def test_wrong_words_are_told_a_line_each_and_leave_nothing(
    name: str, run: Commands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["m" if word == "n" else "soon" if word == "-1min" else word for word in WORDS]
    said = run(name, *words)
    assert said.code == 2
    lines = said.err.splitlines()
    assert [line.split(": ")[2] for line in lines] == ["--last-seen", "--at"]
    assert all("write" in line or "give" in line for line in lines)
    said = run(name, *WORDS, "--battery", "1min")
    assert said.code == 2
    assert "--battery: 60 s leaves no time to search" in said.err
    mine = Path("mine.toml")
    mine.write_text('goes = "leaves"\nstops = 3\n', encoding="utf-8")
    said = run(name, *WORDS[:-1], mine)
    assert said.code == 2
    assert f"{TOWN}: --target (target.stops): " in said.err  # of a file, which has keys
    mine.unlink()
    said = run(name, *WORDS, "--drone-at", "99999999,0")
    assert said.code == 2
    assert '--drone-at "99999999,0": lies 99' in said.err  # which of the two
    assert list(tmp_path.rglob("*")) == []


def test_a_plan_for_a_take_off_that_has_passed_says_so() -> None:
    called_at = datetime(2026, 5, 1, 14, 0, tzinfo=UTC)
    call = SimpleNamespace(called_at=called_at, tables={"target": {"last_seen_ago_s": 60.0}})
    plan: Any = SimpleNamespace(take_off_s=30.0, call=call)
    plan.opened = SimpleNamespace(scenario=SimpleNamespace(take_off_s=90.0))
    on_time = call_screen.done_line(now_events.Done(29.0, plan, stopped=False))
    assert on_time == "the best plan takes off 14:00:30"
    late = call_screen.done_line(now_events.Done(54.0, plan, stopped=True))
    assert late == (
        "stopped: the best plan so far takes off 14:00:30, 24 s ago: fly now, or call again for a "
        "later one"
    )


def test_a_better_plan_tells_that_an_earlier_one_was_exported(
    run: Commands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, gpx = tmp_path / "run", tmp_path / "run" / "flight" / "flight.gpx"
    monkeypatch.setattr(now, "_is_better", lambda *_: True)
    write_event = planning.write_event

    def exported(new: Path, *rest: Any) -> None:
        write_event(new, *rest)
        gpx.parent.mkdir(exist_ok=True)
        gpx.touch()

    monkeypatch.setattr(planning, "write_event", exported)
    said = run("now", *WORDS, "--until", "+9min", "-o", folder)
    assert "is of an earlier plan; export again:" in said.out
    assert f"planner export {folder} --force" in "".join(said.out.split("\n"))
    assert gpx.is_file()


def test_now_leaves_a_run_whose_scenario_gives_the_same_plan(run: Commands, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    said = run("now", *WORDS, "--until", "+9min", "-o", folder, "-j", "1")
    assert (said.code, said.err) == (0, "")
    assert max(len(line) for line in said.out.splitlines() if str(folder) not in line) <= 79
    assert "export again" not in said.out
    since = re.findall(r"^ *(\d+):(\d\d)  (\S+ \S+)", said.out, re.MULTILINE)
    begins = [words for _, _, words in since]
    assert begins[0] == "where it"
    assert begins[1] == "first plan"
    assert begins[-2:] == ["what the", "the best"]
    names = {file.name for file in folder.iterdir()}
    assert LEAST <= names <= {*RUN, FILE}
    again = tmp_path / "again"
    assert run("plan", folder, "-o", again).code == 0
    assert {file.name for file in again.iterdir()} == names - {FILE}
    for name in names - {FILE, "run.json"}:
        assert (again / name).read_bytes() == (folder / name).read_bytes(), name
    taken = run("now", *WORDS, "-o", folder)
    assert taken.code == 2
    assert "already; --force overwrites it, or choose another folder" in taken.err


def test_a_key_ends_with_the_best_plan(
    run: Commands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def pressed() -> Iterator[Callable[[], bool]]:
        yield lambda: True

    monkeypatch.setattr(command, "_key_pressed", pressed)
    settle = command._settle
    monkeypatch.setattr(command, "_settle", lambda _: None)
    monkeypatch.setattr(now_events, "RUNGS", (Rung(6, 200, 8), Rung(13, 400, 17)))
    said = run("now", *WORDS, "--until", "+9min", "-o", tmp_path / "run", "--json")
    assert said.json["stopped"]
    assert said.json["plans"] == 1
    page = tmp_path / "run" / PAGE
    assert AGAIN in page.read_text(encoding="utf-8")  # not settled yet
    settle(tmp_path / "run")
    assert AGAIN not in page.read_text(encoding="utf-8")
    told = run("now", *WORDS, "--until", "+9min", "-o", tmp_path / "run", "--events", "--force")
    events = [json.loads(line) for line in told.out.splitlines()]
    assert AGAIN not in page.read_text(encoding="utf-8")  # programs are told
    assert events[0]["said"][0] == said.json["understood"][0]
    kinds = [event["event"] for event in events if event["event"] != "progress"]
    assert kinds == ["understood", "cloud", "plan", "done"]
    assert events[-1]["text"].startswith("stopped: the best plan so far takes off")
    (plan,) = (event for event in events if event["event"] == "plan")
    assert plan["screen"][0].startswith("found by")
    assert {file.name for file in (tmp_path / "run").iterdir()} >= LEAST
