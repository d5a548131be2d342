"""The paper's greedy planner against a literal, slow one, and by hand."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pytest

from planner.arrays import Flags, Floats
from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import InputError, NotApplicableError
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.search.greedy import GreedyOptions, greedy
from planner.search.problem import Budget, Problem, candidate_legs
from planner.search.state import SearchState
from planner.search.what_if import WhatIf
from support.grid_instance import grid_futures, grid_problem
from support.instances import network_of_roads
from support.search_instances import flown, random_problem

RNG = np.random.default_rng(0)  # handed to every planner, not used by this one


def order_of(plan: Plan) -> list[int]:
    return [leg.leg for leg in plan.legs[0]]


@dataclass
class Printed:
    """Figure 6 with its two global matrices, one row per simulation."""

    observed: Flags
    observation_times: Floats

    def what_if(self, problem: Problem, state: SearchState, legs: list[int]) -> None:
        for i, leg in enumerate(legs):
            seen_at = flown(problem, state, leg)
            assert seen_at is not None
            for k in np.flatnonzero(np.isfinite(seen_at)):
                if not self.observed[i, k]:
                    self.observed[i, k] = True
                    self.observation_times[i, k] = seen_at[k]

    def take_over(self, least: int, copied: bool) -> None:
        self.observation_times[:] = self.observation_times[least]
        if copied:
            self.observed[:] = self.observed[least]


def printed_greedy(problem: Problem, depth: int, options: GreedyOptions) -> list[int]:
    """Figure 4 with whole tracks and first_detection alone."""
    shape = (len(problem.legs), len(problem.futures))
    figure6 = Printed(np.zeros(shape, dtype=bool), np.full(shape, np.inf))
    state = problem.first_state
    while len(state.order) < depth and state.time_s < problem.horizon_s:
        if options.ends == "all found" and np.isfinite(figure6.observation_times[0]).all():
            break
        removed = state.roads if options.roads == "removed" else frozenset()
        legs = list(
            map(int, candidate_legs(problem, state, directions=options.direction, removed=removed))
        )
        if not legs:
            break
        before = figure6.observation_times[0].copy()
        figure6.what_if(problem, state, legs)
        costs = [
            cost(problem, state, leg, before, figure6.observation_times[i], options.miss)
            for i, leg in enumerate(legs)
        ]
        least = next(i for i in range(len(legs)) if no_better(min(costs), costs[i]))
        figure6.take_over(least, options.flags == "copied")
        state = state.after(problem.legs, legs[least], state.seen_at)
    return list(state.order)


def cost(
    problem: Problem, state: SearchState, leg: int, before: Floats, times: Floats, miss: str
) -> tuple[float, float]:
    """What line 28 compares: the first number, then the second."""
    weight, horizon_s = problem.futures.weight, problem.horizon_s
    mean_s = float(weight @ np.minimum(times, horizon_s))
    if miss == "horizon":
        return mean_s, 0.0
    if miss == "infinity":
        seen = np.isfinite(times)
        return float(weight @ ~seen), float(weight[seen] @ times[seen])
    legs = problem.legs
    lasts_s = legs.transit_s(state.x_m, state.y_m)[leg] + legs.duration_s[leg]
    return (mean_s - float(weight @ np.minimum(before, horizon_s))) / float(lasts_s), 0.0


def no_better(least: tuple[float, float], other: tuple[float, float]) -> bool:
    if abs(least[0] - other[0]) > 2e-10 * max(1.0, abs(least[0]) * 1e-1):
        return False
    return other[1] <= least[1] + 1e-6


READINGS = list(
    product(
        ["copied", "times only"],
        ["horizon", "infinity", "rate"],
        ["own", "both", "nearest end"],
        ["removed", "revisited"],
        ["depth", "all found"],
    )
)


@pytest.mark.parametrize("number", range(len(READINGS)))
def test_every_reading_against_the_printed_figures(number: int) -> None:
    flags, miss, direction, roads, ends = READINGS[number]
    options = GreedyOptions(flags=flags, miss=miss, direction=direction, roads=roads, ends=ends)
    for seed in (number, number + 1):
        problem = random_problem(seed, particles=25)
        plan = greedy(problem, budget=Budget(5), rng=RNG, options=options).plan
        assert order_of(plan) == printed_greedy(problem, 5, options), seed


@dataclass(frozen=True)
class Fork:
    """Targets that rest at the ends of two roads, one near and one far."""

    near: float
    far: float
    horizon_s: float

    def problem(self) -> Problem:
        places = {"O": (0.0, 0.0), "near": (10000.0, 0.0), "far": (-50000.0, 0.0)}
        return Problem(
            network=network_of_roads(places, [("On", "O", "near"), ("Of", "O", "far")]),
            futures=Futures(
                [0, 0], [10000, -50000], [0, 0], [0, 1, 2], [self.near, self.far], [0, 0]
            ),
            uav=Uav(0.0, 0.0, 0.0, 100.0),
            sensor=Sensor(1000.0),
            objective=Objective(self.horizon_s),
        )


NEAR_FIRST, FAR_FIRST = [0, 2], [2, 0]


@pytest.mark.parametrize(
    ("miss", "horizon_s", "order"),
    [
        ("horizon", 1000.0, NEAR_FIRST),  # 0.4 (1000 - 90) > 0.6 (1000 - 490)
        ("horizon", 5000.0, FAR_FIRST),  # 0.4 (5000 - 90) < 0.6 (5000 - 490)
        ("infinity", 1000.0, FAR_FIRST),  # 0.4 < 0.6
        ("rate", 5000.0, NEAR_FIRST),  # 0.4 (5000 - 90) / 100 > 0.6 (5000 - 490) / 500
    ],
)
def test_by_hand_what_a_miss_costs(miss: str, horizon_s: float, order: list[int]) -> None:
    problem = Fork(0.4, 0.6, horizon_s).problem()
    options = GreedyOptions(miss=miss)
    assert order_of(greedy(problem, budget=Budget(2), rng=RNG, options=options).plan) == order


def test_by_hand_ends() -> None:
    problem = Fork(1.0, 0.0, 5000.0).problem()
    blind = problem.replace(futures=problem.futures.take([0]))
    short = GreedyOptions(ends="all found")
    assert order_of(greedy(blind, budget=Budget(2), rng=RNG, options=short).plan) == [0]
    assert order_of(greedy(blind, budget=Budget(2), rng=RNG).plan) == [0, 2]
    again = GreedyOptions(roads="revisited")
    assert order_of(greedy(blind, budget=Budget(4), rng=RNG, options=again).plan) == [0, 0, 0, 0]
    assert order_of(greedy(blind, budget=Budget(0), rng=RNG).plan) == []


def test_equal_legs_go_to_the_lowest_index() -> None:
    problem = Fork(0.5, 0.5, 5000.0).problem()
    nobody = problem.replace(futures=problem.futures.take([False, False]))
    assert order_of(greedy(nobody, budget=Budget(2), rng=RNG).plan) == NEAR_FIRST


def test_no_leg_begins_after_the_horizon_or_ends_after_the_landing() -> None:
    problem = Fork(0.5, 0.5, 90.0).problem()
    assert order_of(greedy(problem, budget=Budget(2), rng=RNG).plan) == [0]
    tired = problem.replace(
        objective=Objective(5000.0), uav=replace(problem.uav, max_flight_time_s=699.0)
    )
    assert order_of(greedy(tired, budget=Budget(2), rng=RNG).plan) == [0]
    rested = tired.replace(uav=replace(problem.uav, max_flight_time_s=701.0))
    assert order_of(greedy(rested, budget=Budget(2), rng=RNG).plan) == NEAR_FIRST


def test_transit_counts_only_if_the_sensor_is_on() -> None:
    problem = Fork(0.6, 0.4, 5000.0).problem()
    over_near = problem.replace(uav=Uav(20000.0, 0.0, 0.0, 100.0))
    plans = {
        on: order_of(
            greedy(
                over_near.replace(sensor=Sensor(1000.0, on)),
                budget=Budget(1),
                rng=RNG,
                options=GreedyOptions(direction="both"),
            ).plan
        )
        for on in (True, False)
    }
    # On the way to O it passes the near targets; the far road then shows both.
    assert plans == {True: [2], False: [1]}


def test_particles_drawn_anew_at_every_step() -> None:
    problem = Fork(0.5, 0.5, 5000.0).problem()
    options = GreedyOptions(particles="anew")
    asked: list[int] = []

    def resample(step: int) -> Futures:
        asked.append(step)
        swapped = Fork(0.1, 0.9, 5000.0) if step == 0 else Fork(0.9, 0.1, 5000.0)
        return swapped.problem().futures

    plan = greedy(problem, budget=Budget(2), rng=RNG, options=options, resample=resample).plan
    assert asked == [0, 1]
    assert order_of(plan) == FAR_FIRST
    same = greedy(
        problem, budget=Budget(2), rng=RNG, options=options, resample=lambda _: problem.futures
    ).plan
    assert order_of(same) == order_of(greedy(problem, budget=Budget(2), rng=RNG).plan)


def test_drawing_anew_needs_somebody_who_draws() -> None:
    problem = Fork(0.5, 0.5, 5000.0).problem()
    options = GreedyOptions(particles="anew")
    with pytest.raises(NotApplicableError, match="anew"):
        greedy(problem, budget=Budget(2), rng=RNG, options=options)
    fewer = problem.futures.take([0])
    with pytest.raises(InputError, match="1 particles drawn anew"):
        greedy(problem, budget=Budget(2), rng=RNG, options=options, resample=lambda _: fewer)


@pytest.mark.parametrize("tick_s", [-1.0, np.nan, np.inf])
def test_a_tick_is_a_time(tick_s: float) -> None:
    with pytest.raises(InputError, match="tick_s"):
        GreedyOptions(tick_s=tick_s)


def test_short_ticks_give_the_continuous_plan() -> None:
    problem = grid_problem(grid_futures(60, np.random.default_rng(3), size=3), size=3)
    exact = greedy(problem, budget=Budget(4), rng=RNG).plan
    ticking = greedy(problem, budget=Budget(4), rng=RNG, options=GreedyOptions(tick_s=0.5)).plan
    assert order_of(ticking) == order_of(exact)


@pytest.mark.parametrize(
    ("distance_km", "expected_s", "tolerance_s"),
    [(0, 230, 10), (120, 3000, 250), (700, 8185, 40)],
)
def test_the_paper_grid_in_the_mean(
    distance_km: float, expected_s: float, tolerance_s: float
) -> None:
    fresh = grid_futures(4000, np.random.default_rng(100))
    means = []
    for seed in range(5):
        futures = grid_futures(1000, np.random.default_rng(seed))
        problem = grid_problem(futures, distance_m=distance_km * 1000)
        plan = greedy(problem, budget=Budget(16), rng=RNG).plan
        result = evaluate(plan.tracks, fresh, problem.sensor, problem.objective)
        means.append(result.expected_detection_time_s)
    assert np.mean(means) == pytest.approx(expected_s, abs=tolerance_s)


@pytest.mark.parametrize("seed", range(12))
def test_ties_go_to_the_lowest_index_or_to_the_earliest_end(seed: int) -> None:
    problem = random_problem(seed)
    engine, start = WhatIf(problem), problem.first_state
    flights = engine.fly(start, candidate_legs(problem, start, directions="both"))
    weight = problem.futures.weight[flights.particle]
    gained = flights.per_flight(weight * problem.objective.reward(flights.seen_at))
    tied = np.flatnonzero(gained >= gained.max() * (1 - 1e-9))
    first = {
        ties: greedy(
            problem,
            budget=Budget(1),
            rng=RNG,
            options=GreedyOptions(direction="both", ties=ties),
        ).plan.legs[0][0]
        for ties in ("lowest index", "earliest end")
    }
    assert first["lowest index"].leg == flights.leg[tied[0]]
    assert first["earliest end"].end_s == pytest.approx(flights.end_s[tied].min())
