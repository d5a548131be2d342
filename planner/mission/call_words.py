"""The words of a call, and what is wrong with them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from planner.errors import Fault, InputError, ScenarioError

T = TypeVar("T")

PROFILE = "driving"  # where nobody says which


@dataclass(frozen=True)
class Words:
    """What was said, as it was typed."""

    net: str  # a net's file, or a scenario that has the net
    last_seen: str
    at: str
    drone_at: tuple[str, ...]  # one or more places
    heading: str | None = None
    radius_m: float | None = None
    target: str = PROFILE
    aircraft: Path | None = None
    ready: str | None = None
    until: str | None = None
    battery: str | None = None
    settings: tuple[str, ...] = ()  # keys of the scenario, each KEY=VALUE


class Faults:
    """Takes words one by one, and keeps what is wrong with each."""

    def __init__(self) -> None:
        self.found: list[Fault] = []

    def tried(self, option: str, meant: Callable[[], T]) -> T | None:
        """Return what an option's words mean, None if they mean nothing."""
        try:
            return meant()
        except ScenarioError as error:
            self.found += (Fault(option, f"{fault.key} {fault.text}") for fault in error.faults)
        except InputError as error:
            self.add(option, str(error))
        return None

    def add(self, option: str, text: str) -> None:
        """Keep what is wrong with an option's words."""
        self.found.append(Fault(option, text))
