"""How far a plan may be from the best one of its class, on the same particles."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.bounds.any_flight import most_of_any_flight
from planner.bounds.branch_and_bound import Search
from planner.bounds.fleet_prices import FleetTable, fitting_bin_s
from planner.bounds.flights import Prefix
from planner.bounds.movements import Movements
from planner.bounds.particle_prices import table_of
from planner.bounds.proof import proven_reward
from planner.bounds.subgradient import first_prices, lowest
from planner.detection.chase import chased_by_any
from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.messages import percent
from planner.progress import Progress, silent
from planner.search.problem import Problem
from planner.search.result import TracePoint
from planner.search.stop import Stop, WorkDone

STEPS, FIRST_STEPS, FURTHER_STEPS = 600, 150, 6  # in all, before take-off, for a prefix
USUAL = WorkDone(STEPS)
FALLS = (4.0, 2.0, 1.0, 0.5)  # how far prices may fall where tables are too large, in mean delays
# Missed on a pass, up to which the bound of a sensor that misses nobody is as good in as long: its
# steps take half the time (docs/methods.md has figures).
LITTLE = 0.005


@dataclass(frozen=True)
class Effort:
    """When the search for better prices ends."""

    gap: float = 0.0  # as soon as the gap is this small
    stop: Stop = USUAL  # a unit of work is a price step
    on_progress: Progress = silent  # is given the steps done, those usual, and the gap
    workers: int = 1  # threads; with any number of them the same steps find the same


@dataclass(frozen=True, eq=False)
class Certificate:
    """A bound that no plan of a class can pass, with the prices that prove it."""

    value: float  # the plan's figure on the particles: seconds, or a probability
    bound: float  # no plan's figure is better
    plan_class: str  # "roads", or "free": any flight
    bin_s: float = 0.0  # how finely the bound for roads looks, seconds
    # prices, (N,) in units of reward, for prefixes of flights that have their own
    proof: Mapping[Prefix, Floats] = field(default_factory=dict)
    better: tuple[int, ...] = ()  # legs met on the way that earn more than the plan, if any
    trace: tuple[TracePoint, ...] = ()  # the bound after how many steps
    # with each particle met as early as the UAV can be there: all that files prove for "free"
    physics: float | None = None
    rate_per_s: float = math.inf  # of the sensor that the prices are for: the problem's, or perfect

    @property
    def gap(self) -> float:
        """How far the value is from the bound, as a share of the bound."""
        return gap_of(self.value, self.bound)

    @property
    def proven(self) -> float:
        """The part of the bound that its files prove."""
        return self.bound if self.physics is None else self.physics


def gap_of(value: float, bound: float) -> float:
    """Return how far a value is from a bound, as a share of the bound."""
    return abs(value - bound) / bound if bound > 0.0 else math.inf


def certified(problem: Problem, plan: Plan, effort: Effort) -> Certificate:
    """Return the certificate of a plan, for plans over roads if it is one, else for any flight.

    Plans of real aircraft are bounded as flights of an ideal one as fast as they ever are, which
    sees as far as from anywhere beside their lines where they may be.

    Raises
    ------
    NotApplicableError
        If the net is too large for the bound on road plans, or the search has begun already.
    """
    if problem.start is not None:
        raise NotApplicableError("a search that has begun has no bound yet; bound the whole one")
    if problem.airspace is not None:
        raise NotApplicableError("there is no bound yet on flights within [airspace]")
    strays_m = [uav.strays_m for uav in problem.flying if uav.aircraft is not None]
    on_roads = plan.follows_roads and not strays_m
    objective = problem.objective
    if objective.sought > 1:
        raise NotApplicableError("there is no bound yet on searches for several targets")
    earned = evaluate(plan.tracks, problem.futures, problem.sensor, objective).reward
    # Who misses nobody earns no less: its bound is one for a sensor that may miss, too.
    own, problem = problem, problem.replace(sensor=problem.sensor.without_misses)
    if own.sensor.detects(own.uav.speed_mps) >= 1.0 - LITTLE:
        own = problem
    if strays_m:
        wider = replace(problem.sensor, radius_m=problem.sensor.radius_m + max(strays_m))
        uav, *others = (uav.fastest for uav in problem.uavs)
        problem = problem.replace(uav=uav, others=tuple(others), sensor=wider)
    weight = problem.futures.weight
    value = objective.value(float(weight @ earned))
    earliest_s = chased_by_any(problem.futures, problem.flying, problem.sensor)
    most = float(weight @ objective.reward(earliest_s))
    soonest = float(objective.reward(earliest_s).max(initial=0.0))
    floors = _floors(objective, earned, weight, soonest)
    so_far = _SoFar(effort, objective, value, most)
    of_fleet = len(plan.tracks) > 1 or bool(problem.others) or problem.uav.sorties != 1
    if not on_roads and of_fleet:  # there is but what none surpasses
        bound = objective.value(most)
        return Certificate(value, bound, "free", physics=bound)
    if not on_roads:
        reward = min(most, most_of_any_flight(problem, earliest_s, earned, so_far.hear))
        bound, physics = objective.value(reward), objective.value(most)
        return Certificate(value, bound, "free", trace=tuple(so_far.trace), physics=physics)
    bounded, beforehand = _of_fleet if of_fleet else _of_one, _Beforehand(earned, floors, most)
    try:
        return bounded(own, beforehand, so_far)
    except NotApplicableError:
        if own.sensor.is_perfect:
            raise
        # Whom a sensor may miss it may see again: its table is several times as large.
        return bounded(problem, beforehand, so_far)


class _Beforehand(NamedTuple):
    """What is found of a problem before its tables are made."""

    earned: Floats  # (N,) by the plan
    floors: list[Floats]  # under prices, to be tried in this order, (N,) each
    most: float  # by the earliest sightings


def _floors(objective: Objective, earned: Floats, weight: Floats, soonest: float) -> list[Floats]:
    """Return floors under the prices of a plan, (N,) each, from 0 on.

    The higher ones are below what it earns with each particle by so many times as much as it earns
    less, in the mean, than the soonest sighting of all.
    """
    falls = [np.inf]
    if objective.by_s is None:  # else all sightings earn the same, and none can be left out
        present = float(weight.sum())  # the mean is of those who are there
        mean = float(weight @ earned) / present if present > 0.0 else 0.0
        falls += [fall * (soonest - mean) for fall in FALLS]
    return [np.maximum(0.0, earned - fall) for fall in falls]


def _of_one(problem: Problem, beforehand: _Beforehand, so_far: "_SoFar") -> Certificate:
    """Return the certificate of the only UAV's plan over roads."""
    movements = Movements(problem)
    search = _searched(movements, beforehand, so_far)
    return Certificate(
        so_far.value,
        problem.objective.value(min(search.bound, beforehand.most)),
        "roads",
        movements.fitting_bin_s,
        search.proof,
        search.better,
        tuple(so_far.trace),
        rate_per_s=problem.sensor.rate_per_s,
    )


def _of_fleet(problem: Problem, beforehand: _Beforehand, so_far: "_SoFar") -> Certificate:
    """Return the certificate of a fleet's plan over roads."""
    objective, value = problem.objective, so_far.value
    table = FleetTable.of(problem, fitting_bin_s(problem), beforehand.floors)
    reward = float(problem.futures.weight @ beforehand.earned)
    start = first_prices(table, beforehand.earned)
    found, prices = lowest(table, start, reward, steps=FIRST_STEPS, stop=so_far.hear)
    return Certificate(
        value,
        objective.value(min(found, beforehand.most)),
        "roads",
        table.bin_s,
        {(): prices},
        trace=tuple(so_far.trace),
        rate_per_s=problem.sensor.rate_per_s,
    )


class _SoFar:
    """How far a search for a bound has got, and whether it ends."""

    def __init__(self, effort: Effort, objective: Objective, value: float, most: float) -> None:
        self.effort, self._objective, self.value, self._most = effort, objective, value, most
        self._steps, self.trace = 0, list[TracePoint]()

    def hear(self, bounded: float) -> bool:
        """Take note of the most that is known after one more step; tell whether to end."""
        bound = self._objective.value(min(bounded, self._most))
        self._steps += 1
        gap = gap_of(self.value, bound)
        if not self.trace or self.trace[-1].value != bound:
            self.trace.append(TracePoint(self._steps, bound))
        note = f"value {self.value:,.6g}, bound {bound:,.6g}, gap {percent(gap)}"
        self.effort.on_progress(self._steps, STEPS, note)
        return gap <= self.effort.gap or self.is_late()

    def is_late(self) -> bool:
        """Tell whether to end, without a step."""
        return self.effort.stop(self._steps)


def proven_bound(problem: Problem, certificate: Certificate) -> float:
    """Return the bound that a certificate's prices prove, whatever it says itself.

    Raises
    ------
    NotApplicableError
        If bins as long as it says make no table, or the prices are for a sensor that sees less.
    """
    objective, sensor = problem.objective, problem.sensor
    if certificate.rate_per_s < sensor.rate_per_s:
        raise NotApplicableError("the prices are for a sensor that sees less")
    seen_at = chased_by_any(problem.futures, problem.flying, sensor)
    most = float(problem.futures.weight @ objective.reward(seen_at))
    if certificate.plan_class == "roads":
        problem = problem.replace(sensor=replace(sensor, rate_per_s=certificate.rate_per_s))
        most = min(most, _most_by_prices(problem, certificate))
    return objective.value(most)


def _most_by_prices(problem: Problem, certificate: Certificate) -> float:
    if not problem.others:
        return proven_reward(Movements(problem), certificate.bin_s, certificate.proof)
    prices = certificate.proof.get(())
    if prices is None or np.any(~(prices >= 0.0)):
        return math.inf
    return FleetTable.of(problem, certificate.bin_s, [prices]).bound(prices).reward


def _searched(movements: Movements, beforehand: _Beforehand, so_far: _SoFar) -> Search:
    """Return a search for the best bound that has ended, started from what a plan earns."""
    table = table_of(movements, movements.fitting_bin_s, beforehand.floors)
    start = first_prices(table, beforehand.earned)
    search = Search(
        movements,
        table,
        float(table.weight @ beforehand.earned),
        so_far.hear,
        is_late=so_far.is_late,
        workers=so_far.effort.workers,
    )
    search.begin(start, FIRST_STEPS)
    while not search.done and not search.stopped:
        search.split(FURTHER_STEPS)
    return search
