"""What news makes of the particles' weights: known answers, and what must not matter."""

from typing import Any

import numpy as np
import pytest

from planner.detection.first_detection import first_detection
from planner.detection.likelihood import draws
from planner.detection.sensor import Sensor, rate_of
from planner.errors import InputError
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.futures.pooled import pooled
from planner.mission.news import given, refuse_unlikely, search_of
from planner.scenario.news import FoundNews, News, NothingNews, ReportNews, SearchedNews
from support.instances import grid

NET = grid(3, 3, road_m=5000.0)


def resting(xy_m: Any, weight: Any = None, target: Any = None) -> Futures:
    """Targets that stay where they are."""
    xy_m = np.asarray(xy_m, dtype=float)
    many = len(xy_m)
    return Futures(
        time_s=np.zeros(many),
        x_m=xy_m[:, 0],
        y_m=xy_m[:, 1],
        first_knot=np.arange(many + 1),
        weight=np.full(many, 1.0 / many) if weight is None else np.asarray(weight, dtype=float),
        gone=np.zeros(many, dtype=bool),
        target=np.zeros(many, dtype=np.int32) if target is None else np.asarray(target),
    )


def report(x_m: float, y_m: float, sure: float, **more: Any) -> ReportNews:
    said = {"radius_m": 100.0} if "sd_m" not in more else {}
    place = {"x_m": x_m, "y_m": y_m}
    times = {"at_s": 50.0, "heard_s": 100.0}
    return ReportNews.model_validate(
        {"kind": "report", "place": place, "sure": sure, **times, **said, **more}
    )


def weights(futures: Futures, *news: News) -> Any:
    return given(futures, news, NET, speed_mps=50.0).weight


def searched(flight: Track, detects: float = 1.0) -> SearchedNews:
    """A flight that misses a target straight below it at 100 m/s as often as is said."""
    return search_of(flight, Sensor(300.0, rate_per_s=rate_of(detects, 300.0, 100.0)), 100.0)


ROW = resting([(1000.0 * k, 0.0) for k in range(100)])


def test_a_report_is_true_as_probably_as_is_said_of_it() -> None:
    after = weights(ROW, report(3000.0, 0.0, 0.7))
    assert after[3] == pytest.approx(0.7 + 0.3 * 0.01)
    assert after.sum() == pytest.approx(1.0)


def test_two_reports_of_different_places_divide_the_belief() -> None:
    many = resting([(1000.0 * k, 0.0) for k in range(10_000)])
    after = weights(many, report(3000.0, 0.0, 0.7), report(7000.0, 0.0, 0.7))
    rest = after.sum() - after[3] - after[7]
    assert [after[3], after[7], rest] == pytest.approx([0.41, 0.41, 0.18], abs=0.005)


def test_the_order_of_news_does_not_matter() -> None:
    flight = Track(*np.array([[0.0, 0.0, 0.0], [90.0, 9000.0, 0.0]]).T, np.array([[0.0, 90.0]]))
    news = (
        report(3000.0, 0.0, 0.7),
        searched(flight, 0.5),
        report(7000.0, 0.0, 0.4, sd_m=2000.0),
    )
    assert weights(ROW, *news) == pytest.approx(weights(ROW, *news[::-1]), rel=1e-12)


@pytest.mark.parametrize(
    "nothing", [report(3000.0, 0.0, 0.0), report(3000.0, 0.0, 0.7, sd_m=1e8)], ids=["c 0", "sd inf"]
)
def test_a_report_that_says_nothing_changes_nothing(nothing: ReportNews) -> None:
    assert weights(ROW, nothing) == pytest.approx(ROW.weight, rel=1e-6)


def test_a_report_tells_that_there_is_a_target() -> None:
    likely = resting([(0.0, 0.0), (9000.0, 0.0)], weight=[0.2, 0.2])
    after = weights(likely, report(0.0, 0.0, 0.7))
    assert after == pytest.approx([0.7 + 0.3 * 0.2, 0.3 * 0.2])  # and nowhere with .3 * .6


def test_somebody_s_search_counts_as_one_of_a_uav() -> None:
    flight = Track(*np.array([[0.0, 0.0, 0.0], [90.0, 9000.0, 0.0]]).T, np.array([[0.0, 90.0]]))
    seen = np.isfinite(first_detection(ROW, flight, 300.0))
    after = weights(ROW, searched(flight))
    assert after == pytest.approx(np.where(seen, 0.0, 1.0 / (~seen).sum()))


def test_what_is_searched_after_a_report_counts_against_it() -> None:
    flight = Track(*np.array([[200.0, 0.0, 0.0], [300.0, 9000.0, 0.0]]).T, np.array([[0.0, 300.0]]))
    search = searched(flight)
    after = weights(ROW, report(3000.0, 0.0, 0.7), search)
    assert after[3] == 0.0
    earlier = searched(flight.later(-200.0), 0.5)  # before the report is heard
    trusted = weights(ROW, earlier, report(3000.0, 0.0, 0.7))
    believed = weights(ROW, earlier)[3]
    assert believed < 0.01
    assert trusted[3] == pytest.approx(0.7 + 0.3 * believed)


def test_nothing_seen_at_a_place_makes_it_less_likely() -> None:
    place: Any = {"x_m": 3000.0, "y_m": 0.0}
    watched = {"from_s": 10.0, "to_s": 20.0, "radius_m": 100.0, "sure": 0.8}
    news = NothingNews.model_validate({"kind": "nothing", "place": place, **watched})
    assert weights(ROW, news)[3] == pytest.approx(0.2 * 0.01 / (1.0 - 0.8 * 0.01))


def test_a_target_that_is_found_weighs_nothing_and_the_other_as_before() -> None:
    both = resting([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], [1.0, 0.4, 0.6], target=[0, 1, 1])
    assert weights(both, FoundNews(kind="found", target=0)) == pytest.approx([0.0, 0.4, 0.6])


def test_a_report_of_one_target_leaves_the_other_alone() -> None:
    both = resting([(0.0, 0.0), (0.0, 0.0), (9000.0, 0.0)], [1.0, 0.4, 0.6], target=[0, 1, 1])
    after = weights(both, report(0.0, 0.0, 0.7, target=1))
    assert after == pytest.approx([1.0, 0.7 + 0.3 * 0.4, 0.3 * 0.6])


def test_a_report_of_where_it_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match=r"only 0\.0 % of what is believed .* --insist"):
        refuse_unlikely(ROW, report(0.0, 5e4, 0.7), (), NET, speed_mps=50.0)
    refuse_unlikely(ROW, report(3000.0, 0.0, 0.7), (), NET, speed_mps=50.0)
    assert weights(ROW, report(0.0, 5e4, 0.7)) == pytest.approx(ROW.weight)  # if it is insisted on


def test_nothing_that_is_left_is_refused() -> None:
    flight = Track(*np.array([[0.0, 0.0, 0.0], [90.0, 1e5, 0.0]]).T, np.array([[0.0, 90.0]]))
    with pytest.raises(InputError, match="nothing that is believed of the target agrees"):
        weights(ROW, searched(flight))


def test_nothing_is_searched_when_every_target_is_found() -> None:
    with pytest.raises(InputError, match="every target that it is found"):
        weights(ROW, FoundNews(kind="found"))


def test_pooled_particles_keep_their_shares() -> None:
    one, two = resting([(0.0, 0.0), (5.0, 0.0)], [0.3, 0.5]), resting([(9.0, 0.0)], [0.8])
    both = pooled([one, two])
    assert both.weight.tolist() == [0.15, 0.25, 0.4]
    assert both.positions(3.0)[:, 0].tolist() == [0.0, 5.0, 9.0]
    assert draws(np.full(7, 0.1)) == pytest.approx(7.0)
