"""What a page shows: a plan, and what it and other flights are worth on the same targets."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.detection.chase import chased_by_any
from planner.detection.evaluation import Evaluation
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.mission.certify import problem_of_plan
from planner.mission.opening import OpenScenario
from planner.page.rows import Row, rows_of
from planner.page.words import Clock
from planner.search.problem import Problem

BEST_POSSIBLE = "no flight finds more"


@dataclass(frozen=True, eq=False)
class Shown:
    """A plan, the targets it was evaluated on, and other flights evaluated on the same."""

    opened: OpenScenario
    plan: Plan
    fresh: Futures
    evaluated: Evaluation  # of the plan, on these
    compared: Mapping[str, Evaluation]  # other flights by name, on these

    @cached_property
    def problem(self) -> Problem:
        """What the plan answers, with the fresh targets in the particles' place."""
        return problem_of_plan(self.opened, self.plan, self.fresh)

    @property
    def sought(self) -> int:
        """How many targets are searched for."""
        return self.evaluated.objective.sought

    @property
    def names(self) -> dict[int, str]:
        """What those targets are called, by number; empty where the scenario has one."""
        names = self.opened.scenario.target_names
        there = np.unique(self.fresh.target).tolist() if len(names) > 1 else ()
        return {number: names[number] for number in there}

    @property
    def radius_m(self) -> float:
        """How far the sensor sees."""
        return self.problem.sensor.radius_m

    @cached_property
    def clock(self) -> Clock:
        """How times are told."""
        return Clock(self.opened.scenario.target.sighted_at)

    @cached_property
    def until_s(self) -> float:
        """When nothing happens any more: the flight has ended, and what it finds is found."""
        found_s = self.evaluated.seen_at[self.evaluated.found]
        last_s = float(found_s.max(initial=self.evaluated.objective.by_s or 0.0))
        return min(max(self.plan.end_s, last_s), self.evaluated.objective.horizon_s)

    @cached_property
    def curves(self) -> Mapping[str, Evaluation]:
        """All detection curves by name: the plan's, other flights', and what none surpasses."""
        mine, problem = self.evaluated, self.problem
        at_best_s = chased_by_any(self.fresh, problem.flying, problem.sensor)
        ceiling = Evaluation(at_best_s, mine.weight, mine.end_s, mine.objective, target=mine.target)
        return {self.plan.method: mine, **self.compared, BEST_POSSIBLE: ceiling}

    @cached_property
    def rows(self) -> list[list[Row]]:
        """The legs of each flight."""
        network, uavs = self.opened.network, self.problem.uavs
        homes_m = [uavs[flight.uav].return_to_m for flight in self.plan.flights]
        flown = zip(self.plan.tracks, self.plan.legs, homes_m, strict=True)
        return [
            rows_of(track, legs, network, home_m=home_m, radius_m=self.radius_m)
            for track, legs, home_m in flown
        ]
