"""Measure how soon the planners' plans find the target, and compare that with target values.

The grid of Section 5 of the paper, take-off at 0, the UAV starting u0 from the origin. All plans
of all methods and seeds meet one common set of fresh targets, drawn from the belief under a
stream that no planner reaches. Planning times are those of the planning thread (CPU seconds).
"""

import argparse
import json
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import lru_cache
from itertools import groupby
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.engine import Check, engine, small_nets
from benchmarks.figures import machine
from benchmarks.ways import NOTES, U0_KM, WAYS, Way
from planner import (
    Futures,
    OpenScenario,
    Recorder,
    evaluate,
    make_plan,
    method_named,
)
from planner import open_scenario as open_any
from planner.arrays import Floats
from planner.cli.printing import console
from planner.cli.progress import progress_bar
from planner.errors import PlannerError
from planner.files import written_whole
from planner.intervals import NORMAL_95
from planner.messages import percent
from planner.mission.planning import problem_of

MOST_SPREAD_S = 6.0  # standard deviation from seed to seed
LEAST_FOUND = 0.999
MOST_OPTIMISM = 0.005  # of the value on fresh targets over that on the plan's own particles
TRUTH_SEED = 1


@dataclass(frozen=True, eq=False)
class Flown:
    """One way at one distance with one planning seed, flown against the fresh targets."""

    way: str
    u0_km: int
    seed: int
    planned_s: float  # E on the plan's own particles
    found: float  # probability
    before_goal: float  # probability
    took_s: float
    time_s: Floats  # (N,) min(seen, horizon) of each fresh target


@dataclass(frozen=True)
class Cell:
    """One way at one distance over all planning seeds."""

    way: str
    u0_km: int
    seeds: int
    expected_s: float
    half_width_s: float  # of the 95 % interval: over targets and seeds
    spread_s: float  # standard deviation from seed to seed
    planned_s: float
    found: float
    before_goal: float
    took_s: float  # mean
    most_took_s: float
    at_most_s: float | None
    sooner: dict[str, tuple[float, float]]  # than a reading of greedy: mean and 95 % half width

    @property
    def optimism(self) -> float:
        """By which share of it the value on fresh targets is above the one planned."""
        return self.expected_s / self.planned_s - 1.0


@lru_cache(maxsize=1)
def _fresh(targets: int, jobs: int | None) -> Futures:
    opened = open_any("grid5x5", overrides=[f"search.seed={TRUTH_SEED}"])
    return Recorder(opened, jobs).evaluation(targets).futures


def _opened(way: Way, u0_km: int, seed: int) -> OpenScenario:
    start = f"uav.start.distance_m={1000 * u0_km}"
    return open_any("grid5x5", overrides=[start, f"search.seed={100 + seed}", *way.overrides])


def _fly(task: tuple[Way, int, int, int]) -> Flown:
    way, u0_km, seed, targets = task
    opened, method = _opened(way, u0_km, seed), method_named(way.method)
    recorder = Recorder(opened, 1)
    particles = recorder.planning().futures
    holdout = recorder.holdout().futures if method.chooses else None
    begun_s = time.thread_time()
    plan = make_plan(method, opened, recorder, particles, holdout=holdout).plan
    took_s = time.thread_time() - begun_s
    problem = problem_of(opened, particles)
    planned, flown = (
        evaluate(plan.tracks, some, problem.sensor, problem.objective)
        for some in (particles, _fresh(targets, 1))
    )
    return Flown(
        way.name,
        u0_km,
        seed,
        planned.expected_detection_time_s,
        flown.detection_probability,
        flown.found_before_goal_probability,
        took_s,
        flown.time_s,
    )


def _warm_up(way: Way) -> None:
    """Have the code compiled before anything is timed."""
    _fly((way, 60, 0, 1000))
    _fresh.cache_clear()


def cells(wanted: argparse.Namespace) -> Iterator[Cell]:
    """Yield all cells, distance by distance."""
    ways = [way for way in WAYS if not wanted.only or way.name in wanted.only]
    _record(ways, wanted)
    tasks = [
        (way, u0_km, seed, wanted.targets)
        for u0_km in wanted.u0_km
        for way in ways
        for seed in range(way.seeds or wanted.seeds)
    ]
    with (
        ProcessPoolExecutor(wanted.planners, get_context("spawn")) as pool,
        progress_bar("plans") as progress,
    ):
        list(pool.map(_warm_up, [way for way in ways for _ in range(wanted.planners)]))
        flown = []
        for done, one in enumerate(pool.map(_fly, tasks), 1):
            flown.append(one)
            progress(done, len(tasks), f"{one.way}, {one.u0_km} km")
            if done == len(tasks) or tasks[done][1] != one.u0_km:
                yield from _cells_of(ways, flown)
                flown = []


def _record(ways: Sequence[Way], wanted: argparse.Namespace) -> None:
    """Record all targets once; what is recorded does not depend on where the UAV starts."""
    _fresh(wanted.targets, wanted.jobs)
    sets = [(way, seed) for way in ways for seed in range(way.seeds or wanted.seeds)]
    with progress_bar("recording") as progress:
        for done, (way, seed) in enumerate(sets):
            progress(done, len(sets))
            recorder = Recorder(_opened(way, 60, seed), wanted.jobs)
            recorder.planning()
            if method_named(way.method).chooses:
                recorder.holdout()


def _cells_of(ways: Sequence[Way], flown: Sequence[Flown]) -> Iterator[Cell]:
    by_way = {name: list(some) for name, some in groupby(flown, key=lambda one: one.way)}
    means = {name: np.mean([one.time_s for one in some], axis=0) for name, some in by_way.items()}
    readings = [way.name for way in ways if way.readings]
    for way in ways:
        some = by_way[way.name]
        values = np.array([one.time_s.mean() for one in some])
        others = {
            name: _difference(by_way[name], means[name], some, means[way.name])
            for name in readings
            if not way.readings
        }
        yield Cell(
            way.name,
            some[0].u0_km,
            len(some),
            float(values.mean()),
            _half_width(means[way.name], values),
            float(values.std(ddof=1)) if len(values) > 1 else 0.0,
            float(np.mean([one.planned_s for one in some])),
            float(np.mean([one.found for one in some])),
            float(np.mean([one.before_goal for one in some])),
            float(np.mean([one.took_s for one in some])),
            max(one.took_s for one in some),
            way.at_most_s.get(some[0].u0_km),
            others,
        )


def _half_width(by_target_s: Floats, by_seed_s: Floats) -> float:
    """Return the 95 % half width of a mean over targets and seeds, which vary independently."""
    variance = by_target_s.var(ddof=1) / len(by_target_s)
    if len(by_seed_s) > 1:
        variance += by_seed_s.var(ddof=1) / len(by_seed_s)
    return float(NORMAL_95 * np.sqrt(variance))


def _difference(
    ones: Sequence[Flown], ones_s: Floats, others: Sequence[Flown], others_s: Floats
) -> tuple[float, float]:
    """Return by how much others are sooner on the same targets, and the 95 % half width."""
    seeds = sum(
        np.var([one.time_s.mean() for one in some], ddof=1) / len(some)
        for some in (ones, others)
        if len(some) > 1
    )
    variance = (ones_s - others_s).var(ddof=1) / len(ones_s) + seeds
    return float((ones_s - others_s).mean()), float(NORMAL_95 * np.sqrt(variance))


def checks(found: Iterable[Cell]) -> Iterator[Check]:
    """Yield every figure that has to be reached by the grid's cells."""
    named = {way.name: way for way in WAYS}
    for one in found:
        if one.at_most_s is None:
            continue
        at = f"{one.way}, u0 {one.u0_km} km"
        yield Check(f"{at}: E", one.expected_s, one.at_most_s)
        yield Check(f"{at}: not found", 1.0 - one.found, 1.0 - LEAST_FOUND, "")
        yield Check(f"{at}: seed to seed", one.spread_s, MOST_SPREAD_S)
        yield Check(f"{at}: fresh above planned", one.optimism, MOST_OPTIMISM, "")
        most_s = named[one.way].planning_s
        yield Check(f"{at}: planning, mean", one.took_s, most_s or np.inf)


def show(found: Sequence[Cell]) -> None:
    """Print the table of all ways, and the gains against the readings of greedy."""
    from rich.table import Table

    table = Table(title="E[min(tau, 10,000 s)] on the grid", title_justify="left")
    for name in ("u0 km", "method", "E s", "± 95 %", "at most", "reached", "found"):
        table.add_column(name, justify="left" if name == "method" else "right", no_wrap=True)
    for name in ("before goal", "seed sd", "fresh/own", "planning s", "sooner than greedy"):
        table.add_column(name, justify="right", no_wrap=True)
    for _, group in groupby(found, key=lambda one: one.u0_km):
        rows = list(group)
        for one in rows:
            table.add_row(*_texts(one, rows), end_section=one is rows[-1])
    console().print(table)


def _texts(one: Cell, rows: Sequence[Cell]) -> Iterator[str]:
    yield from (str(one.u0_km), one.way, f"{one.expected_s:,.1f}", f"{one.half_width_s:.1f}")
    yield "" if one.at_most_s is None else f"{one.at_most_s:,.0f}"
    yield "" if one.at_most_s is None else ("yes" if one.expected_s <= one.at_most_s else "NO")
    yield from (f"{one.found:.4f}", f"{one.before_goal:.3f}", f"{one.spread_s:.1f}")
    yield from (percent(one.optimism, 2, sign=True), f"{one.took_s:.2f} (≤ {one.most_took_s:.2f})")
    strongest = sorted(one.sooner, key=lambda name: one.sooner[name][0])
    means = {row.way: row.expected_s for row in rows}
    yield "; ".join(
        f"{name.removeprefix('greedy, ')} {percent(one.sooner[name][0] / means[name])}"
        f" ± {percent(one.sooner[name][1] / means[name])}"
        for name in strongest
    )


def show_checks(wanted: Sequence[Check]) -> None:
    """Print each figure beside what it has to reach, those that miss it last."""
    from rich.table import Table

    table = Table(title="figures to reach", title_justify="left")
    for name in ("what", "value", "at most", "unit", "reached"):
        table.add_column(name, justify="left" if name in ("what", "unit") else "right")
    for one in sorted(wanted, key=lambda one: not one.kept):
        value, most = (f"{number:,.4g}" for number in (one.value, one.at_most))
        if one.unit == "s" and one.value >= 100:
            value, most = f"{one.value:,.1f}", f"{one.at_most:,.1f}"
        table.add_row(one.what, value, most, one.unit, "yes" if one.kept else "NO")
    out = console()
    out.print(table)
    out.print(f"{sum(one.kept for one in wanted)} of {len(wanted)} reached")


def arguments(argv: Sequence[str] | None = None) -> argparse.Namespace:
    """Return what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    add: Any = parser.add_argument
    add("--seeds", type=int, default=10, help="planning seeds (default 10; greedy always 40)")
    add("--targets", type=int, default=65536, help="common fresh targets (default 65536)")
    add("--u0-km", type=int, nargs="+", choices=U0_KM, default=U0_KM, metavar="KM")
    add("--only", action="append", choices=[way.name for way in WAYS], metavar="METHOD")
    add("-j", "--jobs", type=int, help="processes that run SUMO (default one per core)")
    add("--planners", type=int, default=1, help="plans made at a time (default 1)")
    add("--repeats", type=int, default=20, help="repetitions of what takes milliseconds")
    add("--json", type=Path, metavar="FILE", help="write all figures there too")
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> None:
    """Measure and tell."""
    wanted, host = arguments(argv), machine()
    try:
        held = [] if wanted.only else [*engine(wanted.repeats), *small_nets(wanted.repeats)]
        found = list(cells(wanted))
    except PlannerError as error:
        print(f"benchmark: {error}", file=sys.stderr)
        raise SystemExit(2) from error
    show(found)
    held += checks(found)
    show_checks(held)
    for name, note in NOTES.items():
        if any(one.what.startswith(f"{name},") and not one.kept for one in held):
            print(f"{name}: {note}")
    print(f"{host['cpu']}, {host['cores']} cores, load {host['load']:.1f} before; {host['system']}")
    if wanted.json:
        content = {
            "machine": host,
            "cells": [asdict(one) for one in found],
            "checks": [asdict(one) | {"kept": one.kept} for one in held],
        }
        with written_whole(wanted.json) as path:
            path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
