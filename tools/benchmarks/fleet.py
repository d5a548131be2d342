"""Fleets of two to four UAVs on the 5 x 5 grid, with perfect sensors, against what is aimed at."""

import time
from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.figures import Figure
from benchmarks.grid import opened_at
from planner import Futures, OpenScenario, Recorder, make_plan, method_named, problem_of
from planner.detection.evaluate import evaluate

AIMS_S = {  # E[min(tau, horizon)] of 2, 3 and 4 UAVs from the same place
    60: (905.0, 810.0, 770.0),
    120: (1720.0, 1625.0, 1525.0),
    300: (4380.0, 4070.0, 3850.0),
}
CPU_S = 10.0


def fleet_rows(u0_km: int, seeds: int, judges: Futures) -> Iterator[Figure]:
    """Yield what fleets from one distance achieve on fresh targets, and how long they plan."""
    for many, aim_s in enumerate(AIMS_S[u0_km], 2):
        runs = [_planned(u0_km, many, seed, judges) for seed in range(1, seeds + 1)]
        expected_s, took_s = map(tuple, zip(*runs, strict=True))
        mean_s = (float(np.mean(expected_s)),)
        yield Figure(f"{many} UAVs: E", "s", mean_s, at_most=aim_s)
        yield Figure(f"{many} UAVs: CPU time of planning", "s", took_s, at_most=CPU_S)


def _planned(u0_km: int, many: int, seed: int, judges: Futures) -> tuple[float, float]:
    """Return the expected time of one fleet's plan, and the CPU seconds that it took."""
    opened = fleet_of(u0_km, many, seed)
    recorder, best = Recorder(opened, 1), method_named("best")
    particles, holdout = recorder.planning().futures, recorder.holdout().futures
    plan = partial(make_plan, best, opened, recorder, particles, holdout=holdout)
    begun_s = time.process_time()
    tracks = plan().plan.tracks
    took_s = time.process_time() - begun_s
    problem = problem_of(opened, particles)
    found = evaluate(tracks, judges, problem.sensor, problem.objective)
    return found.expected_detection_time_s, took_s


def fleet_of(u0_km: int, many: int, seed: int) -> OpenScenario:
    """Return the scenario of so many UAVs that start from the same place."""
    uav = f'{{ start = {{ node = "r0c0", bearing_deg = 315, distance_m = {1000 * u0_km} }} }}'
    return opened_at(u0_km, f"uav=[{', '.join([uav] * many)}]", seed=seed)
