"""How far a plan may be from the best one of its class, on the same particles."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, freeze
from planner.detection.first_detection import first_detection
from planner.search.bound import Grain, pieces_of, table_of
from planner.search.plan import Plan
from planner.search.prices import lowest
from planner.search.problem import Problem

FLOOR = 0.5  # of what the plan earns with a particle: no price is lower
STARTS = (0.99, 0.97, 0.93, 0.85, 0.75)  # the same shares, of which the best is gone on from
STEPS = 600


@dataclass(frozen=True)
class Effort:
    """When the search for better prices ends."""

    gap: float = 0.0  # as soon as the gap is this small
    steps: int = STEPS
    stop: Callable[[], bool] = bool
    told: Callable[[int, float, float, float], None] | None = None  # step, value, bound, gap


@dataclass(frozen=True, eq=False)
class Certificate:
    """A bound that no plan of a class can pass, with the prices that prove it."""

    value: float  # the plan's figure on the particles: seconds, or a probability
    bound: float  # no plan's figure is better
    plan_class: str  # "roads", or "free": each particle met as early as the UAV can be there
    grain: Grain
    price: Floats  # (N,) in units of reward; zero where there are none

    def __post_init__(self) -> None:
        freeze(self, price=np.float64)

    @property
    def gap(self) -> float:
        """How far the value is from the bound, as a share of the bound."""
        return gap_of(self.value, self.bound)


def gap_of(value: float, bound: float) -> float:
    """Return how far a value is from a bound, as a share of the bound."""
    return abs(value - bound) / bound if bound > 0.0 else math.inf


def certified(problem: Problem, plan: Plan, effort: Effort) -> Certificate:
    """Return the certificate of a plan, for plans over roads if it is one, else for any flight.

    Raises
    ------
    NotApplicableError
        If the net is too large for the bound on road plans.
    """
    track, objective = plan.tracks[0], problem.objective
    seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
    earned = objective.reward(seen_at)
    weight = problem.futures.weight
    reward = float(weight @ earned)
    value, none = _figure(problem, reward), np.zeros(len(weight))
    if not plan.legs[0]:
        most = float(weight @ objective.reward(earliest(problem)))
        return Certificate(value, _figure(problem, most), "free", Grain(), none)
    grain, steps = Grain.fitting(problem), [0]

    def stop(least: float) -> bool:
        bound = _figure(problem, least)
        gap = gap_of(value, bound)
        if effort.told:
            effort.told(steps[0], value, bound, gap)
        steps[0] += 1
        return gap <= effort.gap or effort.stop()

    table = table_of(problem, grain, FLOOR * earned)
    start = min(STARTS, key=lambda share: table.bound(share * earned)[0])
    least, price = lowest(table, start * earned, reward, steps=effort.steps, stop=stop)
    return Certificate(value, _figure(problem, least), "roads", grain, price)


def _figure(problem: Problem, reward: float) -> float:
    """Return the objective's figure; where no target is there, the horizon is the time."""
    return problem.objective.value(reward)


def earliest(problem: Problem) -> Floats:
    """Return when each particle could be met at the earliest by a UAV that knew it, (N,) seconds.

    The circle around the take-off's place with the detection radius grows with the UAV's speed;
    a particle can be seen from when on it is inside.
    """
    uav, seen_at = problem.uavs[0], np.full(len(problem.futures), np.inf)
    pieces, who = pieces_of(problem.futures)
    for (from_s, to_s, x, y, vx, vy), k in zip(pieces.tolist(), who.tolist(), strict=True):
        begin_s = max(from_s, uav.take_off_s)
        if begin_s > to_s or seen_at[k] <= begin_s:
            continue
        x, y = x + vx * (begin_s - from_s) - uav.x_m, y + vy * (begin_s - from_s) - uav.y_m
        ring_m = problem.sensor.radius_m + uav.speed_mps * (begin_s - uav.take_off_s)
        after_s = _ring_reaches((x, y), (vx, vy), ring_m, uav.speed_mps)
        if begin_s + after_s <= to_s:
            seen_at[k] = begin_s + after_s
    return seen_at


def _ring_reaches(
    place: tuple[float, float], drift: tuple[float, float], ring_m: float, speed_mps: float
) -> float:
    """Return the first second at which a growing circle has a body inside; infinity if never."""
    (x, y), (vx, vy) = place, drift
    outside = x * x + y * y - ring_m * ring_m
    if outside <= 0.0:
        return 0.0
    # |place + drift t| = ring + speed t: a t^2 + 2 b t + outside = 0, with t >= 0.
    a = vx * vx + vy * vy - speed_mps * speed_mps
    b = x * vx + y * vy - ring_m * speed_mps
    root = b * b - a * outside
    if root < 0.0:
        return math.inf
    times = [outside / low for low in (-b + math.sqrt(root), -b - math.sqrt(root)) if low != 0.0]
    return min((time_s for time_s in times if time_s >= 0.0), default=math.inf)


def lower_limit(bounds: Floats) -> float:
    """Return the 95 % lower confidence limit of the true optimum from bounds of independent sets.

    The expected bound of a random set is never above the optimum for the whole distribution (Mak,
    Morton and Wood 1999); Student's t takes the bounds' scatter into account. For a probability
    it is the upper limit that is wanted: hand over the negative bounds.
    """
    from scipy.stats import t

    many = len(bounds)
    spread = float(np.std(bounds, ddof=1)) / math.sqrt(many)
    return float(np.mean(bounds)) - float(t.ppf(0.95, many - 1)) * spread
