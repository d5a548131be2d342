"""What futures in towns cost: forks against fresh loads, whole commands, the clock, knots, memory.

Seconds of CPU are those of all processes, so that a busy machine measures nearly the same; wall
times are only meant on two idle cores. Luxembourg is left out where its data are not.

python tools/benchmark.py --futures-towns [--only berlin] [--repeats 3]
"""

import argparse
import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from benchmarks.cold import empty_cache, nothing_recorded
from benchmarks.figures import Figure, machine, show
from planner import OpenScenario, Recorder, open_scenario, sample, stream
from planner.belief.particles import Particles
from planner.futures.futures import Futures
from planner.futures.kinematic import kinematic_futures
from planner.futures.record import record, session_of
from planner.futures.rides import Session, drive_session
from planner.futures.workers import dismiss, in_processes
from planner.network.road_network import RoadNetwork
from planner.network.signals import signals_of

ROOT = Path(__file__).resolve().parents[2]
RIDE_S = 1200.0  # of a particle's motion
FEW, MANY = 10, 60  # rides, whose difference leaves loading out
FRESH = 5  # rides that load SUMO anew
COMMAND = ("--set", f"search.horizon_s={RIDE_S:g}", "--set", "search.particles=1000")
PLAN = ("plan", "berlin", "--method", "rate", "--set", "search.particles=400", "-j", "2")
FIRST_PLAN = "roads in the order flown"
GROWTH = (50, 100, 200, 400)  # particles


class Aims(NamedTuple):
    """What is aimed at in a town."""

    of_fresh: float  # a ride, as a share of a fresh load
    wall_s: float  # 1,000 particles
    worker_mb: float | None


AIMS = {"berlin": Aims(1 / 15, 15.0, None), "luxembourg": Aims(1 / 30, 25.0, 300.0)}


def towns() -> Iterator[tuple[str, OpenScenario]]:
    """Yield the towns that there are."""
    yield "berlin", open_scenario("berlin")
    sys.path.insert(0, str(ROOT / "tests"))
    support: Any = import_module("support.towns")
    with TemporaryDirectory() as folder:
        try:
            yield "luxembourg", support.luxembourg(Path(folder))
        except BaseException as reason:  # pytest's way to skip is none of Exception
            if type(reason).__name__ != "Skipped":
                raise
            print(f"luxembourg is left out: {reason}", file=sys.stderr)


class Spent(NamedTuple):
    """What a process has used since it began."""

    cpu_s: float
    largest_mb: float


def measured(session: Session, *, forks: bool) -> Spent:
    """Drive a session, in a worker, and return what that took of its and its forks' time."""
    before = _cpu_s()
    drive_session(session, forks=forks)
    return Spent(_cpu_s() - before, _largest_mb())


def _largest_mb() -> float:
    """Return the most memory that this process has held, without what its parent held before it."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status.partition("VmHWM:")[2].split()[0]) * 1024 / 1e6


def _cpu_s() -> float:
    whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    used = [resource.getrusage(one) for one in whose]
    return sum(one.ru_utime + one.ru_stime for one in used)


def rides(name: str, opened: OpenScenario, repeats: int) -> Iterator[Figure]:
    """Compare a fork per particle with a fresh load per particle, in turn."""
    particles = drawn(opened, MANY)
    forked, fresh, memory = [], [], []
    for _ in range(repeats):
        few, many = (_spent(opened, particles, count, forks=True) for count in (FEW, MANY))
        forked.append(1000 * (many.cpu_s - few.cpu_s) / (MANY - FEW))
        fresh.append(1000 * _spent(opened, particles, FRESH, forks=False).cpu_s / FRESH)
        memory.append(many.largest_mb)
    aims = AIMS[name]
    yield Figure("a ride, loading apart", "CPU ms", tuple(forked))
    yield Figure("a ride that loads the net", "CPU ms", tuple(fresh))
    shares = tuple(one / other for one, other in zip(forked, fresh, strict=True))
    yield Figure("the one to the other", "times", shares, at_most=aims.of_fresh)
    yield Figure("memory of a worker", "MB", tuple(memory), at_most=aims.worker_mb)


def _spent(opened: OpenScenario, particles: Particles, count: int, *, forks: bool) -> Spent:
    dismiss()
    task = session_of(opened.network, particles, np.arange(count), 7, RIDE_S)
    (spent,) = in_processes(partial(measured, forks=forks), [task], workers=1)
    return spent


def drawn(opened: OpenScenario, count: int) -> Particles:
    """Return independent particles of 20 minutes."""
    rng = stream(1, "benchmark")
    return sample(opened.prior, opened.network, count, rng, horizon_s=RIDE_S)


def growth(opened: OpenScenario) -> Iterator[Figure]:
    """Record more and more particles in one process."""
    for count in GROWTH:
        particles = drawn(opened, count)
        dismiss()
        before = _cpu_s()
        record(opened.network, particles, horizon_s=RIDE_S, workers=1)
        dismiss()  # its time counts once it has ended
        yield Figure(f"{count} particles", "CPU s", (_cpu_s() - before,))


def knots(futures: Futures) -> Figure:
    """Return how many knots a minute of driving has."""
    first_s = futures.time_s[futures.first_knot[:-1]]
    minutes = float((futures.end_s - first_s).sum()) / 60
    return Figure("knots a minute", "", (len(futures.time_s) / minutes,), at_most=12)


def clock(opened: OpenScenario, repeats: int) -> Figure:
    """Return what 10,000 particles of the kinematic clock take, routes drawn anew each time."""
    used = []
    signals = signals_of(opened.network)
    for number in range(repeats + 1):
        rng = stream(number, "benchmark")
        begun = time.process_time()
        particles = sample(opened.prior, opened.network, 10_000, rng, horizon_s=RIDE_S)
        kinematic_futures(opened.network, particles, signals, horizon_s=RIDE_S)
        used.append(time.process_time() - begun)
    return Figure("10,000 clock particles with routes", "CPU s", tuple(used[1:]), at_most=1.2)


def command(folder: Path, *arguments: str) -> float:
    """Return how long a command takes whose cache holds nothing but nets and compiled code."""
    here = nothing_recorded(folder)
    begun = time.perf_counter()
    words = [sys.executable, "-m", "planner", *arguments]
    subprocess.run(words, env=here, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begun


def first_plan(folder: Path) -> tuple[float, float, float]:
    """Return when a first plan is on the screen, when all is, and the half-width in per cent."""
    script = f"{sys.executable} -m planner {' '.join(PLAN)}"
    begun = time.perf_counter()
    words = ["script", "-qec", script, "/dev/null"]
    run = subprocess.Popen(words, env=nothing_recorded(folder), stdout=subprocess.PIPE)
    assert run.stdout is not None
    first_s, said = 0.0, b""
    while part := os.read(run.stdout.fileno(), 1 << 16):
        said += part
        if not first_s and FIRST_PLAN.encode() in said:
            first_s = time.perf_counter() - begun
    run.wait()
    whole_s = time.perf_counter() - begun
    text = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", said.decode(errors="replace"))
    row = re.search(r"expected detection time\s+[\d,]+ s\s+([\d,]+) s\s+([\d,]+) s", text)
    assert row is not None, text[-2000:]
    mean, low = (float(number.replace(",", "")) for number in row.groups())
    return first_s, whole_s, 100 * (mean - low) / mean


def plans(repeats: int) -> Iterator[Figure]:
    """Plan in Berlin with nothing recorded."""
    with TemporaryDirectory() as folder:
        times = [first_plan(Path(folder)) for _ in range(repeats)]
    first_s, whole_s, width = zip(*times, strict=True)
    yield Figure("first plan on the screen", "s", first_s, at_most=8)
    yield Figure("its figure", "s", whole_s, at_most=40)
    yield Figure("half-width of its interval", "% of the mean", width, at_most=4)


def grid(repeats: int) -> Iterator[Figure]:
    """Record 1,000 particles of the grid in processes of their own."""
    opened, used = open_scenario("grid5x5", overrides=["search.particles=1000"]), []
    for _ in range(repeats):
        dismiss()
        begun = _cpu_s()
        with empty_cache():
            Recorder(opened, 2).planning()
        dismiss()  # its time counts once it has ended
        used.append(_cpu_s() - begun)
    yield Figure("1,000 particles, cold", "CPU s", tuple(used), at_most=2.5)


def in_town(name: str, opened: OpenScenario, repeats: int) -> Iterator[Figure]:
    """Measure all that is measured in one town."""
    network: RoadNetwork = opened.network
    yield from rides(name, opened, repeats)
    yield from growth(opened)
    yield knots(record(network, drawn(opened, 50), horizon_s=RIDE_S))
    if name == "luxembourg":
        yield clock(opened, repeats)
    with TemporaryDirectory() as folder:
        scenario = str(opened.scenario.path)
        walls = [
            command(Path(folder), "futures", scenario, *COMMAND, "-j", "2") for _ in range(repeats)
        ]
    yield Figure("1,000 particles, planner futures", "s", tuple(walls), at_most=AIMS[name].wall_s)


def main(argv: Sequence[str]) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    sections: dict[str, Callable[[], Iterator[Figure]]] = {}
    parser.add_argument("--only", action="append", metavar="NAME", help="berlin, luxembourg, ...")
    parser.add_argument("--repeats", type=int, default=3, metavar="N")
    wanted = parser.parse_args(argv)
    host, found = machine(), []
    for name, opened in towns():
        sections[name] = partial(in_town, name, opened, wanted.repeats)
        found += _section(name, sections[name], wanted.only)
    found += _section("plan", partial(plans, wanted.repeats), wanted.only)
    found += _section("grid5x5", partial(grid, wanted.repeats), wanted.only)
    show(found, host)
    return 0


def _section(
    name: str, figures: Callable[[], Iterator[Figure]], only: Sequence[str] | None
) -> list[tuple[str, Figure]]:
    if only and name not in only:
        return []
    print(f"measuring {name} ...", file=sys.stderr)
    return [(name, figure) for figure in figures()]
