"""When a search ends before its work is done: rules that are asked often, alone or together."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from planner.checked import number, set_fields, whole
from planner.compiling import COMPILING


class Stop(Protocol):
    """A rule that says when a search should end with the best it has so far."""

    def __call__(self, work: int, /) -> bool:
        """Tell whether to end, after so many units of work."""


@dataclass(frozen=True)
class WorkDone:
    """Ends after so many units of work."""

    most: int

    def __post_init__(self) -> None:
        set_fields(self, {"most": whole("most", self.most)})

    def __call__(self, work: int, /) -> bool:
        """Tell whether that many are done."""
        return work >= self.most


@dataclass(frozen=True)
class Elapsed:
    """Ends when so many seconds have passed since the rule was made; compilation takes none."""

    seconds: float
    since_s: float = field(default_factory=lambda: _now_s())

    def __post_init__(self) -> None:
        set_fields(self, {"seconds": number("seconds", self.seconds, ends=False)})

    def __call__(self, work: int, /) -> bool:  # noqa: ARG002
        """Tell whether they have passed."""
        return _now_s() > self.since_s + self.seconds


def never() -> bool:
    """Tell that nobody asks a search to end."""
    return False


def _now_s() -> float:
    return time.monotonic() - COMPILING.spent_s


@dataclass(frozen=True)
class Asked:
    """Ends when somebody asks for the best so far, as with Ctrl-C."""

    asked: Callable[[], bool]

    def __call__(self, work: int, /) -> bool:  # noqa: ARG002
        """Tell whether somebody has asked."""
        return self.asked()


class AnyOf:
    """Ends when any of several rules says so; without rules, never."""

    def __init__(self, *rules: Stop) -> None:
        self.rules = rules

    def __call__(self, work: int, /) -> bool:
        """Tell whether one of them says so."""
        return any(rule(work) for rule in self.rules)


NEVER = AnyOf()
