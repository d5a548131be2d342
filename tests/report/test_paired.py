"""How far one plan is ahead of another on the same targets."""

from dataclasses import replace

import numpy as np
import pytest

from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.report.paired import against_patterns, ahead
from planner.report.tables import MethodRow


def evaluation(
    seen_at: list[float], *, by_s: float | None = None, present: float = 1.0
) -> Evaluation:
    n = len(seen_at)
    return Evaluation(
        np.array(seen_at), np.full(n, present / n), np.full(n, 1e3), Objective(1e3, by_s)
    )


def test_a_constant_lead_has_hardly_a_width() -> None:
    seen_s = np.random.default_rng(4).uniform(100, 900, 500)
    lead = ahead(evaluation((0.8 * seen_s).tolist()), evaluation(seen_s.tolist()))
    assert lead.share == pytest.approx(0.2)
    assert lead.low == pytest.approx(0.2, abs=1e-9)
    assert lead.high == pytest.approx(0.2, abs=1e-9)


@pytest.mark.parametrize("by_s", [None, 500.0])
@pytest.mark.parametrize("present", [1.0, 0.6])
def test_the_interval_holds_the_truth_nineteen_times_in_twenty(
    by_s: float | None, present: float
) -> None:
    rng = np.random.default_rng(5)

    def drawn(many: int) -> tuple[Evaluation, Evaluation]:
        hard_s = rng.exponential(400.0, many)
        one, other = (hard_s * rng.uniform(low, 1.4, many) for low in (0.4, 0.8))
        return tuple(evaluation(s.tolist(), by_s=by_s, present=present) for s in (one, other))

    truth = ahead(*drawn(400_000)).share
    leads = [ahead(*drawn(200)) for _ in range(400)]
    held = np.mean([lead.low <= truth <= lead.high for lead in leads])
    assert 0.92 <= held <= 0.98
    # Unpaired, it would be far wider.
    one, other = drawn(200)
    if by_s is None:
        apart = np.hypot(*(np.ptp(e.ci95_s) / 2 for e in (one, other)))
        lead = ahead(one, other)
        assert lead.high - lead.low < 0.7 * 2 * apart / other.expected_detection_time_s


def test_best_is_held_against_the_best_of_the_patterns() -> None:
    fast, slow, slower = ([100.0 + k, 300.0 + k] for k in (0.0, 100.0, 200.0))
    rows = [
        MethodRow("best", evaluated=evaluation(fast * 20)),
        MethodRow("beam", evaluated=evaluation(fast * 20)),
        MethodRow("hover", why_not="the sensor only looks along roads"),
        MethodRow("spiral", evaluated=evaluation(slower * 20)),
        MethodRow("sector", evaluated=evaluation(slow * 20)),
        MethodRow("wait", evaluated=evaluation(fast * 20)),
    ]
    said = against_patterns(rows)
    assert said is not None
    assert said.startswith("best: 33.3 % sooner than the best tuned pattern, sector (95 %: ")
    assert said.endswith(", paired)")
    assert against_patterns(rows[:3]) is None
    assert against_patterns(rows[1:]) is None
    worse = [MethodRow("best", evaluated=evaluation(slower * 20)), rows[4]]
    said = against_patterns(worse)
    assert said is not None
    assert said.startswith("best: 33.3 % later than the best tuned pattern, sector (95 %: ")
    low, high = map(float, said.split("(95 %: ")[1].split(",")[0].split(" .. "))
    assert low < 33.3 < high


def test_of_several_targets_a_deadline_counts_them() -> None:
    def of_two(seen_at: list[float]) -> Evaluation:
        one, many = evaluation(seen_at), len(seen_at)
        objective, target = Objective(1e3, 600.0, sought=2), np.arange(many) % 2
        return Evaluation(one.seen_at, np.full(many, 2 / many), one.end_s, objective, target=target)

    rows = [
        MethodRow("best", evaluated=of_two([100.0, 200.0, 300.0, 900.0])),
        MethodRow("hover", evaluated=of_two([100.0, 700.0, 800.0, 900.0])),
    ]
    said = against_patterns(rows)
    assert said is not None
    assert said.startswith("best: by 0:10:00 it finds 1.00 more of the 2 targets than the best ")


def test_too_few_targets_tell_nothing() -> None:
    lead = ahead(evaluation([100.0]), evaluation([200.0]))
    assert lead.share == pytest.approx(0.5)
    assert not lead.is_known


def test_with_a_deadline_it_is_points() -> None:
    rows = [
        MethodRow("best", evaluated=evaluation([100.0, 200.0, 300.0, 900.0], by_s=600.0)),
        MethodRow("hover", evaluated=evaluation([100.0, 700.0, 800.0, 900.0], by_s=600.0)),
    ]
    said = against_patterns(rows)
    assert said is not None
    assert said.startswith(
        "best: by 0:10:00 it is 50.0 points ahead of the best tuned pattern, hover"
    )


def test_one_target_tells_no_interval() -> None:
    rows = [
        MethodRow("best", evaluated=evaluation([100.0])),
        MethodRow("hover", evaluated=evaluation([200.0])),
    ]
    assert against_patterns(rows) == "best: 50.0 % sooner than the best tuned pattern, hover"
    nobody = Evaluation(np.zeros(0), np.zeros(0), np.zeros(0), Objective(1e3))
    assert ahead(nobody, nobody) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("by_s", [None, 600.0])
def test_targets_of_one_run_of_the_traffic_are_not_independent(by_s: float | None) -> None:
    rng = np.random.default_rng(4)
    runs, each = 8, 50
    run = np.repeat(np.arange(runs), each)

    def drawn() -> tuple[Evaluation, Evaluation]:
        """A queue makes one plan later for all of a run, and the other one for none."""
        seen_s = rng.uniform(200.0, 900.0, runs * each)
        queue_s = rng.uniform(0.0, 200.0, runs)[run]
        found = (evaluation(one.tolist(), by_s=by_s) for one in (seen_s, seen_s + queue_s))
        one, other = (replace(one, run=run) for one in found)
        return one, other

    leads = [ahead(*drawn()) for _ in range(200)]
    truth = np.mean([lead.share for lead in leads])
    assert np.mean([lead.low <= truth <= lead.high for lead in leads]) >= 0.9
    one, other = drawn()
    alone = ahead(replace(one, run=None), replace(other, run=None))
    assert ahead(one, other).share == alone.share
    if by_s is None:
        lead = ahead(one, other)
        assert lead.high - lead.low > 1.5 * (alone.high - alone.low)
    single = ahead(replace(one, run=0 * run), other)
    assert not single.is_known  # one run tells nothing of others
