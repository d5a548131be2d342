"""What planning for a sensor that misses gains over planning as if it were perfect.

On the 5 x 5 grid from 60, 120 and 300 km, five planning seeds each; all plans are flown against the
same 65,536 fresh targets, whose speeds stay constant, so that they are moved without SUMO. A gain
is paired: per target, averaged over the seeds; its interval holds what the targets and what the
seeds leave open.

python tools/benchmark.py --online [--seeds 5] [--targets 65536]
"""

import argparse
import math
import sys
import time
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from benchmarks.figures import Figure, machine, show
from benchmarks.fleet import fleet_rows
from planner import (
    Futures,
    OpenScenario,
    Particles,
    Recorder,
    RoadNetwork,
    make_plan,
    method_named,
    open_scenario,
    problem_of,
    sample,
    stream,
)
from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.flight.plan import Plan

GRID = "grid5x5"
TARGETS, TARGETS_SEED = 65_536, 1001
DISTANCES_KM = (60, 120, 300)
T_95 = {2: 12.71, 3: 4.30, 4: 3.18, 5: 2.78}  # Student's, by the number of seeds


class Aim(NamedTuple):
    """What is aimed at: the lower limit of the gain, percent, and about which E, seconds."""

    gain: float | None  # None: not worse
    expected_s: float


AIMS = {
    (60, 0.9): Aim(9.0, 1447.0),
    (60, 0.7): Aim(20.0, 1980.0),
    (60, 0.5): Aim(25.0, 2690.0),
    (120, 0.9): Aim(0.5, 2605.0),
    (120, 0.7): Aim(4.5, 3214.0),
    (120, 0.5): Aim(9.5, 3950.0),
    (300, 0.9): Aim(None, 5273.0),
    (300, 0.7): Aim(1.0, 5650.0),
    (300, 0.5): Aim(3.5, 6100.0),
}


def moved(network: RoadNetwork, particles: Particles) -> Futures:
    """Return how particles move at constant speed along straight edges: exact, without SUMO."""
    first, edge, speed = particles.first_edge, particles.route_edge, particles.speed_mps
    length_m, counts = network.edge_length_m[edge], np.diff(particles.first_edge)
    way_m = length_m.copy()
    way_m[first[:-1]] -= particles.start_m
    since = np.concatenate(([0.0], np.cumsum(way_m / speed)))
    ends_s = (
        since[1:] - np.repeat(since[first[:-1]], counts) + np.repeat(particles.depart_s, counts)
    )
    knots = first + np.arange(len(first))
    at_end = np.arange(len(edge)) + np.repeat(np.arange(len(counts)), counts) + 1
    time_s, xy_m = np.empty(knots[-1]), np.empty((knots[-1], 2))
    time_s[knots[:-1]], time_s[at_end] = particles.depart_s, ends_s
    xy_m[knots[:-1]] = network.edge_xy(edge[first[:-1]], particles.start_m)
    xy_m[at_end] = network.edge_xy(edge, length_m)
    x_m, y_m = xy_m.T
    return Futures(time_s, x_m, y_m, knots, particles.weight, particles.gone)


def fresh(opened: OpenScenario, many: int) -> Futures:
    """Return fresh targets, independent draws, the same whatever was planned."""
    particles = sample(
        opened.prior,
        opened.network,
        many,
        stream(TARGETS_SEED, "evaluation"),
        sampling="iid",
        horizon_s=opened.scenario.search.horizon_s,
    )
    return moved(opened.network, particles)


def planned(u0_km: int, seed: int, detects: float) -> tuple[Plan, float]:
    """Return the plan of `best`, and the CPU seconds that it took."""
    opened = _opened(u0_km, seed, detects)
    recorder, best = Recorder(opened, 1), method_named("best")
    particles, holdout = recorder.planning().futures, recorder.holdout().futures
    begun_s = time.process_time()
    found = make_plan(best, opened, recorder, particles, holdout=holdout)
    return found.plan, time.process_time() - begun_s


def _opened(u0_km: int, seed: int, detects: float) -> OpenScenario:
    overrides = (f"uav.start.distance_m={1000 * u0_km}", f"search.seed={seed}")
    return open_scenario(GRID, overrides=(*overrides, f"sensor.detects={detects}"))


class Gained(NamedTuple):
    """What planning for the misses there are gains."""

    blind_s: Floats  # (S,) E of the plans as if perfect, flown with misses
    own_s: Floats  # (S,) E of those made for it
    gain: float  # share of the expected time
    half: float  # of its 95 % interval


def gained(blind: Sequence[Floats], own: Sequence[Floats]) -> Gained:
    """Return the gain, from the expected times of targets, (N,) for each seed."""
    apart, blind_s = np.mean(np.array(blind) - own, axis=0), np.mean(blind, axis=1)
    own_s, all_s, seeds = np.mean(own, axis=1), float(np.mean(blind)), len(blind)
    of_targets = 1.96 * float(np.std(apart, ddof=1)) / math.sqrt(len(apart))
    of_seeds = T_95[seeds] * float(np.std(blind_s - own_s, ddof=1)) / math.sqrt(seeds)
    half = math.hypot(of_targets, of_seeds) / all_s
    return Gained(blind_s, own_s, float(apart.mean()) / all_s, half)


def misses(u0_km: int, seeds: int, targets: int) -> Iterator[Figure]:
    """Plan as if perfect and for detects .9, .7 and .5 from one distance."""
    judges = fresh(_opened(u0_km, 1, 1.0), targets)
    blind = [planned(u0_km, seed, 1.0) for seed in range(1, seeds + 1)]
    for (km, detects), aim in AIMS.items():
        if km != u0_km:
            continue
        problem = problem_of(_opened(u0_km, 1, detects), judges)
        own = [planned(u0_km, seed, detects) for seed in range(1, seeds + 1)]
        times = [
            [
                evaluate(plan.tracks, judges, problem.sensor, problem.objective).time_s
                for plan, _ in some
            ]
            for some in (blind, own)
        ]
        found, name = gained(*times), f"detects {detects:g}"
        low = 100.0 * (found.gain - found.half)
        aimed = -100.0 * found.half if aim.gain is None else aim.gain
        yield Figure(f"{name}: gain", "%", (100.0 * found.gain,))
        yield Figure(f"{name}: gain, lower 95 % limit", "%", (low,), at_least=aimed)
        yield Figure(f"{name}: E as if perfect", "s", (float(found.blind_s.mean()),))
        yield Figure(f"{name}: E, about {aim.expected_s:,.0f}", "s", (float(found.own_s.mean()),))
        slower = np.median([one for _, one in own]) / np.median([one for _, one in blind])
        yield Figure(
            f"{name}: CPU time of that without misses", "times", (float(slower),), at_most=3
        )


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="benchmark.py --online",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seeds", type=int, default=5, choices=T_95, help="default: 5")
    parser.add_argument("--targets", type=int, default=TARGETS, metavar="N")
    parser.add_argument("--only", type=int, choices=DISTANCES_KM, action="append", help="in km")
    wanted = parser.parse_args(argv)
    host, figures = machine(), []
    for u0_km in wanted.only or DISTANCES_KM:
        judges = fresh(_opened(u0_km, 1, 1.0), wanted.targets)
        fleets = fleet_rows(u0_km, wanted.seeds, judges)
        for figure in chain(misses(u0_km, wanted.seeds, wanted.targets), fleets):
            print(f"{u0_km} km: {figure.what}: {figure.median:,.4g}", file=sys.stderr, flush=True)
            figures.append((f"{u0_km} km", figure))
    show(figures, host)
    return 0
