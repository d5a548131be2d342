"""How long an experiment will take, from the times of finished conditions or else from its size."""

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from statistics import median
from typing import Any

from planner.errors import PlannerError
from planner.experiments.condition import Condition
from planner.experiments.target_sets import enumerated
from planner.mission.recorder import HOLDOUT_FACTOR
from planner.scenario.draft import read_scenario
from planner.scenario.sections import Scenario
from planner.search.methods import method_named

# Measured on one core of an ordinary server; another machine may take twice or half as long. The
# first is a figure of the 5 x 5 grid: elsewhere only the times of finished conditions are good.
VEHICLE_S = 1.5e-3  # for SUMO to drive one target of the grid up to the horizon
LEG_S = 8e-6  # for a search to fly one simulated leg
CONDITION_S = 0.3  # to read the futures, evaluate the plan and store the outcome


@dataclass(frozen=True)
class Duration:
    """How much wall-clock time conditions are expected to take."""

    time_s: float  # of those that it speaks for, with one process
    timed: int  # conditions whose time is that of finished ones like them
    sized: int  # conditions whose time comes from their size
    unknown: tuple[str, ...]  # methods and studies of which nothing is known

    def sentence(self, workers: int) -> str:
        """Return it in words, for a number of processes."""
        if not self.timed and not self.sized:
            if not self.unknown:
                return "nothing is left to run"
            return f"how long it takes shows when some of it is done: {', '.join(self.unknown)}"
        processes = "1 process" if workers == 1 else f"{workers} processes"
        sources = [
            f"{self.timed:,} conditions by the times of finished ones" * bool(self.timed),
            f"{self.sized:,} by their size, good to a factor of two" * bool(self.sized),
            f"without {', '.join(self.unknown)}, of which none is done" * bool(self.unknown),
        ]
        basis = "; ".join(filter(None, sources))
        return f"about {_rounded(self.time_s / workers)} with {processes} ({basis})"

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {**vars(self), "unknown": list(self.unknown)}


def duration_of(waiting: Sequence[Condition], known: Mapping[str, float]) -> Duration:
    """Return how long the waiting conditions will take, as far as that is known.

    Targets that the cache has are counted as if SUMO had to drive them.

    Parameters
    ----------
    known
        Seconds that a condition takes, by its kind, as `known_times` returns them.
    """
    work_s, timed, sized = 0.0, 0, 0
    unknown: dict[str, None] = {}
    drawn: dict[str, int] = {}  # targets that SUMO drives, each shared set of them once
    for condition in waiting:
        kind = _kind(condition)
        scenario = None if condition.study else _scenario(condition)
        if scenario is not None:
            _draw(drawn, condition, scenario)
        if kind in known:
            work_s, timed = work_s + known[kind], timed + 1
        elif condition.study or not method_named(condition.method).is_sized:
            unknown[kind] = None
        else:
            planning_s = _planning_s(condition, scenario) if scenario else 0.0
            work_s, sized = work_s + planning_s + CONDITION_S, sized + 1
    time_s = work_s + VEHICLE_S * sum(drawn.values())
    return Duration(time_s, timed, sized, tuple(unknown))


def _kind(condition: Condition) -> str:
    return f"study {condition.study}" if condition.study else condition.method


def known_times(finished: Iterable[tuple[Condition, Mapping[str, Any]]]) -> dict[str, float]:
    """Return the median time that conditions of each kind took, from what is kept of them."""
    times: dict[str, list[float]] = {}
    for condition, timing in finished:
        if timing.get("whole_s") is not None:
            times.setdefault(_kind(condition), []).append(timing["whole_s"])
    return {kind: median(some) for kind, some in times.items()}


def _planning_s(condition: Condition, scenario: Scenario) -> float:
    if not method_named(condition.method).stops:
        return 0.0  # its legs are few beside those of a search that uses up its budget
    return LEG_S * scenario.search.work


def _draw(drawn: dict[str, int], condition: Condition, scenario: Scenario) -> None:
    search = scenario.search
    target, truth = (part.model_dump(mode="json") for part in (scenario.target, scenario.truth))
    mine = [condition.scenario, search.horizon_s, condition.seed]
    planned = json.dumps([*mine, target, search.particles, search.sampling])
    if search.sampling != "all":  # those are few
        drawn[f"{planned} planning"] = search.particles
        if method_named(condition.method).chooses:
            drawn[f"{planned} holdout"] = HOLDOUT_FACTOR * search.particles
        if method_named(condition.method).takes_options and scenario.greedy.particles == "anew":
            drawn[f"{planned} anew"] = search.depth * search.particles
    drawn[json.dumps([*mine, truth])] = condition.targets
    for one in condition.sets:
        key = json.dumps([condition.scenario, search.horizon_s, truth, one.truth, one.points])
        if key not in drawn:
            with suppress(PlannerError):
                drawn[key] = len(enumerated(one, condition))


def _scenario(condition: Condition) -> Scenario | None:
    """Return a condition's scenario, None where it is at fault: then it takes no time."""
    with suppress(PlannerError):
        return read_scenario(condition.place, preset=condition.preset, overrides=condition.settings)
    return None


def _rounded(time_s: float) -> str:
    """Return a time to the digits that an estimate has."""
    if time_s < 100:
        return f"{max(1, round(time_s)):,} s"
    minutes = time_s / 60
    return f"{minutes:,.0f} min" if minutes < 100 else f"{minutes / 60:,.1f} h"
