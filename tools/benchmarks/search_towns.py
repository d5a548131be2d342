"""What searches along roads cost and are worth on nets of three sizes: a grid, Berlin, Luxembourg.

Particles are those of the kinematic clock in the towns, so that nothing has to be recorded; all
plans of a net meet the same fresh ones. Seconds are of CPU, of the planning thread alone, with
compiled code warm and without the recording. Luxembourg is left out where its data are not.

python tools/benchmark.py --search-towns [--only luxembourg] [--method rate] [--particles 2000]
"""

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.figures import Figure, machine, show
from planner import OpenScenario, evaluate, method_named, open_scenario, sample, stream
from planner.futures.futures import Futures
from planner.futures.kinematic import kinematic_futures
from planner.futures.record import record
from planner.mission.planning import problem_of
from planner.network.signals import signals_of
from planner.search.problem import Budget, Problem
from planner.search.what_if import indexed

ROOT = Path(__file__).resolve().parents[2]
# In the towns: the ideal aircraft, as planners know it.
CASE = (
    "uav.aircraft=ideal",
    "uav.speed_mps=25",
    "uav.take_off_s=180",
    "search.horizon_s=1500",
)
METHODS = ("rate", "beam", "lns")
FRESH = 4000  # targets
FIRST_PLAN_S = {"luxembourg": 0.5}  # of CPU that a plan by rate may take


@dataclass(frozen=True, eq=False)
class Case:
    """A net with particles to plan on and others to judge by."""

    problem: Problem
    fresh: Futures


def cases(particles: int, only: Sequence[str] | None) -> Iterator[tuple[str, Case]]:
    """Yield the cases by name."""
    if not only or "grid5x5" in only:
        yield "grid5x5", _case(open_scenario("grid5x5"), particles)
    if not only or "berlin" in only:
        yield "berlin", _case(open_scenario("berlin", overrides=list(CASE)), particles)
    if only and "luxembourg" not in only:
        return
    with luxembourg() as folder:
        if folder is not None:
            yield "luxembourg", _case(open_scenario(folder, overrides=list(CASE)), particles)


@contextmanager
def luxembourg() -> Iterator[str | None]:
    """Give a folder with the town's scenario; None where its data are not, and say so."""
    sys.path.insert(0, str(ROOT / "tests"))
    support: Any = import_module("support.towns")
    with TemporaryDirectory() as folder:
        found: str | None = folder
        try:
            support.luxembourg(Path(folder))
        except BaseException as reason:  # pytest's way to skip is none of Exception
            if type(reason).__name__ != "Skipped":
                raise
            print(f"luxembourg is left out: {reason}", file=sys.stderr)
            found = None
        yield found


def _case(opened: OpenScenario, particles: int) -> Case:
    planning, holdout, fresh = (
        drawn(opened, count, name)
        for count, name in ((particles, "planning"), (500, "holdout"), (FRESH, "fresh"))
    )
    return Case(problem_of(opened, planning).replace(holdout=holdout), fresh)


def drawn(opened: OpenScenario, count: int, name: str) -> Futures:
    """Return targets of a scenario, driven by the kinematic clock where there is one."""
    horizon_s, rng = opened.scenario.search.horizon_s, stream(1, f"benchmark {name}")
    particles = sample(opened.prior, opened.network, count, rng, horizon_s=horizon_s)
    if opened.network.is_abstract:
        return record(opened.network, particles, horizon_s=horizon_s)
    signals = signals_of(opened.network)
    return kinematic_futures(opened.network, particles, signals, horizon_s=horizon_s)


def in_net(name: str, case: Case, methods: Sequence[str], repeats: int) -> Iterator[Figure]:
    """Yield what planning takes, from no index on, and what the plans are worth."""
    legs = float(len(case.problem.legs))
    yield Figure("legs", "", (legs,))
    for method in methods:
        load, took_s, index_s = method_named(method).load(), [], []
        for _ in range(repeats + 1):
            problem = case.problem.replace()
            begun_s = time.thread_time()
            indexed(problem)
            index_s.append(time.thread_time() - begun_s)
            plan = load(problem, budget=Budget(), rng=np.random.default_rng(1)).plan
            took_s.append(time.thread_time() - begun_s)
        judged = evaluate(plan.tracks, case.fresh, problem.sensor, problem.objective)
        if method == methods[0]:
            yield Figure("index of legs and passages", "CPU s", tuple(index_s[1:]))
        aim = FIRST_PLAN_S.get(name) if method == "rate" else None
        yield Figure(f"{method}, index and all", "CPU s", tuple(took_s[1:]), at_most=aim)
        yield Figure(f"{method}: E, fresh targets", "s", (judged.expected_detection_time_s,))


def main(argv: Sequence[str]) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", metavar="NAME", help="grid5x5, berlin, ...")
    parser.add_argument("--method", action="append", metavar="NAME", help="rate, beam, lns, best")
    parser.add_argument("--particles", type=int, default=2000, metavar="N")
    parser.add_argument("--repeats", type=int, default=3, metavar="N")
    wanted = parser.parse_args(argv)
    host, found = machine(), []
    for name, case in cases(wanted.particles, wanted.only):
        print(f"measuring {name} ...", file=sys.stderr)
        methods = wanted.method or METHODS
        found += [(name, figure) for figure in in_net(name, case, methods, wanted.repeats)]
    show(found, host)
    return 0
