"""Measure the planner on this computer, and compare it with its targets.

Each figure is the median of several repetitions; ratios compare two ways of doing the same work,
in turn. A figure that says warm takes recordings and compiled code from the cache.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import numpy as np
from benchmarks.cold import empty_cache
from benchmarks.figures import Figure, machine, show
from benchmarks.reading import reading

from planner import (
    OpenScenario,
    Particles,
    Problem,
    Recorder,
    first_detection,
    make_plan,
    method_named,
    open_scenario,
    problem_of,
    record,
    sample,
    stream,
)
from planner.errors import PlannerError
from planner.files import written_whole
from planner.network.sumo import binary, sumo_environment
from planner.search.exact import best_order, enumerate_orders
from planner.search.result import SearchResult

T = TypeVar("T")

ROOT = Path(__file__).resolve().parents[1]
GRID = "grid5x5"
STEP_S = 10.0  # of the bare sumo program: the one at which straight roads are recorded
TWINS = 20  # particles that the slow twin looks for
TICK_S = 1.0

# Runs a command and prints its seconds and its peak memory. It is a small process in between,
# because the system counts a process as at least as large as the one that started it.
STARTER = """
import resource, subprocess, sys, time
begun = time.perf_counter()
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
print(time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(code)
"""


def recording(repeats: int) -> Iterator[Figure]:
    """Record 1,000 vehicles in one process; drive them in the bare sumo program, with FCD."""
    opened = open_scenario(GRID)
    particles, horizon_s = _particles(opened), opened.scenario.search.horizon_s
    rates, bare = [], []
    for _ in range(repeats):
        took_s, futures = _timed(
            lambda: record(opened.network, particles, horizon_s=horizon_s, workers=1)
        )
        driven_s = np.minimum(futures.end_s, horizon_s) - futures.time_s[futures.first_knot[:-1]]
        rates.append(float(driven_s.sum()) / took_s)
        bare.append(_bare_rate(opened, particles))
    yield Figure("recorded", "vehicle s / s", tuple(rates))
    yield Figure("bare sumo with FCD output", "vehicle s / s", tuple(bare))
    yield Figure("recorded against bare sumo", "times", _ratios(rates, bare))


def futures(repeats: int) -> Iterator[Figure]:
    """Record 1,000 grid futures on two cores with an empty cache, and read them from it."""
    opened = open_scenario(GRID)
    cold, cached = [], []
    for _ in range(repeats):
        _stop_workers()
        with empty_cache():
            cold.append(_timed(Recorder(opened, 2).planning)[0])
            cached.append(_timed(Recorder(opened, 2).planning)[0])
    yield Figure("1,000 grid futures, cold", "s", tuple(cold), at_most=6)
    yield Figure("1,000 grid futures, cached", "s", tuple(cached), at_most=0.3)


def detection(repeats: int) -> Iterator[Figure]:
    """Fly a greedy plan against 1,000 futures, exactly and with the ticks of the slow twin."""
    sys.path.insert(0, str(ROOT / "tests"))
    by_ticks: Any = import_module("support.reference").by_ticks
    problem, plan = _planning("greedy", GRID)
    targets, track, radius_m = problem.futures, *plan().plan.tracks, problem.sensor.radius_m
    first_detection(targets, track, radius_m)
    fast, slow = [], []
    for _ in range(repeats):
        took_s, _ = _timed(lambda: first_detection(targets, track, radius_m))
        fast.append(1e6 * took_s / len(targets))
        took_s, _ = _timed(lambda: [by_ticks(targets, k, track, TICK_S) for k in range(TWINS)])
        slow.append(1e6 * took_s / TWINS)
    yield Figure("exact", "us / particle", tuple(fast))
    yield Figure(f"slow twin, ticks of {TICK_S:g} s", "us / particle", tuple(slow))
    yield Figure("slow twin against exact", "times", _ratios(slow, fast))


def greedy(repeats: int) -> Iterator[Figure]:
    """Plan 16 roads greedily on 1,000 particles, warm."""
    for u0_km in (60, 300):
        for direction in ("own", "both"):
            distance = f"uav.start.distance_m={1000 * u0_km}"
            _, plan = _planning("greedy", GRID, distance, f'greedy.direction="{direction}"')
            values = [1000 * took_s for took_s in _warm(plan, repeats)]
            yield Figure(f"u0 {u0_km} km, direction {direction}", "ms", tuple(values), at_most=20)


def exact(repeats: int) -> Iterator[Figure]:
    """Find the best of all 2^7 7! = 645,120 orders and directions of Figure 3, warm."""
    for name in ("figure3", "figure3-gone"):
        problem, _ = _planning("exact", name)
        roads = len(problem.network.road_ids)
        bounded = _warm(partial(best_order, problem, roads), repeats)
        yield Figure(f"{name}, branch and bound", "s", bounded, at_most=10)
        orders = _warm(partial(enumerate_orders, problem), repeats)
        yield Figure(f"{name}, all orders", "s", orders, at_most=10)


def exhaustive(repeats: int) -> Iterator[Figure]:
    """Find the shortest tour of the grid's 60 roads that keeps their precedence, warm."""
    _, plan = _planning("exhaustive-shortest", GRID)
    yield Figure("exhaustive-shortest on the grid", "s", _warm(plan, repeats))


def answer(repeats: int) -> Iterator[Figure]:
    """Ask for help."""
    values = tuple(_command("--help")[0] for _ in range(repeats))
    yield Figure("planner --help", "s", values, at_most=0.3)


def commands(repeats: int) -> Iterator[Figure]:
    """Run whole commands, each in a process of its own."""
    with empty_cache():
        took_s, peak_mb = _command("futures", GRID, "--jobs", "2")
    yield Figure("planner futures, cache empty", "s", (took_s,))
    # Three times the largest: less is known without looking at them while they run.
    yield Figure("its three processes, at most", "MB", (3 * peak_mb,), at_most=1000)
    with TemporaryDirectory() as folder:
        plan = ("plan", GRID, "-o", folder, "--force")
        _command(*plan)
        runs = [_command(*plan) for _ in range(repeats)]
    yield Figure("planner plan, warm", "s", tuple(run[0] for run in runs), at_most=3)
    yield Figure("its peak memory", "MB", tuple(run[1] for run in runs), at_most=1000)


SECTIONS: dict[str, Callable[[int], Iterator[Figure]]] = {
    "recording": recording,
    "futures": futures,
    "detection": detection,
    "greedy": greedy,
    "exact": exact,
    "exhaustive": exhaustive,
    "reading": reading,
    "help": answer,
    "commands": commands,
}


PROGRAMS = (
    "call",
    "online",
    "search",
    "certificate",
    "futures-towns",
    "search-towns",
    "towns",
    "flight",
    "traffic",
)  # further ones, in benchmarks/: --search --help


def _planning(
    method: str, scenario: str, *overrides: str
) -> tuple[Problem, Callable[[], SearchResult]]:
    """Return a problem with its recorded futures, and what plans on it with a method."""
    opened = open_scenario(scenario, overrides=overrides)
    recorder = Recorder(opened)
    particles = recorder.planning().futures
    plan = partial(make_plan, method_named(method), opened, recorder, particles)
    return problem_of(opened, particles), plan


def _particles(opened: OpenScenario) -> Particles:
    search = opened.scenario.search
    rng = stream(search.seed, "benchmark")
    return sample(opened.prior, opened.network, 1000, rng, horizon_s=search.horizon_s)


def _bare_rate(opened: OpenScenario, particles: Particles) -> float:
    """Return the vehicle-seconds per second of sumo itself, all particles in one run."""
    with TemporaryDirectory() as folder:
        routes, fcd = Path(folder, "routes.xml"), Path(folder, "fcd.parquet")
        routes.write_text("\n".join(_route_file(opened, particles)), encoding="utf-8")
        given = {
            "net-file": opened.network.path,
            "route-files": routes,
            "step-length": STEP_S,
            "end": opened.scenario.search.horizon_s,
            "fcd-output": fcd,
            "time-to-teleport": -1,
            "collision.action": "none",
            "no-step-log": "true",
            "no-warnings": "true",
        }
        sumo_environment()
        command = [str(binary("sumo")), *(f"--{key}={value}" for key, value in given.items())]
        took_s, _ = _timed(lambda: subprocess.run(command, check=True, capture_output=True))
        rows = import_module("pyarrow.parquet").read_table(fcd, columns=["vehicle_id"])[0]
        return float(STEP_S * (len(rows) - rows.null_count) / took_s)


def _route_file(opened: OpenScenario, particles: Particles) -> Iterator[str]:
    names = np.array(opened.network.edge_ids)
    yield "<routes>"
    for k in range(len(particles.weight)):
        yield (
            f'<vType id="{k}" maxSpeed="{particles.speeds(k)[0]}" speedFactor="1" speedDev="0" '
            f'sigma="0"/><vehicle id="{k}" type="{k}" depart="{particles.depart_s[k]}" '
            f'departPos="{particles.start_m[k]}" departSpeed="0" insertionChecks="none">'
            f'<route edges="{" ".join(names[particles.route(k)])}"/></vehicle>'
        )
    yield "</routes>"


def _timed(work: Callable[[], T]) -> tuple[float, T]:
    begun = time.perf_counter()
    result = work()
    return time.perf_counter() - begun, result


def _warm(work: Callable[[], Any], repeats: int) -> tuple[float, ...]:
    work()
    return tuple(_timed(work)[0] for _ in range(repeats))


def _ratios(ones: Sequence[float], others: Sequence[float]) -> tuple[float, ...]:
    return tuple(one / other for one, other in zip(ones, others, strict=True))


def _command(*arguments: str) -> tuple[float, float]:
    """Return the seconds that a command takes, and the memory of its largest process in MB."""
    command = [sys.executable, "-c", STARTER, sys.executable, "-m", "planner", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"benchmark: planner {' '.join(arguments)} failed: {done.stderr}")
    took_s, peak = map(float, done.stdout.split())
    return took_s, peak * (1 if sys.platform == "darwin" else 1024) / 1e6


def _stop_workers() -> None:
    from planner.futures.workers import dismiss

    dismiss()


def arguments(argv: Sequence[str] | None = None) -> argparse.Namespace:
    """Return what the command line asks for."""
    about = "\n".join(f"  {name:<12}{work.__doc__}" for name, work in SECTIONS.items())
    parser = argparse.ArgumentParser(
        description=__doc__,
        epilog=f"sections:\n{about}\n\nLonger programs, each with its own options:\n"
        + "\n".join(f"  --{name} --help" for name in PROGRAMS),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--only",
        action="append",
        choices=SECTIONS,
        metavar="NAME",
        help="measure only this section; repeatable",
    )
    parser.add_argument(
        "--repeats", type=int, default=5, metavar="N", help="repetitions of each (default 5)"
    )
    parser.add_argument(
        "--against", type=Path, metavar="DIR", help="reading: compare with this checkout, in turn"
    )
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="also write every single value to FILE"
    )
    wanted = parser.parse_args(argv)
    if wanted.repeats < 1:
        parser.error("--repeats must be 1 or more")
    return wanted


def main(argv: Sequence[str] | None = None) -> None:
    """Measure and print."""
    argv = sys.argv[1:] if argv is None else argv
    for name in PROGRAMS:
        if argv[:1] == [f"--{name}"]:
            sys.exit(import_module(f"benchmarks.{name.replace('-', '_')}").main(argv[1:]))
    wanted = arguments(argv)
    SECTIONS["reading"] = partial(reading, against=wanted.against)
    host, figures = machine(), []
    try:
        for section in wanted.only or SECTIONS:
            print(f"measuring {section} ...", file=sys.stderr)
            figures += [(section, figure) for figure in SECTIONS[section](wanted.repeats)]
        show(figures, host)
        if wanted.json:
            rows = [{"section": at, **asdict(one), "median": one.median} for at, one in figures]
            with written_whole(wanted.json) as path:
                content = {"machine": host, "figures": rows}
                path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    except PlannerError as error:
        print(f"benchmark: {error}", file=sys.stderr)
        raise SystemExit(2) from error


if __name__ == "__main__":
    main()
