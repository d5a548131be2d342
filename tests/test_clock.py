"""Moments and durations in words."""

from datetime import UTC, datetime, timedelta, timezone

import pytest

from planner.clock import span, when
from planner.errors import InputError

HERE = timezone(timedelta(hours=2))
NOW = datetime(2026, 5, 1, 14, 7, 30, tzinfo=HERE)


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("14:05", "2026-05-01T14:05:00+02:00"),
        ("14.05", "2026-05-01T14:05:00+02:00"),
        ("14:05:20", "2026-05-01T14:05:20+02:00"),
        ("23:50", "2026-05-01T23:50:00+02:00"),
        ("01:00", "2026-05-02T01:00:00+02:00"),  # the nearest one
        ("-7min", "2026-05-01T14:00:30+02:00"),
        ("-90s", "2026-05-01T14:06:00+02:00"),
        ("+3 min", "2026-05-01T14:10:30+02:00"),
        ("+0:30:00", "2026-05-01T14:37:30+02:00"),
        ("now", "2026-05-01T14:07:30+02:00"),
        ("2026-05-01T14:05", "2026-05-01T14:05:00+02:00"),
        ("2026-05-01T12:05:00Z", "2026-05-01T12:05:00+00:00"),
    ],
)
def test_moments_in_words(text: str, moment: str) -> None:
    assert when(text, NOW).isoformat() == moment


def test_just_after_midnight_the_evening_is_yesterday() -> None:
    assert when("23:55", datetime(2026, 5, 1, 0, 3, tzinfo=UTC)).day == 30


@pytest.mark.parametrize("text", ["", "25:00", "14:61", "-", "-x", "soon", "1405", "- 3 weeks"])
def test_what_is_no_moment(text: str) -> None:
    with pytest.raises(InputError, match=r"write (14:05|25min)"):
        when(text, NOW)


@pytest.mark.parametrize("text", ["-999999999999min", "+1000000001", f"+{10**400}s"])
def test_what_no_calendar_reaches(text: str) -> None:
    with pytest.raises(InputError, match="write a few minutes"):
        when(text, NOW)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("25min", 1500.0), ("90 s", 90.0), ("1.5h", 5400.0), ("0:25:00", 1500.0), ("40", 40.0)],
)
def test_durations_in_words(text: str, seconds: float) -> None:
    assert span(text) == seconds


@pytest.mark.parametrize("text", ["", "-5min", "5 lightyears", "inf"])
def test_what_is_no_duration(text: str) -> None:
    with pytest.raises(InputError, match="is no duration"):
        span(text)
