"""From an open scenario and its futures to problems, and what methods make of them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from planner.detection.objective import Objective
from planner.detection.sensor import Sensor, rate_of, rate_of_sweep
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.mission.aircraft import aircraft_of
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder
from planner.mission.uav_places import in_air
from planner.scenario.sections import SensorSection
from planner.search.fleet import fleet
from planner.search.greedy_options import GreedyOptions
from planner.search.methods import Method, Planner, plans_for_misses
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.searched import named_as_before, searched_problem
from planner.streams import stream


def problem_of(opened: OpenScenario, futures: Futures, *, method: Method | None = None) -> Problem:
    """Return the planning problem of a scenario on given futures; of a fleet, its first UAV's.

    Parameters
    ----------
    method
        One that plans by simulation takes off later by the scenario's ``planning_time_s``.
    """
    return problems_of(opened, futures, method=method)[0]


def problems_of(
    opened: OpenScenario, futures: Futures, *, method: Method | None = None
) -> tuple[Problem, ...]:
    """Return the planning problem of each UAV of a scenario, as if it were alone."""
    scenario = opened.scenario
    charged_s = scenario.search.planning_time_s if method and method.simulates else 0.0
    ready_s = scenario.target.last_seen_ago_s
    places = zip(scenario.uavs, opened.starts_m, opened.landings_m, strict=True)
    uavs = [
        Uav(
            x_m=x_m,
            y_m=y_m,
            take_off_s=ready_s + section.take_off_s + charged_s,
            speed_mps=section.speed_mps,
            altitude_m=section.altitude_m,
            max_flight_time_s=section.max_flight_time_s or np.inf,
            return_to_m=home_m,
            link_m=section.link_m or np.inf,
            aircraft=aircraft_of(section),
            sorties=1 if section.sorties is None else section.sorties,
            swap_s=section.swap_s or 0.0,
        )
        for section, (x_m, y_m), home_m in places
    ]
    uavs = [
        uav if section.in_air is None else in_air(uav, section.in_air, opened.network)
        for uav, section in zip(uavs, scenario.uavs, strict=True)
    ]
    # All carry the same sensor: its rate is what makes a pass of the first one detect as said.
    sensor = sensor_of(scenario.sensor, scenario.uav.speed_mps)
    search = scenario.search
    by_s = search.by_s if search.objective == "probability" else None
    objective = Objective(search.horizon_s, by_s, sought=opened.sought)
    return tuple(
        Problem(
            opened.network,
            futures,
            uav,
            sensor,
            objective,
            airspace=airspace,
            others=tuple(uavs[:number] + uavs[number + 1 :]),
        )
        for number, (uav, airspace) in enumerate(zip(uavs, opened.airspaces, strict=True))
    )


def sensor_of(section: SensorSection, speed_mps: float) -> Sensor:
    """Return the sensor that a scenario describes, of a UAV that flies at a speed."""
    radius_m, width_m = section.radius_m, section.sweep_width_m
    if width_m is None:
        rate_per_s = rate_of(section.detects or 1.0, radius_m, speed_mps)
    else:
        rate_per_s = rate_of_sweep(width_m, radius_m, speed_mps)
    return Sensor(radius_m, section.detects_in_transit, rate_per_s)


def needs_holdout(method: Method, opened: OpenScenario) -> bool:
    """Return whether other particles have to be drawn; there are none where all are enumerated."""
    return method.chooses and opened.scenario.search.sampling != "all"


def holdout_for(method: Method, recorder: Recorder) -> Futures | None:
    """Return the particles on which a method chooses between plans; None if it needs none."""
    return recorder.holdout().futures if needs_holdout(method, recorder.opened) else None


def make_plan(
    method: Method,
    opened: OpenScenario,
    recorder: Recorder,
    futures: Futures,
    *,
    holdout: Futures | None = None,
    budget: Budget | None = None,
) -> SearchResult:
    """Return what a method makes of a scenario on given futures.

    Parameters
    ----------
    holdout
        Other particles, for methods that choose between plans.
    budget
        The scenario's own if not given.

    Raises
    ------
    NotApplicableError
        If the method cannot work on this problem.
    InputError
        If its flight does not keep to the airspace.
    """
    budget = budget or budget_of(opened)
    extra: dict[str, Any] = {"holdout": holdout}
    # Without a holdout nothing says that the futures come from what is believed of the target.
    if holdout is not None and (budget.free if method.moves_freely else method.proposes):
        extra["proposals"] = recorder.proposals(futures)
    problems = [one.replace(**extra) for one in problems_of(opened, futures, method=method)]
    if not plans_for_misses(method.name):
        problems = [one.replace(sensor=one.sensor.without_misses) for one in problems]
    rng = stream(opened.scenario.search.seed, "planner", method.name)
    planner = _within_airspace(_planner(method, opened, recorder))
    flying = [number for number, one in enumerate(problems) if one.uav.sorties]
    flights = sum(problems[number].uav.sorties for number in flying)
    if flights > 1:
        those = [problems[number] for number in flying]
        found = fleet(those, planner, budget=budget, rng=rng, together=method.teams)
    else:
        found = planner(problems[flying[0]], budget=budget, rng=rng)
    return _numbered(found, flying)


def _numbered(found: SearchResult, flying: Sequence[int]) -> SearchResult:
    """Return a result whose flights are of the UAVs that fly, with their numbers in the scenario.

    Parameters
    ----------
    flying
        The numbers of those that fly.
    """
    if flying == [*range(len(flying))]:
        return found
    plan = found.plan
    sorties = tuple(one._replace(uav=flying[one.uav]) for one in plan.flights)
    return replace(found, plan=replace(plan, sorties=sorties))


def _within_airspace(planner: Planner) -> Planner:
    """Return a planner that keeps to the airspace of a problem, over the roads that lie in it."""

    def plan(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
        if problem.airspace is None:
            return planner(problem, budget=budget, rng=rng)
        searched, roads = searched_problem(problem)
        found = planner(searched, budget=budget, rng=rng)
        for track in found.plan.tracks:
            problem.airspace.refuse(track)
        return replace(found, plan=named_as_before(found.plan, roads))

    return plan


def budget_of(opened: OpenScenario) -> Budget:
    """Return how much a scenario lets planners do."""
    search = opened.scenario.search
    return Budget(roads=search.depth, work=search.work, free=may_leave_roads(opened))


def may_leave_roads(opened: OpenScenario) -> bool:
    """Return whether `best` may leave the roads; in towns unless the scenario says otherwise."""
    free, sees = opened.scenario.search.free, opened.scenario.sensor.detects_in_transit
    return sees and not opened.network.is_abstract if free is None else free


def _planner(method: Method, opened: OpenScenario, recorder: Recorder) -> Planner:
    planner: Callable[..., SearchResult] = method.load()
    if not method.takes_options:
        return planner

    def again(step: int) -> Futures:
        return recorder.planning(step).futures

    options = GreedyOptions(**opened.scenario.greedy.model_dump())
    return partial(planner, options=options, resample=again)
