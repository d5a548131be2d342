"""Futures in traffic: what they cost, and how far riders slow each other.

Seconds of CPU are those of all processes; wall times are only meant on two idle cores. Bologna is
left out where its data are not (set PLANNER_DATA to the folder that holds bologna_acosta).

python tools/benchmark.py --traffic [--only riders]
"""

import argparse
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from benchmarks import traffic_cases
from benchmarks.cold import empty_cache, nothing_recorded
from benchmarks.figures import Figure, machine, show
from planner import OpenScenario, Recorder, open_scenario, sample, stream
from planner.arrays import Floats
from planner.belief.particles import Particles, Realisations
from planner.futures.among_traffic import RIDERS
from planner.futures.riders import TrafficSession, drive
from planner.futures.tracks import motion_of
from planner.futures.vehicles import vehicles_of
from planner.futures.workers import dismiss, in_parts
from planner.intervals import ratio_of_means

LOOK_S = (120.0, 300.0, 600.0)
WITHIN = 0.03  # of the way that a particle comes alone, with as many riders as recordings have
CROWD = 100  # riders in a copy, which the same test must find to be too many
PAIRED, REALISATIONS = 300, 3  # a crowd of them in each
FEWER = 60  # where each copy of the traffic costs much
BERLIN = (
    "target.driving=traffic",
    "target.start={ x_m = 1492.6, y_m = 671.7, radius_m = 150 }",
    "search.horizon_s=1200",
)
BOLOGNA = (
    "traffic.at=1200",
    "traffic.realisations=2",
    "target.start={ x_m = 900, y_m = 700, radius_m = 300 }",
)


def berlin(per_hour: float, *more: str) -> OpenScenario:
    """Return Berlin with so many vehicles setting out in an hour."""
    traffic = f"traffic.vehicles_per_hour={per_hour:g}"
    return open_scenario("berlin", overrides=[*BERLIN, traffic, *more])


def bologna(folder: Path) -> OpenScenario | None:
    """Return Bologna's rush hour as a scenario in a folder; None where its data are not."""
    path = traffic_cases.bologna(folder, 100)
    return None if path is None else open_scenario(path, overrides=BOLOGNA)


# How far riders slow each other


class Way(NamedTuple):
    """How far particles come in traffic."""

    driven_m: Floats  # (N, times) metres along their ways
    cpu_s: float


def way(opened: OpenScenario, particles: Particles, riders: int) -> Way:
    """Return how far particles come, so many of whom ride in each copy of the traffic."""
    assert opened.traffic is not None
    dismiss()
    before_s = cpu_s()
    tasks, whose = [], []
    for realisation in np.unique(particles.realisation).tolist():
        there = np.flatnonzero(particles.realisation == realisation)
        copies = np.split(there, np.arange(riders, len(there), riders))
        whose.append(copies)
        tasks.append(
            TrafficSession(
                net=opened.network.path.absolute(),
                given_as=opened.network.given_as,
                traffic=opened.traffic,
                realisation=realisation,
                together=tuple(vehicles_of(opened.network, particles, copy) for copy in copies),
                alone=(False,) * len(copies),
                end_s=max(LOOK_S),
            )
        )
    driven_m = np.zeros((len(particles), len(LOOK_S)))
    for task, part in in_parts(drive, tasks, workers=2):
        for k, ride in zip(whose[task][part.number], part.rides, strict=True):
            time_s, x_m, y_m = motion_of(ride, part.step_s).T
            along_m = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x_m), np.diff(y_m)))))
            driven_m[k] = np.interp(LOOK_S, time_s, along_m)
    dismiss()  # their time counts once they have ended
    return Way(driven_m, cpu_s() - before_s)


def riders_of(
    name: str, opened: OpenScenario, count: int, aims: Mapping[int, Mapping[str, float]]
) -> Iterator[Figure]:
    """Compare the ways of the same particles, alone and among others.

    Parameters
    ----------
    aims
        How many ride together, and what then is aimed at.
    """
    rng = stream(1, "benchmark")
    some = sample(opened.prior, opened.network, count, rng, horizon_s=max(LOOK_S))
    some = some.in_realisations(Realisations(0, REALISATIONS))
    alone = way(opened, some, 1)
    yield Figure(f"{name}: a particle alone", "CPU s", (alone.cpu_s / count,))
    for riders, aim in aims.items():
        among = way(opened, some, riders)
        yield Figure(f"{name}: {riders} riders, each", "CPU s", (among.cpu_s / count,))
        for at, at_s in enumerate(LOOK_S):
            ratio, half = ratio_of_means(among.driven_m[:, at], alone.driven_m[:, at])
            worst = max(abs(ratio - half - 1), abs(ratio + half - 1))
            told = f"{name}: {riders} riders, {at_s:g} s: way {ratio:.3f} +- {half:.3f}, off by"
            yield Figure(told, "at most", (worst,), **aim)


def riders() -> Iterator[Figure]:
    """Let the same particles ride alone, ten together, and a hundred together."""
    aims = {RIDERS: {"at_most": WITHIN}, CROWD: {"at_least": WITHIN}}
    yield from riders_of("1,000/h", berlin(1000), PAIRED, aims)


def jam() -> Iterator[Figure]:
    """Do the same in a jam and in a rush hour, with fewer particles."""
    yield from riders_of("3,000/h", berlin(3000), FEWER, {RIDERS: {}})
    with TemporaryDirectory() as folder:
        opened = bologna(Path(folder))
        if opened is not None:
            yield from riders_of("Bologna", opened, FEWER, {RIDERS: {}})


# What recordings cost


def recording() -> Iterator[Figure]:
    """Record in Berlin and in Bologna, with nothing in the cache."""
    eight = "traffic.realisations=8"
    yield from _recorded("Berlin, 1,000 particles", berlin(1000, eight), 60.0)
    with TemporaryDirectory() as folder:
        opened = bologna(Path(folder))
        if opened is not None:
            yield from _recorded("Bologna, 100 particles, warm-ups and all", opened, 30.0)


def _recorded(name: str, opened: OpenScenario, at_most: float) -> Iterator[Figure]:
    dismiss()
    before_s, begun_s = cpu_s(), time.perf_counter()
    with empty_cache():
        futures = Recorder(opened, 2).planning().futures
        took_s = time.perf_counter() - begun_s
        dismiss()
        yield Figure(f"{name}, two processes", "s", (took_s,), at_most=at_most)
        yield Figure(f"{name}", "CPU s", (cpu_s() - before_s,))
    print(futures.fates, file=sys.stderr)


def plan() -> Iterator[Figure]:
    """Plan in Berlin's traffic with nothing recorded, and once more."""
    words = ["--set", "traffic.vehicles_per_hour=1000"]
    for override in BERLIN:
        words += ["--set", override]
    command = [sys.executable, "-m", "planner", "plan", "berlin", "-j", "2", *words]
    with TemporaryDirectory() as folder:
        here = nothing_recorded(Path(folder))
        for name, aim in (("a plan in traffic, cold", 120.0), ("the same, cached", 10.0)):
            begun_s = time.perf_counter()
            subprocess.run(command, env=here, check=True, stdout=subprocess.DEVNULL)
            yield Figure(name, "s", (time.perf_counter() - begun_s,), at_most=aim)


def cpu_s() -> float:
    """Return what this process and those that have ended have used."""
    whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    used = [resource.getrusage(one) for one in whose]
    return sum(one.ru_utime + one.ru_stime for one in used)


SECTIONS: dict[str, Callable[[], Iterator[Figure]]] = {
    "recording": recording,
    "plan": plan,
    "riders": riders,
    "jam": jam,
}


def main(argv: Sequence[str]) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", choices=SECTIONS, metavar="NAME")
    wanted = parser.parse_args(argv)
    host, found = machine(), []
    for name, measured in SECTIONS.items():
        if not wanted.only or name in wanted.only:
            print(f"measuring {name} ...", file=sys.stderr)
            found += [(name, figure) for figure in measured()]
    show(found, host)
    return 0
