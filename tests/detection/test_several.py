"""The first and the last find of several targets, against twins that are slow and obvious."""

from itertools import product

import numpy as np
import pytest

from planner.arrays import Floats
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.detection.several import find_of, first_and_last
from planner.detection.survival import Survival

HORIZON_S = 1000.0


def seen(by_s: float | None = None, present: tuple[float, ...] = (1.0, 0.7)) -> Evaluation:
    """Return a few possible times of each target, some never, some weights 0."""
    rng = np.random.default_rng(len(present))
    rows = 5 + np.arange(len(present))
    target = np.repeat(np.arange(len(present)), rows)
    seen_at = rng.uniform(0.0, 1.4 * HORIZON_S, len(target)).round(-1)
    seen_at[::4] = np.inf
    weight = rng.uniform(0.1, 1.0, len(target))
    weight *= (np.array(present) / np.bincount(target, weight))[target]
    objective = Objective(HORIZON_S, by_s, sought=len(present))
    end_s = np.full(len(target), HORIZON_S)
    return Evaluation(seen_at, weight, end_s, objective, target=target)


def missed(many: int = 40) -> Evaluation:
    """Return targets that contacts find with some probability."""
    rng = np.random.default_rng(3)
    starts = np.sort(rng.uniform(0.0, HORIZON_S, (many, 3)), axis=1)
    ends = starts + rng.uniform(0.1, 1.0, starts.shape) * np.diff(
        np.append(starts, np.full((many, 1), 1.1 * HORIZON_S), axis=1), axis=1
    )
    rate = rng.uniform(0.0, 0.02, starts.shape)
    left = np.exp(-np.cumsum(rate * (ends - starts), axis=1))
    before = np.append(np.ones((many, 1)), left[:, :-1], axis=1)
    survival = Survival(
        np.arange(0, 6 * many + 1, 6),
        np.stack([starts, ends], axis=2).ravel(),
        np.stack([before, left], axis=2).ravel(),
        np.stack([rate, np.zeros_like(rate)], axis=2).ravel(),
    )
    weight = np.where(np.arange(many) % 2, 0.8, 1.0) / (many // 2)
    objective = Objective(HORIZON_S, 600.0, sought=2)
    never = np.full(many, np.inf)
    return Evaluation(never, weight, never, objective, survival, target=np.arange(many) % 2)


def outcomes(evaluation: Evaluation) -> list[tuple[float, list[float]]]:
    """Return all that can happen: its probability, and when each target is found."""
    each = []
    for target in np.unique(evaluation.target):
        rows = evaluation.target == target
        times = [*evaluation.seen_at[rows], np.inf]
        shares = [*evaluation.weight[rows], 1.0 - evaluation.weight[rows].sum()]
        each.append([*zip(shares, times, strict=True)])
    return [
        (float(np.prod([share for share, _ in one])), [time for _, time in one])
        for one in product(*each)
    ]


@pytest.mark.parametrize("present", [(1.0, 0.7), (0.9, 0.5, 1.0)])
def test_first_and_last_are_those_of_all_that_can_happen(present: tuple[float, ...]) -> None:
    evaluation, by_s = seen(600.0, present), 600.0
    for find, of in zip(first_and_last(evaluation), (min, max), strict=True):
        could = [(share, of(times)) for share, times in outcomes(evaluation)]
        expected_s = sum(share * min(time, HORIZON_S) for share, time in could)
        assert find.expected_s == pytest.approx(expected_s, rel=1e-9)
        by = sum(share for share, time in could if time <= by_s)
        assert find.probability == pytest.approx(by, abs=1e-12)
        assert find.ci95_s[0] < find.expected_s < find.ci95_s[1]


def test_with_misses_they_are_integrals_of_what_is_unseen() -> None:
    evaluation = missed()
    times_s = (np.arange(20_000) + 0.5) * HORIZON_S / 20_000
    unseen = [curve(one, times_s) for one in evaluation.each.values()]
    first, last = first_and_last(evaluation)
    assert first.expected_s == pytest.approx((unseen[0] * unseen[1]).mean() * HORIZON_S, rel=1e-6)
    apart = 1.0 - (1.0 - unseen[0]) * (1.0 - unseen[1])
    assert last.expected_s == pytest.approx(apart.mean() * HORIZON_S, rel=1e-6)
    by = [one.found_by_probability(600.0) for one in evaluation.each.values()]
    assert last.probability == pytest.approx(by[0] * by[1])
    assert first.probability == pytest.approx(1.0 - (1.0 - by[0]) * (1.0 - by[1]))


def curve(one: Evaluation, times_s: Floats) -> Floats:
    assert one.survival is not None
    return np.array([1.0 - one.weight @ (1.0 - one.survival.at(t)) for t in times_s.tolist()])


@pytest.mark.parametrize("evaluation", [seen(), seen(600.0, (0.9, 0.5, 1.0)), missed()])
def test_the_sum_is_that_of_each_target(evaluation: Evaluation) -> None:
    each = [*map(find_of, evaluation.each.values())]
    total_s = sum(one.expected_s for one in each)
    assert evaluation.expected_detection_time_s == pytest.approx(total_s)
    first, last = first_and_last(evaluation)
    assert first.expected_s <= min(one.expected_s for one in each)
    assert last.expected_s >= max(one.expected_s for one in each)
    if len(each) == 2:  # the earlier and the later of two times are these two
        assert first.expected_s + last.expected_s == pytest.approx(total_s)
    low_s, high_s = evaluation.ci95_s
    assert low_s < total_s < high_s
    reward = float(evaluation.weight @ evaluation.reward)
    assert evaluation.objective.value(reward) == pytest.approx(evaluation.figure)


def test_one_that_nothing_is_left_of_is_never_found() -> None:
    whole = seen()
    alone = whole.of_those(whole.target == 0)  # news has ruled out all of the other one
    first, last = first_and_last(alone)
    assert first.expected_s == pytest.approx(whole.each[0].expected_detection_time_s)
    assert (last.expected_s, last.probability) == (HORIZON_S, 0.0)
    assert alone.expected_detection_time_s == pytest.approx(first.expected_s + HORIZON_S)


def test_a_single_draw_of_each_tells_nothing() -> None:
    seen_at = np.array([300.0, 500.0])
    objective = Objective(HORIZON_S, sought=2)
    found = Evaluation(seen_at, np.ones(2), seen_at, objective, target=np.array([0, 1]))
    for find in first_and_last(found):
        assert find.ci95_s == (0.0, HORIZON_S)
        low, high = find.interval
        assert 0.0 <= low < find.probability <= high <= 1.0


def test_intervals_hold_what_they_say() -> None:
    """Of many small samples, about 95 % have the true figures of both finds within."""
    rng = np.random.default_rng(5)
    scale = np.array([300.0, 500.0])
    rates = 1.0 / scale
    true = {"first": 1.0 / rates.sum()}
    true["last"] = float(scale.sum() - true["first"])
    held = np.zeros(2)
    for _ in range(200):
        times = rng.exponential(scale[:, None], (2, 60)).ravel()
        target = np.repeat([0, 1], 60)
        found = Evaluation(
            times, np.full(120, 1 / 60), times, Objective(1e5, sought=2), target=target
        )
        for k, (find, name) in enumerate(zip(first_and_last(found), true, strict=True)):
            held[k] += find.ci95_s[0] <= true[name] <= find.ci95_s[1]
    assert (held >= 180).all(), held
