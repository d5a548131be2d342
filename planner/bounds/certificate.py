"""How far a plan may be from the best one of its class, on the same particles."""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from planner.arrays import Floats
from planner.bounds.any_flight import STARTS, most_of_any_flight
from planner.bounds.branch_and_bound import Prefix, Search
from planner.bounds.movements import Movements
from planner.bounds.particle_prices import table_of
from planner.bounds.proof import proven_reward
from planner.detection.evaluate import evaluate
from planner.detection.kernels.closest_approach import first_in_reach
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.progress import Progress, silent
from planner.search.problem import Problem
from planner.search.result import TracePoint
from planner.search.stop import Stop, WorkDone

STEPS, FIRST_STEPS, FURTHER_STEPS = 600, 150, 6  # in all, before take-off, for a prefix
USUAL = WorkDone(STEPS)


@dataclass(frozen=True)
class Effort:
    """When the search for better prices ends."""

    gap: float = 0.0  # as soon as the gap is this small
    stop: Stop = USUAL  # a unit of work is a price step
    on_progress: Progress = silent  # is given the steps done, those usual, and the gap


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

    Raises
    ------
    NotApplicableError
        If the net is too large for the bound on road plans, or the search has begun already.
    """
    if problem.start is not None:
        raise NotApplicableError("a search that has begun has no bound yet; bound the whole one")
    objective, movements = problem.objective, Movements(problem)
    seen_at = evaluate(plan.tracks, problem.futures, problem.sensor, objective).seen_at
    earned, weight = objective.reward(seen_at), problem.futures.weight
    reward = float(weight @ earned)
    value = objective.value(reward)
    earliest_s = earliest(movements)
    most = float(weight @ objective.reward(earliest_s))
    steps, trace = itertools.count(1), list[TracePoint]()

    def stop(bounded: float) -> bool:
        bound, step = objective.value(min(bounded, most)), next(steps)
        gap = gap_of(value, bound)
        if not trace or trace[-1].value != bound:
            trace.append(TracePoint(step, bound))
        note = f"value {value:,.6g}, bound {bound:,.6g}, gap {gap:.1%}"
        effort.on_progress(step, STEPS, note)
        return gap <= effort.gap or effort.stop(step)

    if not plan.follows_roads:
        bound = objective.value(min(most, most_of_any_flight(problem, earliest_s, earned, stop)))
        physics = objective.value(most)
        return Certificate(value, bound, "free", trace=tuple(trace), physics=physics)
    bin_s = movements.fitting_bin_s
    search = _searched(movements, bin_s, earned, stop)
    bound = objective.value(min(search.bound, most))
    return Certificate(value, bound, "roads", bin_s, search.proof, search.better, tuple(trace))


def proven_bound(movements: Movements, certificate: Certificate) -> float:
    """Return the bound that a certificate's prices prove, whatever it says itself.

    Raises
    ------
    NotApplicableError
        If bins as long as it says make no table.
    """
    objective, weight = movements.problem.objective, movements.problem.futures.weight
    most = float(weight @ objective.reward(earliest(movements)))
    if certificate.plan_class == "roads":
        most = min(most, proven_reward(movements, certificate.bin_s, certificate.proof))
    return objective.value(most)


def _searched(
    movements: Movements, bin_s: float, earned: Floats, stop: Callable[[float], bool]
) -> Search:
    """Return a search for the best bound that has ended, started from what a plan earns."""
    table, weight = table_of(movements, bin_s), movements.problem.futures.weight
    start = min((share * earned for share in STARTS), key=lambda prices: table.bound(prices).reward)
    search = Search(movements, table, float(weight @ earned), stop)
    search.begin(start, FIRST_STEPS)
    while not search.done and not search.stopped:
        search.split(FURTHER_STEPS)
    return search


def earliest(movements: Movements) -> Floats:
    """Return when a UAV that knew each particle could first meet it, (N,) seconds; inf: never.

    The circle around the place of take-off with the detection radius grows with the UAV's speed;
    a particle can be seen as soon as it is inside.
    """
    uav, sensor = movements.problem.uav, movements.problem.sensor
    seen_at = np.full(len(movements.problem.futures), np.inf)
    motion, particle = movements.pieces
    columns = (column.tolist() for column in motion)
    for k, from_s, to_s, x, y, vx, vy in zip(particle.tolist(), *columns, strict=True):
        begin_s = max(from_s, uav.take_off_s)
        if begin_s > to_s or seen_at[k] <= begin_s:
            continue
        moved_s = begin_s - from_s
        offset_m = (x + vx * moved_s - uav.x_m, y + vy * moved_s - uav.y_m)
        ring_m = sensor.radius_m + uav.speed_mps * (begin_s - uav.take_off_s)
        after_s = first_in_reach(offset_m, (vx, vy), ring_m, uav.speed_mps)
        if begin_s + after_s <= to_s:
            seen_at[k] = begin_s + after_s
    return seen_at
