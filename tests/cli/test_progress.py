"""Where there is no terminal: a line every half minute, and none of what is done by then."""

import logging

import pytest

from planner.cli import progress
from planner.cli.progress import progress_bar, progress_lines


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.time_s = 1000.0

    def monotonic(self) -> float:
        return self.time_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(progress, "time", made)
    return made


def warned(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [one.getMessage() for one in caplog.records if one.levelno >= logging.WARNING]


def test_a_line_each_half_minute_with_the_time_left(
    clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    update = progress_lines("recording")
    for second in range(0, 100, 2):
        clock.time_s = 1000.0 + second
        update(20 * second, 2000)
    clock.time_s = 1100.0
    update(2000, 2000)
    assert warned(caplog) == [
        "recording: 600 of 2,000, about 70 s left",
        "recording: 1,200 of 2,000, about 40 s left",
        "recording: 1,800 of 2,000, about 10 s left",
    ]


def test_what_is_done_within_half_a_minute_is_silent(
    clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    update = progress_lines("recording")
    for second in range(30):
        clock.time_s = 1000.0 + second
        update(second, 29, "a note")
    assert warned(caplog) == []


def test_before_anything_is_done_nobody_knows_how_long(
    clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    update = progress_lines("recording")
    clock.time_s += 31.0
    update(0, 10, "812 s (735 .. 889) so far")
    assert warned(caplog) == ["recording: 0 of 10; 812 s (735 .. 889) so far"]


def test_a_note_goes_with_the_line(clock: Clock, caplog: pytest.LogCaptureFixture) -> None:
    with progress_bar("recording") as update:  # pytest's stderr is no terminal
        clock.time_s += 60.0
        update(5, 10, "812 s so far")
    assert warned(caplog) == ["recording: 5 of 10, about 60 s left; 812 s so far"]
