"""Planning and bounding by turns: the best of both sides is kept, and no turn is in vain."""

from collections.abc import Sequence

import numpy as np
import pytest

from planner.bounds.certificate import Certificate
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.flight.plan import Plan
from planner.mission.to_gap import MORE, TwoSided, planned_to_gap
from planner.mission.trial import Attempt
from planner.search.plan import plan_of_legs, plan_of_wait
from planner.search.result import SearchResult
from support.search_instances import random_problem

PROBLEM = random_problem(2)
ROADS = plan_of_legs(PROBLEM, "roads", [0, 2])
FREE = plan_of_wait(PROBLEM, "free", 0.0, 0.0)


def trial(value: float, plan: Plan = ROADS, *, by_s: float | None = None) -> Attempt:
    """A trial whose plan has a given figure."""
    seen = np.array([value, value]) if by_s is None else np.array([0.0, np.inf])
    weight = np.array([0.5, 0.5]) if by_s is None else np.array([value, 1.0 - value])
    planned = Evaluation(seen, weight, np.zeros(2), Objective(PROBLEM.horizon_s, by_s))
    return Attempt(
        method="",
        sensor=PROBLEM.sensor,
        result=SearchResult(plan),
        planned=planned,
        took_s=0.0,
        work_allowed=0,
    )


class Hands:
    """Plans and bounds in the order given, and what was asked for."""

    def __init__(self, trials: Sequence[Attempt], bounds: Sequence[float | None]) -> None:
        self.trials, self.bounds, self.more = list(trials), list(bounds), list[int]()
        self.value = np.nan
        self.better: dict[float, Attempt] = {}  # what bounding meets, by the bound

    def plan(self, more: int, _: float) -> Attempt:
        self.more.append(more)
        made = self.trials.pop(0)
        self.value = made.planned.figure
        return made

    def bound(self, plan: Plan, _: float) -> Certificate | None:
        bound = self.bounds.pop(0)
        kind = "roads" if plan.legs[0] else "free"
        met = (3,) if bound in self.better else ()
        self.met = self.better.get(bound or 0.0)
        return bound and Certificate(self.value, bound, kind, better=met)

    def fly(self, order: Sequence[int], _: Attempt) -> Attempt:
        assert self.met is not None
        assert list(order) == [3]
        return self.met

    def found(self, gap: float, **more: object) -> tuple[Attempt, Certificate | None]:
        found = planned_to_gap(TwoSided(self.plan, self.bound, self.fly), gap, **more)
        assert (self.trials, self.bounds) == ([], [])
        return found


def test_a_gap_reached_ends_it() -> None:
    hands = Hands([trial(500.0)], [460.0])
    _, certificate = hands.found(0.1)
    assert certificate is not None
    assert certificate.gap == pytest.approx(40.0 / 460.0)
    assert hands.more == [1]


@pytest.mark.parametrize(("met", "kept"), [(440.0, 440.0), (520.0, 500.0)])
def test_a_better_plan_that_bounding_meets_is_taken(met: float, kept: float) -> None:
    hands = Hands([trial(500.0), trial(600.0)], [400.0])
    hands.better = {400.0: trial(met)}
    found, certificate = planned_to_gap(TwoSided(hands.plan, hands.bound, hands.fly), 0.1)
    assert certificate is not None
    assert (found.planned.figure, certificate.value) == (kept, kept)
    assert hands.more == [1] if kept == met else [1, 8]


def test_a_plan_near_enough_stays() -> None:
    hands = Hands([trial(500.0)], [460.0])
    hands.better = {460.0: trial(480.0)}
    found, _ = hands.found(0.1)
    assert found.planned.figure == 500.0


@pytest.mark.parametrize(("second", "kept"), [(410.0, 410.0), (400.0, 410.0)])
def test_a_better_plan_takes_the_better_bound(second: float, kept: float) -> None:
    hands = Hands([trial(500.0), trial(490.0)], [410.0, second])
    made, certificate = hands.found(0.1)
    assert certificate is not None
    assert (made.planned.figure, certificate.value, certificate.bound) == (490.0, 490.0, kept)
    assert hands.more == [1, MORE]


def test_a_better_plan_may_be_enough() -> None:
    hands = Hands([trial(500.0), trial(440.0)], [410.0])
    _, certificate = hands.found(0.1)
    assert certificate is not None
    assert (certificate.value, certificate.bound) == (440.0, 410.0)


def test_a_worse_plan_changes_nothing() -> None:
    first = trial(500.0)
    hands = Hands([first, trial(510.0)], [410.0])
    made, certificate = hands.found(0.1)
    assert made is first
    assert certificate is not None
    assert (certificate.value, certificate.bound) == (500.0, 410.0)


def test_for_a_probability_more_is_better() -> None:
    hands = Hands([trial(0.5, by_s=9.0), trial(0.6, by_s=9.0)], [0.9, 0.8])
    made, certificate = hands.found(0.1)
    assert certificate is not None
    assert (made.planned.figure, certificate.value, certificate.bound) == (0.6, 0.6, 0.8)


def test_a_bound_for_roads_is_none_for_flights() -> None:
    hands = Hands([trial(500.0), trial(450.0, FREE)], [410.0, 100.0, 100.0])
    _, certificate = hands.found(0.1)
    assert certificate is not None
    assert (certificate.plan_class, certificate.bound) == ("free", 100.0)


def test_one_turn_where_more_work_changes_nothing() -> None:
    hands = Hands([trial(500.0)], [410.0])
    assert hands.found(0.1, again=False)[1] is not None


def test_without_a_bound_there_is_still_a_plan() -> None:
    first = trial(500.0)
    assert Hands([first], [None]).found(0.1) == (first, None)


def test_no_time_still_gives_both() -> None:
    made, certificate = Hands([trial(500.0)], [410.0]).found(0.1, seconds=0.0)
    assert made.planned.figure == 500.0
    assert certificate is not None


def test_whoever_asks_gets_the_best_so_far() -> None:
    hands = Hands([trial(500.0)], [410.0])
    found = planned_to_gap(
        TwoSided(hands.plan, hands.bound, hands.fly, lambda: not hands.bounds), 0.1
    )
    assert found[1] is not None
    assert not hands.trials


def test_figures_of_evaluations() -> None:
    problem = PROBLEM.replace(objective=Objective(PROBLEM.horizon_s, 600.0))
    for one in (PROBLEM, problem):
        made = evaluate(ROADS.tracks, one.futures, one.sensor, one.objective)
        seen, weight = made.seen_at, made.weight
        expected = float(weight @ np.minimum(seen, one.horizon_s))
        assert made.figure == pytest.approx(
            expected if one.objective.by_s is None else float(weight[seen <= 600.0].sum())
        )
