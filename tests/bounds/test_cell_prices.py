"""No flight whatever is worth more than any prices over cells allow."""

from itertools import product

import numpy as np
import pytest

from planner.arrays import Floats
from planner.bounds.any_flight import most_of_any_flight
from planner.bounds.cell_prices import CellTable, cell_table
from planner.bounds.group_hunts import GroupHunts
from planner.bounds.kernels.cell_prices import (
    ENDS,
    Contacts,
    Lattice,
    Place,
    best_flight,
    may_see,
)
from planner.bounds.subgradient import lowest
from planner.detection.objective import Objective
from planner.search.anneal_waypoints import anneal_waypoints
from planner.search.problem import Budget, Problem
from planner.streams import stream
from support.any_flights import earliest, random_flight, reward_of, toy, toy_flights
from support.grid_instance import grid_futures, grid_problem
from support.search_instances import random_problem

SIDE, TICKS = 4, 4  # of the toy for enumeration: cells along a side, ticks


def table_of(problem: Problem) -> CellTable:
    return cell_table(problem, earliest(problem))


def alone_of(problem: Problem) -> Floats:
    return problem.objective.reward(earliest(problem))


def some_prices(problem: Problem, rng: np.random.Generator) -> list[Floats]:
    alone = alone_of(problem)
    return [0.0 * alone, 0.9 * alone, alone * rng.random(len(alone)), rng.random(len(alone))]


def contacts_by_chance(rng: np.random.Generator, particles: int) -> Contacts:
    """Particles that wander about the toy's cells of 1 m, at times gone."""
    xy_m = rng.uniform(0, SIDE, (2, particles, 1)) + rng.normal(0, 0.5, (2, particles, TICKS))
    reach_m = np.where(rng.random((particles, TICKS)) < 0.8, rng.uniform(0.2, 1.5), -1.0)
    reward = np.sort(rng.random((particles, TICKS)))[:, ::-1].copy()
    return Contacts(xy_m[0], xy_m[1], reach_m, reward)


def all_flights(first_tick: Floats) -> list[list[tuple[int, int, int]]]:
    """Every flight over the toy's cells, from the first tick in which a cell may be reached."""
    cells = list(product(range(SIDE), repeat=2))
    flights = [[(int(first_tick[cell]), *cell)] for cell in cells if first_tick[cell] < TICKS]
    found = list(flights)
    for _ in range(TICKS - 1):
        flights = [
            [*flight, (flight[-1][0] + 1, x, y)]
            for flight in flights
            for x, y in cells
            if max(abs(x - flight[-1][1]), abs(y - flight[-1][2])) <= 1
            and first_tick[x, y] <= flight[-1][0] + 1 < TICKS
        ]
        found += flights
    return found


@pytest.mark.parametrize("seed", range(4))
def test_the_best_flight_on_a_toy_is_that_of_enumeration(seed: int) -> None:
    rng, particles = np.random.default_rng(seed), 5
    contacts = contacts_by_chance(rng, particles)
    first_tick = rng.integers(0, 3, (SIDE, SIDE))
    first_tick[rng.integers(SIDE), rng.integers(SIDE)] = TICKS + 3
    prices = 0.6 * rng.random(particles)
    sees = {
        (i, x, y, k): may_see(contacts, k, 1.0, Place(i, x, y))
        for i, x, y in product(range(TICKS), range(SIDE), range(SIDE))
        for k in range(particles)
    }
    gain = np.maximum(0.0, contacts.reward - prices[:, None])

    def sold(flight: list[tuple[int, int, int]]) -> Floats:
        """What a flight earns with each particle above its price, tick by tick."""
        earned = np.zeros((particles, TICKS))
        for n, at in enumerate(flight):
            for k in range(particles):
                if sees[*at, k] and not (n > 0 and sees[*flight[n - 1], k]):
                    earned[k, at[0]] = gain[k, at[0]]
        return earned

    most = max((sold(flight) for flight in all_flights(first_tick)), key=np.sum)
    steps, counts = np.zeros((TICKS, SIDE, SIDE), dtype=np.int8), np.zeros(particles)
    found = best_flight(contacts, Lattice(1.0, first_tick), prices, steps, counts)
    assert found == pytest.approx(most.sum())
    np.testing.assert_array_equal(counts, np.count_nonzero(most, axis=1))
    assert np.all(steps[-1] == ENDS)


@pytest.mark.parametrize("by_s", [None, 35.0])
@pytest.mark.parametrize("radius_m", [50.0, 400.0])
@pytest.mark.parametrize("seed", range(3))
def test_all_flights_on_a_toy_earn_no_more(seed: int, radius_m: float, by_s: float | None) -> None:
    problem, rng = toy(seed, radius_m=radius_m, by_s=by_s), np.random.default_rng(seed)
    most = max(reward_of(problem, *flight) for flight in toy_flights(problem))
    table = table_of(problem)
    for prices in some_prices(problem, rng):
        assert most <= table.bound(prices).reward + 1e-9
    least, _ = lowest(table, 0.9 * alone_of(problem), most, steps=60, stop=lambda _: False)
    assert most <= least + 1e-9


@pytest.mark.parametrize("seed", range(24))
def test_random_flights_earn_no_more(seed: int) -> None:
    """Also where particles jump, come late, vanish, or are faster than the UAV."""
    problem, rng = random_problem(seed, particles=20), np.random.default_rng(seed)
    problem = problem.replace(objective=Objective(1200.0, 600.0 if seed % 5 == 0 else None))
    table = table_of(problem)
    bounds = [table.bound(prices).reward for prices in some_prices(problem, rng)]
    most = max(reward_of(problem, *random_flight(problem, rng)) for _ in range(300))
    assert most <= min(bounds) + 1e-9


def test_annealed_flights_earn_no_more_and_the_better_bound_counts() -> None:
    problem = grid_problem(grid_futures(60, np.random.default_rng(3)), distance_m=300_000.0)
    found = anneal_waypoints(problem, budget=Budget(work=200_000), rng=stream(1, "test"))
    track, earliest_s = found.plan.tracks[0], earliest(problem)
    reward = reward_of(problem, track.time_s, track.x_m, track.y_m)
    heard: list[float] = []

    def stop(least: float) -> bool:
        heard.append(least)
        return False

    bound = most_of_any_flight(problem, earliest_s, alone_of(problem), stop)
    assert reward <= bound == min(heard)
    assert bound <= GroupHunts(problem, earliest_s).most(lambda _: False)
    assert bound < float(problem.futures.weight @ alone_of(problem))


@pytest.mark.parametrize("seed", range(6))
def test_counts_are_a_slope(seed: int) -> None:
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    table, most = table_of(problem), problem.objective.most
    for _ in range(10):
        here, there = rng.uniform(0.3 * most, most, (2, len(problem.futures)))
        bound, counts = table.bound(here)
        change = (table.weight * (1.0 - counts)) @ (there - here)
        assert table.bound(there).reward >= bound + change - 1e-7 * most


@pytest.mark.parametrize("seed", range(6))
def test_prices_of_the_earliest_sightings_are_the_bound_of_physics(seed: int) -> None:
    problem = random_problem(seed)
    alone = alone_of(problem)
    physics = float(problem.futures.weight @ alone)
    assert table_of(problem).bound(alone).reward == pytest.approx(physics)
