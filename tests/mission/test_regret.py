"""Regrets: none of a plan under its own belief, and what others cost is told."""

import pytest

from planner.errors import InputError
from planner.futures.store import Recording
from planner.mission.opening import open_scenario
from planner.mission.recorder import Recorder
from planner.mission.regret import Regrets, regrets
from planner.search.methods import method_named

MIX = 'target.mix=[{ weight = 1, start = ["r0c0-r0c1"] }, { weight = 1, start = ["r0c0-r1c0"] }]'
SMALL = ("search.particles=100", "search.targets=100", "search.work=1000")


def test_a_plan_regrets_nothing_under_its_own_belief() -> None:
    table = Regrets(("1", "2", "all"), ("1", "2"), ((10.0, 30.0), (20.0, 15.0), (11.0, 18.0)), True)
    assert table.regret == ((0.0, 1.0), (1.0, 0.0), (pytest.approx(0.1), pytest.approx(0.2)))
    assert table.worst == (1.0, 1.0, pytest.approx(0.2))
    found = Regrets(("1", "all"), ("1",), ((0.9,), (0.8,)), is_time=False)
    assert found.worst == (0.0, pytest.approx(0.1))


def test_each_belief_is_planned_for_and_judged_under_each() -> None:
    recorder = Recorder(open_scenario("grid5x5", overrides=(MIX, *SMALL)), workers=1)
    told: list[tuple[int, int, str]] = []
    found = regrets(recorder, method_named("rate"), lambda *said: told.append((*said, "")[:3]))
    assert [done for done, _, _ in told] == [0, 1, 2, 3, 4, 5]
    assert {total for _, total, _ in told} == {5}
    assert told[3][2] == "all plans if 1 is true"
    assert found.planned_for == ("1", "2", "all of them")
    assert found.beliefs == (
        '50 %, start = { "r0c0-r0c1" = 1.0 }',
        '50 %, start = { "r0c0-r1c0" = 1.0 }',
    )
    assert all(len(row) == 2 for row in found.figure)
    assert found.regret[0][1] > 0.1  # it is looked for on the other side of the diagonal
    assert found.regret[1][0] > 0.1


def test_plans_are_judged_on_as_many_targets_as_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int | None] = []
    evaluation = Recorder.evaluation

    def counting(self: Recorder, targets: int | None = None) -> Recording:
        asked.append(targets)
        return evaluation(self, targets)

    monkeypatch.setattr(Recorder, "evaluation", counting)
    recorder = Recorder(open_scenario("grid5x5", overrides=(MIX, *SMALL)), workers=1)
    regrets(recorder, method_named("rate"), targets=30)
    assert asked == [30, 30]


def test_one_belief_alone_is_refused() -> None:
    with pytest.raises(InputError, match=r"target\.mix: is not given"):
        regrets(Recorder(open_scenario("grid5x5"), workers=1), method_named("rate"))
