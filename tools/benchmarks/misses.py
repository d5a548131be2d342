"""What planning for a sensor that misses gains over planning as if it were perfect.

Several planning seeds; all plans are flown against the same fresh targets. A gain is paired: per
target, averaged over the seeds; its interval holds what the targets and what the seeds leave open.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import truediv
from typing import NamedTuple

import numpy as np

from benchmarks.figures import Figure
from benchmarks.grid import fresh, opened_at
from planner import (
    Futures,
    OpenScenario,
    Plan,
    Recorder,
    evaluate,
    make_plan,
    method_named,
    open_scenario,
    problem_of,
)
from planner.arrays import Floats
from planner.intervals import NORMAL_95, student_point

PERFECT, TOWN = 1.0, "berlin"


class Aim(NamedTuple):
    """What is aimed at: the lower limit of the gain, percent, and about which E, seconds."""

    gain: float | None  # None: not worse
    expected_s: float | None = None


AIMS = {
    60: {0.9: Aim(9.0, 1447.0), 0.7: Aim(20.0, 1980.0), 0.5: Aim(25.0, 2690.0)},
    120: {0.9: Aim(0.5, 2605.0), 0.7: Aim(4.5, 3214.0), 0.5: Aim(9.5, 3950.0)},
    300: {0.9: Aim(None, 5273.0), 0.7: Aim(1.0, 5650.0), 0.5: Aim(3.5, 6100.0)},
}
TIMES_LONGER = 3.0  # that planning with misses may take, at most


class Planned(NamedTuple):
    """A plan, and the CPU seconds that it took."""

    plan: Plan
    took_s: float


class Gained(NamedTuple):
    """What planning for the misses there are gains."""

    blind_s: float  # E of the plans as if perfect, flown with misses
    own_s: float  # of those made for it
    gain: float  # share of the expected time
    half: float  # of its 95 % interval


def on_the_grid(u0_km: int, seeds: int, targets: int) -> Iterator[Figure]:
    """Plan as if perfect and for detects .9, .7 and .5 from one distance."""

    def opened(seed: int, detects: float) -> OpenScenario:
        return opened_at(u0_km, f"sensor.detects={detects}", seed=seed)

    judges = fresh(opened(1, PERFECT), targets)
    yield from _compared(opened, AIMS[u0_km], seeds, judges)


def in_berlin(seeds: int, targets: int) -> Iterator[Figure]:
    """Plan as if perfect and for detects .7 where the flight may leave the roads."""

    def opened(seed: int, detects: float) -> OpenScenario:
        return open_scenario(TOWN, overrides=[f"search.seed={seed}", f"sensor.detects={detects}"])

    judges = Recorder(opened(1, PERFECT), 1).evaluation(targets).futures
    yield from _compared(opened, {0.7: Aim(None)}, seeds, judges)


def planned(opened: OpenScenario) -> Planned:
    """Return the plan of `best`, and the CPU seconds that it took."""
    recorder, best = Recorder(opened, 1), method_named("best")
    particles, holdout = recorder.planning().futures, recorder.holdout().futures
    begun_s = time.process_time()
    found = make_plan(best, opened, recorder, particles, holdout=holdout)
    return Planned(found.plan, time.process_time() - begun_s)


def gained(blind: Sequence[Floats], own: Sequence[Floats]) -> Gained:
    """Return the gain, from the expected times of targets, (N,) for each seed."""
    apart, seeds = np.array(blind) - own, len(blind)
    of_target, of_seed, blind_s = apart.mean(axis=0), apart.mean(axis=1), float(np.mean(blind))
    half_s = NORMAL_95 * float(np.std(of_target, ddof=1)) / math.sqrt(len(of_target))
    if seeds > 1:
        of_seeds_s = float(np.std(of_seed, ddof=1)) / math.sqrt(seeds)
        half_s = math.hypot(half_s, student_point(seeds - 1, 0.05) * of_seeds_s)
    return Gained(blind_s, float(np.mean(own)), float(apart.mean()) / blind_s, half_s / blind_s)


def _compared(
    opened: Callable[[int, float], OpenScenario],
    aims: Mapping[float, Aim],
    seeds: int,
    judges: Futures,
) -> Iterator[Figure]:
    """Yield the figures of some sensors; a scenario is opened by its seed and its sensor."""
    several = range(1, seeds + 1)
    blind = [planned(opened(seed, PERFECT)) for seed in several]
    for detects, aim in aims.items():
        own = [planned(opened(seed, detects)) for seed in several]
        problem = problem_of(opened(1, detects), judges)
        times = [
            [
                evaluate(one.plan.tracks, judges, problem.sensor, problem.objective).time_s
                for one in some
            ]
            for some in (blind, own)
        ]
        yield from _figures(f"detects {detects:g}", aim, gained(*times))
        slower = (float(np.median([one.took_s for one in some])) for some in (own, blind))
        what = f"detects {detects:g}: CPU time of that without misses"
        yield Figure(what, "times", (truediv(*slower),), at_most=TIMES_LONGER)


def _figures(name: str, aim: Aim, found: Gained) -> Iterator[Figure]:
    yield Figure(f"{name}: gain", "%", (100.0 * found.gain,))
    low, high = 100.0 * (found.gain - found.half), 100.0 * (found.gain + found.half)
    if aim.gain is None:
        yield Figure(f"{name}: gain, upper 95 % limit", "%", (high,), at_least=0.0)
    else:
        yield Figure(f"{name}: gain, lower 95 % limit", "%", (low,), at_least=aim.gain)
    about = "" if aim.expected_s is None else f", about {aim.expected_s:,.0f}"
    yield Figure(f"{name}: E as if perfect", "s", (found.blind_s,))
    yield Figure(f"{name}: E{about}", "s", (found.own_s,))
