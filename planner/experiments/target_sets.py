"""What plans achieve on sets of true targets, which SUMO drives."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.belief.distribution import Distribution, Listed
from planner.belief.particles import Particles
from planner.belief.prior import Prior
from planner.belief.recipe import Drawn
from planner.detection.evaluate import evaluate
from planner.detection.sensor import rate_of
from planner.errors import InputError
from planner.experiments.condition import Condition
from planner.experiments.target_set import POINTS, TargetSet
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.futures.record import How
from planner.futures.store import recorded
from planner.futures.truncate import parked
from planner.mission.opening import OpenScenario
from planner.search.problem import Problem
from planner.streams import stream

AT_HAND = 8  # sets of targets that a process keeps in memory, from one condition to the next


@dataclass(frozen=True, eq=False)
class RecordedTargets:
    """A set's targets as they move."""

    futures: Futures
    route: tuple[str, ...]  # (N,)


_at_hand: dict[str, RecordedTargets] = {}


def targets_of(target_set: TargetSet, condition: Condition, *, workers: int = 1) -> RecordedTargets:
    """Return the targets of a set, from SUMO or the cache.

    Raises
    ------
    InputError
        If the set has a route that no target takes.
    """
    return _targets(target_set, condition.opened(target_set.truth), workers)


def _targets(target_set: TargetSet, opened: OpenScenario, workers: int) -> RecordedTargets:
    truth = opened.scenario.truth.model_dump(mode="json", exclude={"name"})
    made_of = {"truth": truth, "points": target_set.points, "parks": target_set.parks}
    key = json.dumps([opened.network.sha256, opened.scenario.search.horizon_s, made_of])
    if key not in _at_hand:
        while len(_at_hand) >= AT_HAND:
            _at_hand.pop(next(iter(_at_hand)))
        _at_hand[key] = _all_routes(target_set, opened, workers)
    return _on_route(target_set, _at_hand[key]) if target_set.route else _at_hand[key]


def enumerated(target_set: TargetSet, condition: Condition) -> Particles:
    """Return a set's targets before SUMO drives them, on all routes.

    Raises
    ------
    PlannerError
        If the scenario is at fault.
    """
    opened = condition.opened(target_set.truth)
    return _recipe(target_set, opened).particles(opened.network)


def _recipe(target_set: TargetSet, opened: OpenScenario) -> Drawn:
    prior = opened.truth_prior
    if not isinstance(prior, Prior):
        raise InputError("sets: take single targets; leave target.mix out, and give one [target]")
    prior = replace(
        prior,
        speed_mps=_at_points(prior.speed_mps, target_set.points),
        distance_m=prior.distance_m and _at_points(prior.distance_m, target_set.points),
    )
    horizon_s = opened.scenario.search.horizon_s
    # The stream gives the seeds of SUMO's driver alone.
    return Drawn(prior, 0, horizon_s, 0, ("target set",), "all")


def _all_routes(target_set: TargetSet, opened: OpenScenario, workers: int) -> RecordedTargets:
    described = {"truth": opened.scenario.truth.model_dump(mode="json", exclude={"name"})}
    recipe = _recipe(target_set, opened)
    recording = recorded(opened.network, recipe, scenario=described, how=How(workers=workers))
    futures = recording.futures
    if target_set.parks:
        futures = parked(futures, stream(0, "parks"))
    return RecordedTargets(futures, recording.route)


def figures_on(condition: Condition, problem: Problem, plan: Plan) -> dict[str, dict[str, Any]]:
    """Return what a plan achieves on a condition's sets of targets, by the name of the set."""
    # Many sets differ in their routes alone: the scenario is opened once for each truth.
    opened = {truth: condition.opened(truth) for truth in {one.truth for one in condition.sets}}
    return {
        one.name: _figures(one, _targets(one, opened[one.truth], 1), problem, plan)
        for one in condition.sets
    }


def _figures(
    target_set: TargetSet, targets: RecordedTargets, problem: Problem, plan: Plan
) -> dict[str, Any]:
    sensor = problem.sensor
    if target_set.detects < 1.0:
        rate_per_s = rate_of(target_set.detects, sensor.radius_m, float(problem.uav.speed_mps))
        sensor = replace(sensor, rate_per_s=rate_per_s)
    evaluated = evaluate(plan.tracks, targets.futures, sensor, problem.objective)
    figures: dict[str, Any] = {
        "expected_detection_time_s": evaluated.expected_detection_time_s,
        "detection_probability": evaluated.detection_probability,
        "found_before_goal_probability": evaluated.found_before_goal_probability,
        "goal_s": [float(targets.futures.end_s.min()), float(targets.futures.end_s.max())],
    }
    if problem.objective.by_s is not None:
        figures["found_by_probability"] = evaluated.figure
    if target_set.by_route:
        figures["routes"] = _by_route(targets.route, evaluated.weight, evaluated.time_s)
    return figures


def _by_route(route: Sequence[str], weight: Floats, time_s: Floats) -> dict[str, list[float]]:
    """Return each route's probability and its expected time, by its edges."""
    names, which = np.unique(np.array(route), return_inverse=True)
    total = np.bincount(which, weight)
    mean = np.bincount(which, weight * time_s) / total
    shown = zip(names.tolist(), total.tolist(), mean.tolist(), strict=True)
    return {name: [share, time] for name, share, time in shown}


def _at_points(values: Distribution, points: int) -> Distribution:
    if isinstance(values, Listed) and (points >= POINTS or len(values.values) <= points):
        return values
    middles = (np.arange(points) + 0.5) / points
    return Listed(values.quantile(middles), np.full(points, 1 / points))


def _on_route(target_set: TargetSet, targets: RecordedTargets) -> RecordedTargets:
    chosen = np.array([route == target_set.route for route in targets.route])
    if not chosen.any():
        raise InputError(f"sets.{target_set.name}.route: no target takes it; name all its edges")
    futures = targets.futures.take(chosen)
    weight = futures.weight / futures.weight.sum()
    return RecordedTargets(replace(futures, weight=weight), (target_set.route,) * len(weight))
