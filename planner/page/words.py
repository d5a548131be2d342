"""What a page says in words: times of day, odds, lengths, and a command to copy."""

import math
from dataclasses import dataclass
from datetime import datetime, timedelta

from planner.clock import clock, to_minute, to_second
from planner.messages import UNSEEN

QUOTES_OF_POWERSHELL = "'\u2018\u2019\u201a\u201b"  # all of which end a text in single ones
# Between the times of the headline.
STEPS_S = (60, 120, 300, 600, 900, 1200, 1800, 3600, 7200, 14400)
MOST_ODDS = 5  # of a headline
UNTITLED = "Search for a vehicle"


@dataclass(frozen=True)
class Clock:
    """Times of day where the target was seen; without a moment of sighting, times since then."""

    sighted_at: datetime | None = None

    def at(self, time_s: float) -> str:
        """Return a time to the second."""
        if self.sighted_at is None:
            return clock(time_s)
        return to_second(self._moment(time_s))

    def short(self, time_s: float) -> str:
        """Return a time by which something is so, to the minute."""
        if self.sighted_at is None:
            minutes = time_s / 60.0
            return f"{minutes:,.0f} min" if minutes >= 1.0 else f"{time_s:.0f} s"
        return to_minute(self._moment(time_s))

    def round_times_s(self, from_s: float, until_s: float) -> list[float]:
        """Return some round times after one and up to another, seconds on the target's clock."""
        step_s = next((s for s in STEPS_S if (until_s - from_s) / s <= MOST_ODDS), STEPS_S[-1])
        past_s = 0.0  # of the last round time before the sighting
        if self.sighted_at is not None:
            day = self.sighted_at.replace(hour=0, minute=0, second=0, microsecond=0)
            past_s = (self.sighted_at - day).total_seconds() % step_s
        first = int((from_s + past_s) // step_s) + 1
        last = int((until_s + past_s) // step_s)
        return [float(k * step_s) - past_s for k in range(first, last + 1)]

    def as_dict(self) -> dict[str, int] | None:
        """Return it as the page's script takes it: the moment of time 0, and the offset there."""
        if self.sighted_at is None:
            return None
        offset = self.sighted_at.utcoffset() or timedelta()
        return {
            "sighted_ms": round(self.sighted_at.timestamp() * 1000),
            "offset_min": round(offset.total_seconds() / 60),
        }

    def _moment(self, time_s: float) -> datetime:
        assert self.sighted_at is not None
        return self.sighted_at + timedelta(seconds=round(time_s))


def soon_s(until_s: float) -> float:
    """Return how much of a flight is shown as about to be flown, seconds."""
    return 60.0 if until_s <= 3600.0 else 300.0


def odds(share: float) -> str:
    """Return a probability to whole per cents, and what is nearly none or all as that."""
    per_cent = math.floor(share * 100 + 0.5)
    if share > 0.0 and per_cent == 0:
        return "<1 %"
    if share < 1.0 and per_cent == 100:
        return ">99 %"
    return f"{per_cent} %"


def for_posix(word: str) -> str | None:
    """Return a word as sh, bash and zsh take it, whatever it holds; None if no terminal takes it.

    A terminal obeys control characters even in a text that is pasted.
    """
    return None if _is_obeyed(word) else "'" + _as_file(word).replace("'", "'\\''") + "'"


def for_powershell(word: str) -> str | None:
    """Return a word as PowerShell takes it, whatever it holds; None if no terminal takes it."""
    if _is_obeyed(word):
        return None
    doubled = "".join(c * 2 if c in QUOTES_OF_POWERSHELL else c for c in _as_file(word))
    return f"'{doubled}'"


def _is_obeyed(word: str) -> bool:
    return UNSEEN.search(word.replace("\n", "")) is not None


def _as_file(word: str) -> str:
    """Return a file's name so that no command takes it for an option."""
    return f"./{word}" if word.startswith("-") else word
