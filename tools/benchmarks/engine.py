"""Figures of the what-if engine and of small nets, each beside what it has to reach."""

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.ways import U0_KM
from planner import GreedyOptions, Problem, Recorder, evaluate, greedy, make_plan, method_named
from planner import open_scenario as open_any
from planner.mission.planning import budget_of, problem_of
from planner.search.exact import best_order
from planner.search.problem import candidate_legs
from planner.search.what_if import WhatIf, index_of, indexed

ROOT = Path(__file__).resolve().parents[2]
NO_CHANCE = np.random.default_rng(0)  # what greedy draws from: nothing
PAPER = ('search.sampling="iid"', "search.particles=1000", 'greedy.direction="both"')


@dataclass(frozen=True)
class Check:
    """One figure beside what it has to reach."""

    what: str
    value: float
    at_most: float
    unit: str = "s"

    @property
    def kept(self) -> bool:
        """Whether it is reached."""
        return self.value <= self.at_most


SMALL = {
    "": (),
    ", 60 km out": ("uav.start={x_m=-60000.0,y_m=0.0}",),
    ", 100 km out, take-off at 300 s": (
        "uav.start={x_m=-100000.0,y_m=0.0}",
        "uav.take_off_s=300",
    ),
}


def small_nets(repeats: int) -> Iterator[Check]:
    """Yield `best` beside the proven optimum of once-per-road orders of Figure 3's roads."""
    for name in ("figure3", "figure3-gone"):
        for variant, overrides in SMALL.items():
            opened = open_any(name, overrides=list(overrides))
            recorder = Recorder(opened, 1)
            particles = recorder.planning().futures
            problem = problem_of(opened, particles)
            roads = len(problem.network.road_ids)
            _, optimum = best_order(problem, roads)
            took_s = []
            for _ in range(repeats):
                begun_s = time.thread_time()
                best_order(problem, roads)
                took_s.append(time.thread_time() - begun_s)
            plan = make_plan(method_named("best"), opened, recorder, particles).plan
            value = evaluate(plan.tracks, particles, problem.sensor, problem.objective)
            title = f"{name}{variant}"
            expected_s = value.expected_detection_time_s
            yield Check(f"{title}: best against the optimum", expected_s, optimum + 1e-6)
            most_s = 1.0 if name.endswith("gone") else 0.05
            yield Check(f"{title}: branch and bound", float(np.median(took_s)), most_s)


def engine(repeats: int) -> Iterator[Check]:
    """Yield what single scorings and plans cost, warm, and how that grows."""
    at_node = {}
    for u0_km in U0_KM:
        opened = open_any("grid5x5", overrides=[f"uav.start.distance_m={1000 * u0_km}", *PAPER])
        problem = problem_of(opened, Recorder(opened, 1).planning().futures)
        options = GreedyOptions(**opened.scenario.greedy.model_dump())
        plan = partial(greedy, problem, budget=budget_of(opened), rng=NO_CHANCE, options=options)
        plan_s = _median_s(plan, repeats)
        index_s = _median_s(partial(index_of, problem), repeats)
        at_node[u0_km] = 1000 * _scoring_s(problem, repeats)
        yield Check(f"u0 {u0_km} km: score all legs from a node", at_node[u0_km], 0.5, "ms")
        yield Check(f"u0 {u0_km} km: plan of 16 roads", 1000 * plan_s, 3.0, "ms")
        yield Check(f"u0 {u0_km} km: index, once per problem", 1000 * index_s, np.inf, "ms")
    sys.path.insert(0, str(ROOT / "tests"))
    grids: Any = import_module("support.grid_instance")
    few, many, wide = (
        grids.grid_problem(grids.grid_futures(n, np.random.default_rng(1)), size=size)
        for n, size in ((1000, 6), (16000, 6), (1000, 6))
    )
    wide = wide.replace(network=import_module("support.instances").grid(24, 24))
    few_s, many_s, wide_s = (_scoring_s(problem, repeats) for problem in (few, many, wide))
    bytes_few, bytes_many = (_bytes_of(indexed(problem)) for problem in (few, many))
    yield Check("16 times the particles: time per particle", many_s / few_s / 16, 1.5, "times")
    yield Check("16 times the particles: memory each", bytes_many / bytes_few / 16, 1.1, "times")
    legs = len(wide.legs) / len(few.legs)
    yield Check(f"{legs:.0f} times the roads: time per leg", wide_s / few_s / legs, 1.0, "times")


def _scoring_s(problem: Problem, repeats: int) -> float:
    """Return the seconds of one scoring of all legs from the first node after take-off."""
    at_start, made = problem.first_state, WhatIf(problem)
    legs = candidate_legs(problem, at_start)
    first, *_ = legs.tolist()
    flights = made.fly(at_start, legs[:1])
    state = at_start.after(problem.legs, first, flights.seen(0, len(problem.futures)))
    return _median_s(lambda: made.score(state, legs), repeats)


def _median_s(work: Callable[[], object], repeats: int) -> float:
    work()
    took_s = []
    for _ in range(max(repeats, 20)):
        begun_s = time.perf_counter()
        work()
        took_s.append(time.perf_counter() - begun_s)
    return float(np.median(took_s))


def _bytes_of(thing: Any) -> int:
    if isinstance(thing, np.ndarray):
        return thing.nbytes
    return sum(map(_bytes_of, thing)) if isinstance(thing, tuple) else 0
