"""False alarms: each one is looked at and dismissed, and all that it tells is that it is later now.

They come by chance while the UAV searches, whatever it searches; or, among traffic, each time that
a car is met that looks like the target. What a flight is worth with them is an expectation over all
targets, given when the alarms are; two ways to fly are held against each other on the same alarms
and the same targets.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from planner.arrays import Floats
from planner.checked import number, set_fields
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.first_detection import first_detection
from planner.errors import NothingLeftError
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.futures.none import NO_TARGETS
from planner.intervals import ratio_of_means
from planner.mission.online import Mission
from planner.mission.planning import problem_of
from planner.mission.resume import Resumed, grounded, in_order
from planner.mission.several import refuse_fleet
from planner.mission.standing import Standing
from planner.progress import Progress, silent

ALARMS = "--alarms: are those of one UAV"
SETTLED = 0.01  # of the targets that can be found: with no more left it is not planned anew


@dataclass(frozen=True)
class Alarms:
    """How often false alarms come, and how long each one takes."""

    every_s: float  # mean time of search from one to the next
    lasts_s: float  # until it is dismissed

    def __post_init__(self) -> None:
        every_s = number("every_s", self.every_s, above=0.0)
        set_fields(self, {"every_s": every_s, "lasts_s": number("lasts_s", self.lasts_s, least=0)})

    def gaps_s(self, until_s: float, rng: np.random.Generator) -> Floats:
        """Return the times of search between alarms, which together reach as far as is asked."""
        many = int(until_s / self.every_s) + 1
        gaps_s = rng.exponential(self.every_s, 2 * many + 20)
        return np.asarray(gaps_s[: int(np.searchsorted(np.cumsum(gaps_s), until_s)) + 1])


class NextAlarm(Protocol):
    """When the next alarm comes, on one flight."""

    def __call__(self, rest: Track, now_s: float) -> float:
        """Return its time, given what is still to be flown; infinity: there is none."""


def by_chance(gaps_s: Sequence[float]) -> NextAlarm:
    """Return alarms that come whatever is searched.

    Parameters
    ----------
    gaps_s
        Times of search between alarms, seconds.
    """
    left = iter(gaps_s)
    return lambda rest, now_s: now_s + next(left, np.inf)  # noqa: ARG005


def by_lookalikes(cars: Futures, radius_m: float) -> NextAlarm:
    """Return alarms that come when a car that looks like the target is first within the radius.

    Each car is checked once.

    Parameters
    ----------
    cars
        Those that look like the target.
    """
    unchecked = np.ones(len(cars), dtype=bool)

    def next_alarm(rest: Track, now_s: float) -> float:
        some = np.flatnonzero(unchecked)
        met_s = first_detection(cars.take(some), rest, radius_m)
        if not np.isfinite(met_s).any():
            return np.inf
        unchecked[some[np.argmin(met_s)]] = False
        return max(now_s, float(met_s.min()))

    return next_alarm


class Compared(NamedTuple):
    """Expected times with alarms, of a plan flown late and of one made anew after each."""

    late_s: tuple[float, ...]  # by sequence of alarms
    anew_s: tuple[float, ...]
    late_found: tuple[float, ...] = ()  # probability of finding it
    anew_found: tuple[float, ...] = ()

    @property
    def saved(self) -> float:
        """Share of the time flown late that planning anew saves."""
        return 1.0 - sum(self.anew_s) / sum(self.late_s)

    @property
    def interval(self) -> tuple[float, float]:
        """Its 95 % interval, over sequences of alarms; without bounds for a single one."""
        ratio, half = ratio_of_means(np.array(self.anew_s), np.array(self.late_s))
        return 1.0 - ratio - half, 1.0 - ratio + half


def with_alarms(mission: Mission, alarm: NextAlarm, lasts_s: float, *, anew: bool) -> Track:
    """Return the whole flight of a mission with false alarms.

    Parameters
    ----------
    lasts_s
        For how long the UAV stands still at each, unless it is on the ground by then.
    anew
        Whether it is planned anew after each; else the plan is flown later.
    """
    problem = problem_of(mission.opened, NO_TARGETS)
    now_s, horizon_s = problem.uav.at_height.take_off_s, problem.objective.horizon_s
    while (alarm_s := alarm(in_order(mission.plan.tracks), now_s)) < min(
        mission.plan.end_s, horizon_s
    ):
        now_s = alarm_s + lasts_s
        is_down = grounded(mission.opened, mission.plan, Standing(now_s))
        try:
            going_on = mission.heard(Standing(now_s, late_s=0.0 if is_down else lasts_s))
        except NothingLeftError:  # the flight is over
            break
        mission.goes_on(going_on, _anew(mission, going_on, now_s) if anew else going_on.incumbent)
    return mission.track


def _anew(mission: Mission, going_on: Resumed, now_s: float) -> Plan:
    """Return the plan made anew; the one there was where hardly anything is left to be found."""
    if _left(mission, now_s) <= SETTLED:
        return going_on.incumbent
    try:
        return mission.planned(going_on).attempt.plan
    except NothingLeftError:  # to choose on
        return going_on.incumbent


def compared(
    mission: Mission,
    targets: Futures,
    sequences: Sequence[Callable[[], NextAlarm]],
    lasts_s: float,
    on_progress: Progress = silent,
) -> Compared:
    """Return what planning anew after alarms is worth, against the plan flown late.

    Parameters
    ----------
    mission
        At its take-off; it stays there.
    sequences
        What makes the alarms of a flight, twice the same.
    """
    refuse_fleet(mission.opened, ALARMS)
    late, anew = list[Evaluation](), list[Evaluation]()
    for done, alarms in enumerate(sequences):
        on_progress(done, len(sequences))
        for found, is_anew in ((late, False), (anew, True)):
            flown = Mission(mission.recorder, mission.plan, mission.method)
            track = with_alarms(flown, alarms(), lasts_s, anew=is_anew)
            found.append(_evaluated(flown, track, targets))
    return Compared(
        *(tuple(one.expected_detection_time_s for one in some) for some in (late, anew)),
        *(tuple(one.detection_probability for one in some) for some in (late, anew)),
    )


def _evaluated(mission: Mission, track: Track, targets: Futures) -> Evaluation:
    problem = problem_of(mission.opened, NO_TARGETS)
    return evaluate((track,), targets, problem.sensor, problem.objective)


def _left(mission: Mission, now_s: float) -> float:
    """Return the probability that a target is not found by now that is there."""
    believed = mission.believed()
    found = _evaluated(mission, mission.track, believed)
    return 1.0 - found.found_by_probability(now_s) / float(believed.weight.sum())
