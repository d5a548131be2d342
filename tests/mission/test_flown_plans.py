"""What a scenario says of its aircraft, and what is refused."""

import numpy as np
import pytest

from planner.errors import ScenarioError
from planner.mission.opening import open_scenario
from planner.mission.planning import problem_of
from support.grid_instance import grid_futures

REAL = (
    "uav.acceleration_mps2=1.4",
    "uav.corner_m=2",
    "uav.climb_mps=2.5",
    "uav.max_flight_time_s=1500",
)


def test_a_scenario_makes_the_aircraft() -> None:
    opened = open_scenario("grid5x5", overrides=[*REAL, "uav.wind={speed_mps=4,from_deg=270}"])
    uav = problem_of(opened, grid_futures(3, np.random.default_rng(1))).uav
    assert uav.aircraft is not None
    assert uav.aircraft.law.wind_mps == pytest.approx((4.0, 0.0))
    assert (uav.aircraft.reserve_s, uav.aircraft.headwind_mps) == (300.0, 4.0)
    calm = open_scenario("grid5x5", overrides=REAL)
    uav = problem_of(calm, grid_futures(3, np.random.default_rng(1))).uav
    assert uav.aircraft is not None
    assert (uav.aircraft.law.wind_mps, uav.aircraft.headwind_mps) == ((0.0, 0.0), 5.0)
    ideal = problem_of(open_scenario("grid5x5"), grid_futures(3, np.random.default_rng(1))).uav
    assert ideal.aircraft is None


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("uav.acceleration_mps2=1.4", "uav.corner_m"),
        ("uav.corner_m=2", "uav.acceleration_mps2"),
        ("uav.acceleration_mps2=0", "uav.acceleration_mps2"),
        ("uav.wind={speed_mps=200,from_deg=0}", "wait for less wind"),
        ("uav.reserve_s=60", "uav.max_flight_time_s"),
    ],
)
def test_what_an_aircraft_cannot_do_is_refused(override: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        open_scenario("grid5x5", overrides=[override])


def test_a_battery_that_is_empty_at_height_is_refused() -> None:
    overrides = ["uav.climb_mps=1", "uav.max_flight_time_s=150", "uav.altitude_m=150"]
    with pytest.raises(ScenarioError, match="leaves no time to search"):
        open_scenario("grid5x5", overrides=overrides)
