"""How long an experiment will take, from the times of finished conditions or else from its size."""

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from planner.clock import rough
from planner.errors import PlannerError
from planner.experiments.condition import Condition
from planner.experiments.target_sets import enumerated
from planner.futures.cost import Cost, cost_of
from planner.messages import counted
from planner.mission.sample_sizes import holdout_particles
from planner.network.read import open_network
from planner.network.road_network import RoadNetwork
from planner.scenario.draft import read_scenario
from planner.scenario.sections import Scenario

# Measured on one core of an ordinary server; another machine may take twice or half as long.
LEG_S = 8e-6  # for a search to fly one simulated leg
CONDITION_S = 0.3  # to read the futures, evaluate the plan and store the outcome


@dataclass(frozen=True)
class Duration:
    """How much wall-clock time conditions are expected to take."""

    time_s: float  # of those that it speaks for, with one process
    timed: int  # conditions whose time is that of finished ones like them
    sized: int  # conditions whose time comes from their size
    unknown: tuple[str, ...]  # methods and studies of which nothing is known
    runs: int = 0  # of SUMO, for all of them

    def sentence(self, workers: int) -> str:
        """Return it in words, for a number of processes."""
        if not self.timed and not self.sized:
            if not self.unknown:
                return "nothing is left to run"
            return f"how long it takes shows when some of it is done: {', '.join(self.unknown)}"
        processes = counted(workers, "process", "processes")
        sources = [
            f"{self.timed:,} conditions by the times of finished ones" * bool(self.timed),
            f"{self.sized:,} by their size, good to a factor of two" * bool(self.sized),
            f"without {', '.join(self.unknown)}, of which none is done" * bool(self.unknown),
        ]
        basis = "; ".join(filter(None, sources))
        return f"about {rough(self.time_s / workers)} with {processes} ({basis})"

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
    driven = _Driven()
    for condition in waiting:
        kind = _kind(condition)
        scenario = None if condition.study else _scenario(condition)
        if scenario is not None:
            driven.add(condition, scenario)
        if kind in known:
            work_s, timed = work_s + known[kind], timed + 1
        elif condition.study or not condition.planned_by.is_sized:
            unknown[kind] = None
        else:
            planning_s = _planning_s(condition, scenario) if scenario else 0.0
            work_s, sized = work_s + planning_s + CONDITION_S, sized + 1
    return Duration(work_s + driven.time_s, timed, sized, tuple(unknown), driven.runs)


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
    if not condition.planned_by.stops:
        return 0.0  # its legs are few beside those of a search that uses up its budget
    return LEG_S * scenario.search.work


class _Driven:
    """The sets of targets that SUMO drives for conditions, each shared one counted once."""

    def __init__(self) -> None:
        self._costs: dict[str, Cost] = {}
        self._networks: dict[tuple[Path, str], RoadNetwork] = {}

    @property
    def runs(self) -> int:
        """How many runs of SUMO that takes."""
        return sum(cost.runs for cost in self._costs.values())

    @property
    def time_s(self) -> float:
        """How long it takes with one process, seconds."""
        return sum(cost.wall_s(1) for cost in self._costs.values())

    def add(self, condition: Condition, scenario: Scenario) -> None:
        """Add what a condition needs, as far as its network can be opened."""
        with suppress(PlannerError):
            self._add(condition, scenario, self._network(scenario))

    def _network(self, scenario: Scenario) -> RoadNetwork:
        key = (scenario.folder, scenario.network.model_dump_json())
        if key not in self._networks:
            self._networks[key] = open_network(scenario.network, scenario.folder)
        return self._networks[key]

    def _add(self, condition: Condition, scenario: Scenario, network: RoadNetwork) -> None:
        search, horizon_s = scenario.search, scenario.search.horizon_s
        target, truth = (part.model_dump(mode="json") for part in (scenario.target, scenario.truth))
        mine = [condition.scenario, horizon_s, condition.seed]
        planned = json.dumps([*mine, target, search.particles, search.sampling])
        known = partial(cost_of, network, driving=scenario.target.driving, horizon_s=horizon_s)
        true = partial(cost_of, network, driving=scenario.truth.driving, horizon_s=horizon_s)
        if search.sampling != "all":  # those are few
            method = condition.planned_by
            self._costs[f"{planned} planning"] = known(search.particles)
            if method.chooses:
                self._costs[f"{planned} holdout"] = known(holdout_particles(scenario, network))
            if method.takes_options and scenario.greedy.particles == "anew":
                self._costs[f"{planned} anew"] = known(search.depth * search.particles)
        self._costs[json.dumps([*mine, truth])] = true(condition.targets)
        for one in condition.sets:
            key = json.dumps([condition.scenario, horizon_s, truth, one.truth, one.points])
            if key not in self._costs:
                with suppress(PlannerError):
                    self._costs[key] = true(len(enumerated(one, condition)))


def _scenario(condition: Condition) -> Scenario | None:
    """Return a condition's scenario, None where it is at fault: then it takes no time."""
    with suppress(PlannerError):
        return read_scenario(condition.place, preset=condition.preset, overrides=condition.settings)
    return None
