"""What comes of a call while it is planned: events, which listeners show, write or send on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from planner.detection.evaluation import Evaluation
from planner.detection.paired import Ahead
from planner.detection.prospects import Prospects
from planner.futures.futures import Futures
from planner.futures.store import Recording
from planner.futures.traffic import NO_PERMIT, Permit
from planner.mission.call import Call
from planner.mission.opening import OpenScenario
from planner.mission.trial import Trial
from planner.progress import Progress, silent
from planner.search.problem import Problem
from planner.search.stop import never


class Rung(NamedTuple):
    """How much goes into one plan of several."""

    particles: int
    work: int
    targets: int


RUNGS = (Rung(100, 6_000, 150), Rung(500, 40_000, 600), Rung(1000, 80_000, 1000))


@dataclass(frozen=True, eq=False)
class Cloud:
    """Where the target may be, as the kinematic clock guesses before SUMO drives."""

    elapsed_s: float  # since the call
    opened: OpenScenario
    guess: Futures | None  # None: the net has no clock


@dataclass(frozen=True, eq=False, kw_only=True)
class FirstPlan:
    """A plan, what it was made from, and what it is worth."""

    elapsed_s: float
    call: Call  # with the place, the particles, the work and the take-off that it came to
    opened: OpenScenario
    planning: Recording
    holdout: Futures | None
    fresh: Recording  # targets that had no part in it
    problem: Problem
    trial: Trial
    prospects: Prospects
    sites: tuple[tuple[str, Evaluation], ...]  # where it might take off; odds of each first plan

    @property
    def take_off_s(self) -> float:
        """When the drone takes off, seconds from the call."""
        return self.call.ready_s


@dataclass(frozen=True, eq=False, kw_only=True)
class BetterPlan(FirstPlan):
    """A plan that is better than the one before, on targets that neither was made from."""

    lead: Ahead
    before_s: float  # when the one before takes off, seconds from the call


@dataclass(frozen=True, eq=False)
class NoBetter:
    """More work found no better plan."""

    elapsed_s: float
    particles: int
    lead: Ahead  # of the one that was found; it may seem ahead by chance


class Condition(NamedTuple):
    """What a plan is worth if something is so that is not known."""

    name: str  # goes on from "if"
    evaluated: Evaluation
    share: float | None = None  # how probable that is, where the belief says


class Unknown(NamedTuple):
    """What nobody said, and the odds by what the answer is."""

    name: str
    option: str  # that takes the answer
    answers: tuple[Condition, ...]


@dataclass(frozen=True, eq=False)
class Outlook:
    """What the odds depend on, and what could be flown instead."""

    elapsed_s: float
    plan: FirstPlan
    conditions: tuple[Condition, ...]
    unknowns: tuple[Unknown, ...]  # that would change the odds, the most first
    waiting: tuple[str, Evaluation] | None  # at the best of all crossings
    pattern: tuple[str, Evaluation] | None  # the best of a pilot's patterns


@dataclass(frozen=True, eq=False)
class Done:
    """No more plans come."""

    elapsed_s: float
    plan: FirstPlan  # the best
    stopped: bool  # whether somebody asked for it


Event: TypeAlias = Cloud | FirstPlan | BetterPlan | NoBetter | Outlook | Done


@dataclass(frozen=True)
class How:
    """How a call is planned; listeners hear of it by its events."""

    elapsed_s: Callable[[], float]  # seconds since the call
    stop: Callable[[], bool] = never  # whether the best so far is wanted; asked after a first plan
    workers: int | None = None
    progress: Callable[[str], Progress] = lambda _: silent  # of what is recorded, by its title
    permit: Permit = NO_PERMIT  # what its traffic may be
    rungs: Sequence[Rung] = field(default_factory=lambda: RUNGS)
