"""Bounds for fleets against all pairs of orders, planned fleets, and UAVs that add nothing."""

from dataclasses import replace

import numpy as np
import pytest

from planner.bounds.certificate import Effort, certified
from planner.bounds.fleet_prices import FleetTable
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.search.fleet import fleet
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.rate import rate
from planner.streams import stream
from support.instances import figure3, physics_futures
from support.search_instances import most_together

PATHS = [["AB", "BC", "CE"], ["AB", "BC", "CF"], ["AB", "BD", "DF"], ["AB", "BD", "DG"]]


def on_figure3(seed: int = 0) -> Problem:
    rng = np.random.default_rng(seed)
    futures = physics_futures(figure3(), PATHS * 5, 0.0, rng.uniform(8, 40, 20), horizon_s=500.0)
    uav = Uav(x_m=-3_000.0, y_m=0.0, take_off_s=60.0, speed_mps=100.0)
    return Problem(figure3(), futures, uav, Sensor(300.0), Objective(430.0))


def joined(first: Problem, other: Uav) -> Problem:
    """Return the problem of two UAVs."""
    return first.replace(others=(replace(other, altitude_m=15.0),))


def bound_of(problem: Problem, plan: Plan) -> float:
    return certified(problem, plan, Effort()).bound


@pytest.mark.parametrize("same", [True, False])
def test_no_pair_of_orders_is_below_the_bound(same: bool) -> None:
    first = on_figure3()
    other = first.uav if same else replace(first.uav, x_m=16_000.0, speed_mps=80.0)
    both = joined(first, other)
    best_s = first.horizon_s - most_together((first, first.replace(uav=other)))
    plan = plan_of_legs(first, "one", [0])
    two = Plan("two", plan.tracks * 2, plan.legs * 2)
    bound_s = bound_of(both, two)
    assert bound_s <= best_s + 1e-6
    assert bound_s >= 0.8 * best_s  # and it is worth knowing
    assert bound_s < bound_of(first, plan) + 1e-6  # two are never worse off than one


@pytest.mark.parametrize("seed", range(3))
def test_random_fleets_are_not_better_than_their_bounds(seed: int) -> None:
    rng, first = np.random.default_rng(seed), on_figure3(seed)
    other = replace(
        first.uav, x_m=float(rng.uniform(-3e3, 2e4)), take_off_s=float(rng.uniform(0, 99))
    )
    both, second = joined(first, other), first.replace(uav=replace(other, altitude_m=15.0))
    made = fleet((first, second), rate, budget=Budget(), rng=stream(seed, "fleet"), together=False)
    certificate = certified(both, made.plan, Effort())
    assert certificate.bound <= certificate.value + 1e-6


@pytest.mark.parametrize("other", [{"take_off_s": 999.0}, {"sorties": 0}])
def test_who_takes_off_after_the_horizon_or_never_changes_no_bound(other: dict[str, float]) -> None:
    first = on_figure3()
    two = joined(first, replace(first.uav, **other))
    alone, both = (FleetTable.of(one, 5.0) for one in (first, two))
    prices = np.full(len(first.futures), 100.0)
    assert both.bound(prices).reward == alone.bound(prices).reward


def test_who_flies_no_more_is_left_out_of_certificates() -> None:
    first = on_figure3()
    plan = plan_of_legs(first, "one", [0])
    free = Plan("free", plan.tracks, ((),))
    near = replace(first.uav, x_m=2_000.0, speed_mps=200.0)
    for own in (plan, free):
        late, never, flies = (
            bound_of(joined(first, replace(near, **other)), own)
            for other in ({"take_off_s": 999.0}, {"sorties": 0}, {})
        )
        assert never == late > flies


def test_where_nobody_flies_nothing_is_found() -> None:
    grounded = on_figure3().replace(uav=replace(on_figure3().uav, sorties=0))
    both = joined(grounded, grounded.uav)
    prices = np.full(len(both.futures), 100.0)
    bounded = FleetTable.of(both, 5.0).bound(prices)
    assert bounded.reward == pytest.approx(100.0 * both.futures.weight.sum())
    nothing = Plan("none", (), ())
    assert bound_of(both, nothing) == bound_of(grounded, nothing) == 430.0


def test_flights_with_a_fresh_battery_have_no_bound_yet() -> None:
    first = on_figure3()
    again = replace(first.uav, sorties=2, max_flight_time_s=99.0, swap_s=9.0)
    with pytest.raises(NotApplicableError, match="more than once"):
        certified(first.replace(uav=again), plan_of_legs(first, "one", [0]), Effort())
