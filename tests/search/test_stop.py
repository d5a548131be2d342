"""Rules that end a search, and what a search that was ended tells of itself."""

import numpy as np
import pytest

from planner.search.beam import beam
from planner.search.best import best
from planner.search.lns import lns
from planner.search.problem import Budget
from planner.search.stop import NEVER, AnyOf, Asked, Elapsed, WorkDone
from planner.streams import stream
from support.search_instances import random_problem


def test_rules() -> None:
    assert [WorkDone(10)(work) for work in (0, 9, 10, 11)] == [False, False, True, True]
    assert Elapsed(-1.0)(0)
    assert not Elapsed(1e6)(0)
    assert not Elapsed(np.inf)(0)
    assert Asked(lambda: True)(0)
    assert not Asked(lambda: False)(0)
    assert not NEVER(10**12)


def test_any_of_several_rules_ends_a_search() -> None:
    rules = AnyOf(WorkDone(10), Asked(lambda: False))
    assert [rules(work) for work in (9, 10)] == [False, True]


def test_a_time_begins_when_its_rule_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = [100.0]
    monkeypatch.setattr("planner.search.stop.time.monotonic", lambda: now_s[0])
    rule = Elapsed(5.0)
    assert not rule(0)
    now_s[0] = 105.1
    assert rule(0)


@pytest.mark.parametrize("planner", [beam, best, lns])
def test_the_trace_grows_with_the_work_and_only_gets_better(planner: object) -> None:
    problem = random_problem(2, particles=60)
    found = planner(problem, budget=Budget(work=20_000), rng=stream(1, "p"))
    assert not found.stopped
    work = [point.work for point in found.trace]
    values = [point.value for point in found.trace]
    assert work == sorted(work)
    assert len(work) > 0
    assert work[-1] <= found.work
    assert values == sorted(values, reverse=True)


def test_a_budget_s_part_reports_to_the_whole() -> None:
    heard: list[tuple[int, int, str]] = []
    whole = Budget(work=100, free=True, on_progress=lambda *progress: heard.append(progress))
    part = whole.part(40, after=60)
    part.on_progress(10, 40, "so far")
    assert (part.work, part.free) == (40, False)
    assert heard == [(70, 100, "so far")]
