"""A frozen set of search problems, each with the best plan known, for methods to be compared on."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.bounds.certificate import Effort, certified, gap_of
from planner.detection.chase import chased_alone
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.errors import InputError, NotApplicableError
from planner.experiments.condition import Condition
from planner.files import shipped, shipped_names
from planner.flight.legs import legs_named
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.guard import parsed_toml, read_text
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.planning import problem_of
from planner.mission.sample_sizes import FRESH_TARGETS
from planner.scenario.source import scenario_path
from planner.scenario.toml_text import toml_text
from planner.search.methods import Method
from planner.search.plan import plan_of_legs, plan_of_waypoints
from planner.search.problem import Problem
from planner.search.stop import WorkDone

BEST_KNOWN = "best known"
FILE = "instances.toml"  # beside one of the shipped scenarios
KEYS = ("name", "scenario", "seed", "set", "method", "value_s", "low_s", "high_s", "plan")


@dataclass(frozen=True)
class Bound:
    """What no plan can pass on the particles planned with, beside the best plan known."""

    planned_s: float  # the best plan's figure on these particles
    bound_s: float
    plan_class: str  # of which it holds: "roads", or "free", any flight whatever
    note: str = ""  # why there is none for plans over roads alone

    @property
    def gap(self) -> float:
        """By what share of the bound the plan is above it."""
        return gap_of(self.planned_s, self.bound_s)


@dataclass(frozen=True)
class Instance:
    """A scenario with its overrides and seed, and the best plan that is known for it."""

    name: str
    scenario: str
    overrides: tuple[str, ...]
    seed: int  # of the futures planned with and of the fresh targets
    method: str  # that found the plan
    value_s: float  # E[min(tau, horizon)] on the fresh targets of the seed
    low_s: float  # 95 % interval
    high_s: float
    plan: tuple[str, ...]  # names of roads in the order flown
    bound: "Bound | None" = None
    # where the plan flies to if it leaves the roads: x and y in metres, seconds of hovering
    stops: tuple[tuple[float, float, float], ...] = ()
    targets: int = FRESH_TARGETS  # fresh ones, on which plans are evaluated

    def condition(self, method: Method) -> Condition:
        """Return the condition in which a method plans for this instance."""
        return Condition(
            scenario=self.scenario,
            preset=None,
            overrides=self.overrides,
            method=method.name,
            own=method.own,
            seed=self.seed,
            targets=self.targets,
            place=scenario_path(self.scenario),
            levels={"instance": self.name},
        )

    def opened(self) -> OpenScenario:
        """Return its scenario, open."""
        settings = (*self.overrides, f"search.seed={self.seed}")
        return open_scenario(self.scenario, overrides=settings)


def instances_path() -> Path:
    """Return the file of the instances that come with the package."""
    folders = filter(None, map(shipped, shipped_names()))
    return next(folder / FILE for folder in folders if (folder / FILE).is_file())


def read_instances(path: Path) -> list[Instance]:
    """Return the instances in a file.

    Raises
    ------
    InputError
        If it is missing or broken.
    """
    try:
        tables = parsed_toml(read_text(path))["instance"]
        return [_instance(table) for table in tables]
    except InputError:
        raise
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: holds no instances ({error}); each needs {', '.join(KEYS)}"
        ) from error


def _instance(table: Mapping[str, Any]) -> Instance:
    return Instance(
        name=table["name"],
        scenario=table["scenario"],
        overrides=tuple(f"{key}={toml_text(value)}" for key, value in table["set"].items()),
        seed=table["seed"],
        method=table["method"],
        value_s=table["value_s"],
        low_s=table["low_s"],
        high_s=table["high_s"],
        plan=tuple(table["plan"].split()),
        bound=_bound(table) if "bound_s" in table else None,
        stops=tuple((float(x), float(y), float(s)) for x, y, s in table.get("stops", ())),
        targets=table.get("targets", FRESH_TARGETS),
    )


def _bound(table: Mapping[str, Any]) -> Bound:
    return Bound(
        planned_s=table["planned_s"],
        bound_s=table["bound_s"],
        plan_class=table["bound_for"],
        note=table.get("bound_note", ""),
    )


def flown_again(instance: Instance, opened: OpenScenario, fresh: Futures) -> Evaluation:
    """Return what an instance's best known plan is worth on fresh targets.

    Raises
    ------
    InputError
        If the plan names a road that is not there.
    """
    problem = problem_of(opened, fresh)
    plan = best_known(instance, problem)
    return evaluate(plan.tracks, fresh, problem.sensor, problem.objective)


def best_known(instance: Instance, problem: Problem) -> Plan:
    """Return an instance's best known plan, for its problem on any futures.

    Raises
    ------
    InputError
        If it names a road that is not there.
    """
    if instance.stops:
        return plan_of_waypoints(problem, BEST_KNOWN, np.array(instance.stops))
    return plan_of_legs(problem, BEST_KNOWN, legs_named(problem.network, instance.plan))


def bound_on(instance: Instance, futures: Futures, steps: int) -> Bound:
    """Return a bound on the particles planned with; for any flight where none is for roads.

    Parameters
    ----------
    steps
        Of the search for a better bound; each leaves one that holds.
    """
    opened = instance.opened()
    problem = problem_of(opened, futures)
    plan = best_known(instance, problem)
    try:
        found = certified(problem, plan, Effort(stop=WorkDone(steps)))
        return Bound(found.value, found.bound, found.plan_class)
    except NotApplicableError as error:
        flown = evaluate(plan.tracks, futures, problem.sensor, problem.objective)
        seen_at = chased_alone(futures, problem.uav, problem.sensor)
        least_s = np.minimum(seen_at, problem.horizon_s)
        bound_s = float(futures.weight @ least_s)
        return Bound(flown.expected_detection_time_s, bound_s, "free", str(error))
