"""Nobody knows where in their cycle the signals are when a target sets out."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.belief.particles import Particles
from planner.belief.sampling import SETTLED_S, sample
from planner.detection.evaluate import evaluate
from planner.futures.record import record
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.planning import make_plan, problem_of
from planner.mission.recorder import Recorder
from planner.network.signals import signal_cycle_s
from planner.search.methods import method_named
from planner.streams import stream
from support import towns

HORIZON_S = 900.0


def drawn(opened: OpenScenario, name: str, count: int) -> Particles:
    return sample(opened.prior, opened.network, count, stream(1, name), horizon_s=HORIZON_S)


def test_phases_fill_the_cycle_and_shift_nothing_else(berlin: OpenScenario) -> None:
    particles = drawn(berlin, "phases", 4000)
    cycle_s = signal_cycle_s(berlin.network)
    since_s = particles.phase_s - SETTLED_S
    assert since_s.min() >= 0
    assert since_s.max() < cycle_s
    counts, _ = np.histogram(since_s, bins=8, range=(0, cycle_s))
    assert np.all(abs(counts - 500) < 5 * np.sqrt(500))
    known = sample(
        replace(berlin.prior, signals_known=True),
        berlin.network,
        4000,
        stream(1, "phases"),
        horizon_s=HORIZON_S,
    )
    assert not known.phase_s.any()
    for column in ("start_m", "route_edge", "speed_mps", "seed"):
        np.testing.assert_array_equal(getattr(known, column), getattr(particles, column))


def test_the_scenario_says_whether_signals_are_known() -> None:
    assert not open_scenario("berlin").prior.signals_known
    known = open_scenario("berlin", overrides=['target.signals="known"'])
    assert known.prior.signals_known
    assert known.truth_prior.signals_known


@pytest.mark.parametrize(
    "town_of",
    [
        pytest.param(lambda _: towns.berlin(), id="berlin", marks=pytest.mark.slow),
        pytest.param(towns.luxembourg, id="luxembourg", marks=pytest.mark.long),
    ],
)
def test_a_plan_is_worth_as_much_at_other_phases(
    town_of: Callable[[Path], OpenScenario], tmp_path: Path
) -> None:
    """Fresh targets of another stream of phases are found as soon, within the interval."""
    town = town_of(tmp_path)
    opened = open_scenario(
        town.scenario.path,
        overrides=[f"search.horizon_s={HORIZON_S}", "uav.aircraft=ideal", "uav.speed_mps=25"],
    )
    planning = record(opened.network, drawn(opened, "planning", 200), horizon_s=HORIZON_S)
    method = method_named("rate")
    plan = make_plan(method, opened, Recorder(opened), planning).plan
    problem = problem_of(opened, planning, method=method)
    fresh = drawn(opened, "fresh", 200)
    cycle_s = signal_cycle_s(opened.network)
    moved = SETTLED_S + stream(2, "other phases").integers(0, cycle_s, len(fresh))
    worth = []
    for particles in (fresh, replace(fresh, phase_s=moved)):
        futures = record(opened.network, particles, horizon_s=HORIZON_S)
        worth.append(evaluate(plan.tracks, futures, problem.sensor, problem.objective))
    low_s, high_s = worth[0].ci95_s
    assert low_s <= worth[1].expected_detection_time_s <= high_s
