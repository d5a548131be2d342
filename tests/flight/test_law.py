"""How long an aircraft takes: physics by hand, a slow twin, and an autopilot's own flights."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.arrays import Floats
from planner.errors import InputError
from planner.flight.law import FlightLaw, timed
from support.recorded_flights import mission, reached_s

FITTED = {"acceleration_mps2": 1.4, "corner_m": 2.0}  # to the flight at 15 m/s alone


def line(*places: tuple[float, float]) -> Floats:
    return np.array(places, dtype=np.float64)


def duration_s(xy_m: Floats, law: FlightLaw, *, hold_s: Floats | None = None) -> float:
    return float(timed(xy_m, np.zeros(len(xy_m)) if hold_s is None else hold_s, law).arrives_s[-1])


def test_one_leg_is_a_trapezoid() -> None:
    """10 m/s at 2 m/s2: 5 s and 25 m to get there and again to stop; 150 m remain."""
    law = FlightLaw(10.0, 2.0, 2.0)
    assert duration_s(line((0, 0), (0, 200)), law) == pytest.approx(5 + 15 + 5)
    assert duration_s(line((0, 0), (18, 0)), law) == pytest.approx(2 * 3.0)  # a triangle


def test_straight_on_is_no_corner_and_straight_back_is_a_stop() -> None:
    law = FlightLaw(10.0, 2.0, 2.0)
    through = timed(line((0, 0), (100, 0), (200, 0)), np.zeros(3), law)
    assert through.passes_mps.tolist() == [0.0, 10.0, 0.0]
    assert through.arrives_s[-1] == pytest.approx(25.0)
    back = timed(line((0, 0), (100, 0), (0, 0)), np.zeros(3), law)
    assert back.passes_mps[1] == 0.0
    assert back.arrives_s[-1] == pytest.approx(2 * (5 + 5 + 5))


def test_a_square_corner_is_flown_on_the_arc_that_passes_near_it() -> None:
    """Radius r with r / sin(45 deg) - r = corner_m, and v^2 / r = a."""
    law = FlightLaw(30.0, 2.0, 3.0)
    radius_m = 3.0 / (1 / math.sin(math.pi / 4) - 1)
    flown = timed(line((0, 0), (500, 0), (500, 500)), np.zeros(3), law)
    assert flown.passes_mps[1] == pytest.approx(math.sqrt(2.0 * radius_m))


def test_hovering_stops_it_and_takes_its_time() -> None:
    law, hold_s = FlightLaw(10.0, 2.0, 2.0), np.array([0.0, 7.0, 0.0])
    flown = timed(line((0, 0), (100, 0), (200, 0)), hold_s, law)
    assert flown.arrives_s.tolist() == pytest.approx([0.0, 15.0, 37.0])
    assert flown.leaves_s[1] == pytest.approx(22.0)


def test_the_ideal_aircraft_flies_at_its_speed_and_is_up_at_once() -> None:
    law, xy_m = FlightLaw(25.0), line((0, 0), (300, 400), (0, 0))
    assert duration_s(xy_m, law) == 40.0
    assert law.climb_s == law.descend_s == 0.0
    assert FlightLaw(5.0, climb_mps=2.5, descend_mps=2.0, altitude_m=100.0).climb_s == 40.0


def test_wind_helps_one_way_and_more_than_that_hinders_the_other() -> None:
    law = FlightLaw(10.0, wind_mps=(6.0, 0.0))
    assert law.ground_speed_mps(1.0, 0.0) == 16.0
    assert law.ground_speed_mps(-1.0, 0.0) == 4.0
    assert law.ground_speed_mps(0.0, 1.0) == pytest.approx(8.0)  # 6, 8, 10
    assert duration_s(line((0, 0), (160, 0), (0, 0)), law) == pytest.approx(10 + 40)
    assert math.isinf(duration_s(line((0, 0), (0, 9)), FlightLaw(5.0, wind_mps=(6.0, 0.0))))


@pytest.mark.parametrize("name", ["acceleration_mps2", "corner_m", "climb_mps", "speed_mps"])
def test_rates_of_nothing_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=name):
        FlightLaw(**{"speed_mps": 5.0, name: 0.0})


def stepped(xy_m: Floats, law: FlightLaw, step_s: float) -> float:
    """Fly the line in small steps: at each, as fast as lets it slow down for all that comes."""
    steps = np.diff(xy_m, axis=0)
    length_m = np.hypot(*steps.T)
    unit = steps / length_m[:, None]
    ends_m = np.cumsum(length_m)
    limits = [law.corner_speed_mps(float(a @ b)) for a, b in itertools.pairwise(unit)] + [0.0]
    along_m, speed, clock_s = 0.0, 0.0, 0.0
    while ends_m[-1] - along_m > 1e-3 and clock_s < 1e4:
        ahead = ends_m > along_m + 1e-9
        most = np.sqrt(
            np.square(np.array(limits)[ahead])
            + 2 * law.acceleration_mps2 * (ends_m[ahead] - along_m)
        )
        speed = min(speed + law.acceleration_mps2 * step_s, law.speed_mps, float(most.min()))
        along_m += max(speed, 1e-3) * step_s
        clock_s += step_s
    return clock_s


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=2, max_size=6),
    st.floats(3, 20),
    st.floats(0.7, 4),
    st.floats(0.5, 5),
)
def test_small_steps_come_to_the_same(
    places: list[tuple[int, int]], speed: float, rate: float, corner: float
) -> None:
    apart = [places[0], *(b for a, b in itertools.pairwise(places) if a != b)]
    if len(apart) < 2:
        return
    xy_m, law = 40.0 * line(*apart), FlightLaw(speed, rate, corner)
    assert stepped(xy_m, law, 0.01) == pytest.approx(duration_s(xy_m, law), rel=0.02, abs=0.7)


def test_it_is_fitted_to_one_recorded_flight() -> None:
    flown = mission()
    took_s = flown.reached_s - flown.reached_s[0]
    law_s = timed(flown.xy_m, np.zeros(len(flown.xy_m)), FlightLaw(15.0, **FITTED)).arrives_s
    assert law_s[-1] == pytest.approx(took_s[-1], rel=0.015)
    assert np.abs(law_s - took_s).max() < 21.0


def test_it_predicts_the_other_recorded_flight() -> None:
    """Nothing is changed but the speed: 5 % in all, each waypoint within 5 % or 20 s."""
    xy_m = mission().xy_m
    at_s = reached_s("sitl_10", xy_m)
    took_s = at_s - at_s[0]
    law_s = timed(xy_m, np.zeros(len(xy_m)), FlightLaw(10.0, **FITTED)).arrives_s
    assert law_s[-1] == pytest.approx(took_s[-1], rel=0.05)
    assert np.all(np.abs(law_s - took_s) <= np.maximum(0.05 * took_s, 20.0))


def test_the_ideal_aircraft_is_far_from_either() -> None:
    flown = mission()
    law_s = timed(flown.xy_m, np.zeros(len(flown.xy_m)), FlightLaw(15.0)).arrives_s
    assert law_s[-1] < 0.75 * np.ptp(flown.reached_s)
