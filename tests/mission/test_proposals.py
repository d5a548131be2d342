"""Particles by the clock, that planners search on before SUMO's recordings choose."""

import numpy as np
import pytest

from planner.futures.futures import Futures
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.planning import budget_of, make_plan
from planner.mission.recorder import Recorder
from planner.search import dashes
from planner.search.methods import method_named
from planner.search.problem import Problem
from support.command_line import TOWN

FEW = ["search.particles=12", "search.horizon_s=300", "search.work=2000"]
SURE = (
    'search.sampling="all"',
    "target.distance_m={constant=10}",
    "target.speed_mps={constant=10}",
)


def opened(*overrides: str, place: object = TOWN) -> OpenScenario:
    return open_scenario(str(place), overrides=[*FEW, *overrides])


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("planner.mission.recorder.PROPOSALS", 60)


def test_towns_may_be_searched_off_the_roads_unless_the_scenario_says_otherwise() -> None:
    roads_only = "sensor.detects_in_transit=false"
    for free, one in (
        (False, opened(place="figure3")),
        (True, opened("search.free=true", place="figure3")),
        (True, opened()),
        (False, opened("search.free=false")),
        (False, opened(roads_only)),
    ):
        assert budget_of(one).free == free


@pytest.mark.usefixtures("few")
def test_proposals_are_drawn_from_the_belief_by_a_stream_of_their_own() -> None:
    recorder = Recorder(opened(), 1)
    planning = recorder.planning().futures
    found, again = (recorder.proposals(planning) for _ in range(2))
    assert found is not None
    assert again is not None
    assert len(found) == 60
    assert np.array_equal(found.x_m, again.x_m)
    assert found.weight.sum() == pytest.approx(1.0)
    first = [one.x_m[one.first_knot[:-1]] for one in (found, planning)]
    assert not np.isin(first[0], first[1]).any()
    assert Recorder(opened(place="figure3"), 1).proposals(planning) is None
    assert Recorder(opened(*SURE), 1).proposals(planning) is None


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    ("name", "option", "holdout", "proposed"),
    [
        ("best", "search.free=true", True, 60),
        ("best", "search.free=false", True, None),
        ("cells", "search.free=false", True, 60),
        ("cells", "search.free=true", False, None),  # the futures may be anyone's
    ],
)
def test_methods_that_leave_the_roads_search_on_proposals(
    name: str, option: str, holdout: bool, proposed: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int | None] = []

    def spy(problem: Problem, work: int, **options: object) -> object:
        asked.append(None if problem.proposals is None else len(problem.proposals))
        return dashes.portfolio(problem, work, **options)

    for module in ("best", "cell_beam"):
        monkeypatch.setattr(f"planner.search.{module}.portfolio", spy)
    scenario, method = opened(option), method_named(name)
    recorder = Recorder(scenario, 1)
    futures: Futures = recorder.planning().futures
    others = recorder.holdout().futures if holdout else None
    result = make_plan(method, scenario, recorder, futures, holdout=others)
    assert asked == ([] if option.endswith("false") and name == "best" else [proposed])
    assert result.plan.method == name
