"""Certificates hold where roads are merged, and particles drive beside their lines."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from planner.bounds.certificate import Certificate, Effort, certified
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.record import record
from planner.network.roads import with_roads
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.rate import rate_order
from planner.search.stop import WorkDone
from planner.search.what_if import WhatIf
from support.certified_runs import write_certified
from support.sumo_instances import town, walkers

VERIFY = Path(__file__).parents[2] / "tools" / "verify.py"
RADIUS_M, TOLERANCE_M, PLANS = 30.0, 10.0, 1500


@pytest.fixture(scope="module")
def problem() -> Problem:
    network = with_roads(town(), TOLERANCE_M)
    particles = walkers(
        network, 24, np.random.default_rng(2), start="nw-n", roads=12, driving="free"
    )
    futures = record(network, particles, horizon_s=300.0, workers=1)
    uav = Uav(x_m=-300.0, y_m=200.0, take_off_s=30.0, speed_mps=40.0)
    return Problem(network, futures, uav, Sensor(RADIUS_M), Objective(300.0))


@pytest.fixture(scope="module")
def order(problem: Problem) -> list[int]:
    return rate_order(WhatIf(problem))


@pytest.fixture(scope="module")
def certificate(problem: Problem, order: list[int]) -> Certificate:
    return certified(problem, plan_of_legs(problem, "", order), Effort(stop=WorkDone(80)))


def test_particles_are_beside_the_roads_that_are_flown(problem: Problem) -> None:
    network, futures = problem.network, problem.futures
    assert len(network.road_ids) < len(network.edge_ids)
    edge = futures.edges.of_times(futures.time_s, futures.first_knot)
    places_m = np.stack([futures.x_m, futures.y_m], axis=1)
    off_m = network.road_lines.off(network.edge_road[edge], places_m, places_m)
    assert np.median(off_m) > 1.0


def test_no_plan_over_merged_roads_is_better_than_the_bound(
    problem: Problem, order: list[int], certificate: Certificate
) -> None:
    rng, legs = np.random.default_rng(3), len(problem.legs)
    assert certificate.plan_class == "roads"
    assert certificate.bound <= certificate.value
    for _ in range(PLANS):
        kept = int(rng.integers(len(order) + 1))
        tried = [*order[:kept], *rng.integers(legs, size=8).tolist()]
        track = plan_of_legs(problem, "", tried).tracks[0]
        seen_at = first_detection(problem.futures, track, RADIUS_M)
        reward = float(problem.futures.weight @ problem.objective.reward(seen_at))
        assert problem.objective.value(reward) >= certificate.bound - 1e-6


def test_another_program_finds_the_same(problem: Problem, order: list[int], tmp_path: Path) -> None:
    write_certified(tmp_path, problem, plan_of_legs(problem, "rate", order))
    command = [sys.executable, str(VERIFY), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "roads" in done.stdout
