"""At every point of a real flight there is time left for the way home, the landing, the reserve."""

import math

import numpy as np
import pytest

from planner.flight.as_flown import Battery, as_flown
from planner.flight.law import FlightLaw
from planner.flight.plan import Plan
from planner.search.plan import plan_of_legs, plan_of_wait
from planner.search.problem import Problem
from support.search_instances import random_problem


def aircraft(rng: np.random.Generator, speed_mps: float) -> tuple[FlightLaw, float]:
    """Any aircraft, one that hovers or one that does not, and the wind that it comes home against.

    It is told the wind, or keeps enough for one that it does not know.
    """
    wind_mps, angle = rng.uniform(0, 0.3) * speed_mps, rng.uniform(0, 2 * math.pi)
    known = rng.random() < 0.5
    law = FlightLaw(
        speed_mps,
        acceleration_mps2=rng.uniform(0.5, 20),
        corner_m=rng.uniform(1, 40),
        climb_mps=rng.uniform(1, 5),
        descend_mps=rng.uniform(1, 5),
        altitude_m=rng.uniform(0, 120),
        min_speed_mps=rng.choice([0.0, 0.8]) * speed_mps,
        wind_mps=(wind_mps * math.cos(angle), wind_mps * math.sin(angle)) if known else (0.0, 0.0),
    )
    return law, wind_mps


def plans(problem: Problem, rng: np.random.Generator) -> list[Plan]:
    many = 2 * len(problem.network.road_ids)
    nodes = problem.network.node_xy_m
    return [
        plan_of_legs(problem, "any", rng.integers(0, many, 8).tolist()),
        plan_of_wait(problem, "wait", *nodes[rng.integers(len(nodes))].tolist()),
    ]


@pytest.mark.parametrize("seed", range(40))
def test_it_could_always_turn_for_home(seed: int) -> None:
    rng = np.random.default_rng(seed)
    problem = random_problem(seed)
    uav = problem.uav
    law, headwind_mps = aircraft(rng, uav.speed_mps)
    lasts_s = law.climb_s + law.descend_s + rng.uniform(10, 2000)
    reserve_s = rng.uniform(0, 1) * (lasts_s - law.climb_s - law.descend_s)
    home = np.array([uav.x_m, uav.y_m])
    battery = Battery(lasts_s, reserve_s, (uav.x_m, uav.y_m), headwind_mps)
    for plan in plans(problem, rng):
        (track,) = as_flown(plan, law, battery, planned_mps=uav.speed_mps).tracks
        used_s = track.time_s - track.time_s[0]
        away_m = np.hypot(track.x_m - home[0], track.y_m - home[1])
        still_s = away_m / (law.speed_mps - headwind_mps) + law.descend_s
        in_air = slice(0, len(used_s) - (law.descend_s > 0.0))
        assert np.all((used_s + still_s + reserve_s)[in_air] <= lasts_s + 1e-6)
        assert used_s[-1] + reserve_s <= lasts_s + 1e-6
        assert (track.x_m[-1], track.y_m[-1]) == (uav.x_m, uav.y_m)
