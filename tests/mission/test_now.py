"""A call planned while a clock of the test's own runs, on a small net with little work."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from planner.mission import now
from planner.mission.call import Call, understood
from planner.mission.call_words import Words
from planner.mission.now import events
from planner.mission.now_events import (
    BetterPlan,
    Cloud,
    Done,
    Event,
    FirstPlan,
    How,
    NoBetter,
    Outlook,
    Rung,
)
from planner.mission.opening import open_scenario
from planner.mission.recorder import Recorder
from planner.report import call_screen
from support.command_line import TOWN

NOW = datetime(2026, 5, 1, 14, 7, 30, tzinfo=UTC)
RUNGS = (Rung(6, 200, 8), Rung(12, 400, 16))


@pytest.fixture
def little(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(now, "OTHERS", 4)


@pytest.fixture
def call() -> Call:
    return understood(Words(TOWN, "n", "-1min", ("nw", "se"), until="+8min", target="joyride"), NOW)


def steps(step_s: float) -> Callable[[], float]:
    """A clock that goes on by so much each time it is read."""
    times = count(1)
    return lambda: step_s * next(times)


def planned(call: Call, folder: Path, how: How) -> Iterator[Event]:
    file = folder / "scenario.toml"
    file.write_text(call.text(), encoding="utf-8")
    return events(call, file, how)


def test_events_come_in_their_order(little: None, call: Call, tmp_path: Path) -> None:
    seen = list(planned(call, tmp_path, How(steps(1.0), workers=1, rungs=RUNGS)))
    cloud, first, second, outlook, done = seen
    assert isinstance(cloud, Cloud)
    assert cloud.guess is not None
    assert type(first) is FirstPlan
    assert isinstance(second, BetterPlan | NoBetter)
    assert isinstance(outlook, Outlook)
    assert isinstance(done, Done)
    assert [one.elapsed_s for one in seen] == sorted(one.elapsed_s for one in seen)
    assert done.plan is outlook.plan is (second if isinstance(second, BetterPlan) else first)
    assert not done.stopped
    assert (len(first.planning.futures), len(first.fresh.futures)) == (6, 8)
    assert [name for name, _ in first.sites] == ["node nw", "node se"]
    # Planning is charged: the drone takes off once the plan is there.
    assert first.elapsed_s <= first.take_off_s == first.opened.scenario.uav.take_off_s
    assert first.take_off_s % now.EVERY_S == 0.0
    assert first.trial.plan.take_off_s == first.take_off_s + 60.0
    assert [one.name for one in outlook.conditions] == ["it drives", "it parked"]
    assert outlook.unknowns == ()  # so few targets tell nothing beyond chance
    lines = [*call_screen.screen(outlook.plan, outlook)]
    assert max(map(len, lines)) <= call_screen.WIDTH
    assert lines[0].startswith("found by 14:1")
    assert "(if it drives " in lines[0]
    starts = ["found by", "first leg:", "launch from:", "instead: ", "how sure:"]
    order = [next(k for k, line in enumerate(lines) if line.startswith(s)) for s in starts]
    assert order == sorted(order)


def test_the_scenario_of_a_plan_holds_what_it_came_to(
    little: None, call: Call, tmp_path: Path
) -> None:
    how = How(steps(1.0), workers=1, rungs=RUNGS[:1])
    (first,) = (one for one in planned(call, tmp_path, how) if isinstance(one, FirstPlan))
    left = tmp_path / "left.toml"
    left.write_text(first.call.text(), encoding="utf-8")
    again, planned_for = open_scenario(left).scenario, first.opened.scenario
    assert replace(again, path=planned_for.path) == planned_for
    assert (again.search.particles, again.search.work, again.search.targets) == RUNGS[0]
    recorder = Recorder(open_scenario(left), 1, lambda *_: pytest.fail("recorded again"))
    assert recorder.planning().path == first.planning.path
    assert recorder.evaluation().path == first.fresh.path
    assert first.holdout is not None
    np.testing.assert_array_equal(recorder.holdout().futures.x_m, first.holdout.x_m)


def test_a_search_that_takes_too_long_is_made_again_for_a_later_take_off(
    little: None, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    take_offs: list[float] = []
    attempted = now.attempted

    def noted(method: object, recorder: now.Recorder, *rest: object, **more: object) -> object:
        take_offs.append(recorder.opened.scenario.uav.take_off_s)
        return attempted(method, recorder, *rest, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(now, "attempted", noted)
    one_site = replace(call, sites=call.sites[:1])
    seen = planned(one_site, tmp_path, How(steps(20.0), workers=1, rungs=RUNGS[:1]))
    first = next(one for one in seen if isinstance(one, FirstPlan))
    early, late = take_offs
    assert early < first.elapsed_s <= late == first.take_off_s


def test_a_drone_that_is_ready_later_waits_and_a_heading_may_be_wrong(
    little: None, tmp_path: Path
) -> None:
    words = Words(TOWN, "n", "-1min", ("nw",), heading="E", target="joyride", ready="+200s")
    seen = planned(understood(words, NOW), tmp_path, How(steps(1.0), workers=1, rungs=RUNGS[:1]))
    _, first, outlook, _ = seen
    assert isinstance(first, FirstPlan)
    assert first.take_off_s == 200.0
    assert isinstance(outlook, Outlook)
    names = [one.name for one in outlook.conditions]
    assert names == ["it drives", "it parked", "the heading is wrong"]


def test_who_asks_gets_the_best_so_far(little: None, call: Call, tmp_path: Path) -> None:
    how = How(steps(1.0), stop=lambda: True, workers=1, rungs=(RUNGS[0], Rung(13, 300, 17)))
    seen = list(planned(call, tmp_path, how))
    assert [type(one) for one in seen] == [Cloud, FirstPlan, Done]
    assert isinstance(seen[-1], Done)
    assert seen[-1].plan is seen[1]
    assert seen[-1].stopped


def test_no_plan_is_made_for_a_search_that_is_over(
    little: None, call: Call, tmp_path: Path
) -> None:
    ends = replace(call).changed(search={"horizon_s": 120.0})
    seen = list(planned(ends, tmp_path, How(steps(4.0), workers=1, rungs=(RUNGS[0],) * 3)))
    assert isinstance(seen[-1], Done)
    assert len([one for one in seen if isinstance(one, FirstPlan | NoBetter)]) < 3
