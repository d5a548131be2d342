"""What is measured of planning anew in flight, small."""

import numpy as np
import pytest

from planner.mission.online import Remembering
from planner.mission.opening import open_scenario
from planner.paper.in_flight import OLD_S, Flight, afresh, report_of, reported, with_no_news

SMALL = (
    "search.particles=256",
    "search.work=2000",
    "search.sampling=sobol",
    "search.targets=400",
    "sensor.detects=0.9",
)


@pytest.fixture(scope="module")
def flight() -> Flight:
    recorder = Remembering(open_scenario("grid5x5", overrides=SMALL), workers=1)
    return Flight.planned(recorder, recorder.evaluation().futures, "rate")


def test_without_news_the_flight_is_the_same(flight: Flight) -> None:
    (planned,) = flight.plan.tracks
    for track in (with_no_news(flight, 800.0, 1500.0), afresh(flight, 1200.0)):
        times_s = np.linspace(planned.time_s[0], 800.0, 20)
        np.testing.assert_allclose(track.xy(times_s), planned.xy(times_s), atol=1e-6)
    # One pass without look ahead decides again as it did.
    assert flight.expected_s(with_no_news(flight, 800.0)) <= 1.02 * flight.whole_s


def test_reports_shorten_what_is_still_to_come(flight: Flight) -> None:
    heard = [*reported(flight, 900.0, 3, np.random.default_rng(1))]
    assert len(heard) == 3
    as_planned_s, anew_s = np.array(heard).mean(axis=0)
    assert 0.0 < anew_s < as_planned_s
    again = [*reported(flight, 900.0, 3, np.random.default_rng(1))]
    assert again == heard


def test_a_report_is_of_what_was_seen_before_it_came() -> None:
    report = report_of(np.array([3.0, 4.0]), 1000.0)
    assert (report.at_s, report.heard_s) == (1000.0 - OLD_S, 1000.0)
