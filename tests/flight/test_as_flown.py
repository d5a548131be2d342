"""A real aircraft is where its track says, and always home before it is empty."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.flight.as_flown import OFF_M, Battery, as_flown, home_in_time, track_points
from planner.flight.drawn_line import needed
from planner.flight.law import FlightLaw, timed
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.search.plan import plan_of_legs
from support.search_instances import random_problem

PLACES = st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, 20)), min_size=2, max_size=12)
LAWS = st.builds(
    FlightLaw,
    st.floats(5, 25),
    acceleration_mps2=st.floats(0.5, 5) | st.just(math.inf),
    corner_m=st.floats(0.5, 10),
    climb_mps=st.floats(1, 10),
    descend_mps=st.floats(1, 10),
    altitude_m=st.floats(0, 120),
    wind_mps=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
)


def apart(places: list[tuple[int, int]]) -> np.ndarray:
    """Places 100 m apart, each other than the one before."""
    kept = [places[0]]
    kept += [b for a, b in itertools.pairwise(places) if a != b]
    return 100.0 * np.array(kept, dtype=np.float64)


@settings(max_examples=60, deadline=None)
@given(PLACES, LAWS, st.floats(60, 1500), st.floats(0, 100), st.floats(0, 4.5))
def test_it_is_home_in_time_from_wherever_it_is(
    places: list[tuple[int, int]], law: FlightLaw, lasts_s: float, reserve_s: float, wind: float
) -> None:
    xy_m = apart(places)
    assume(len(xy_m) > 1)
    headwind_mps = max(wind, math.hypot(*law.wind_mps))
    battery = Battery(lasts_s, reserve_s, (float(xy_m[0, 0]), float(xy_m[0, 1])), headwind_mps)
    assume(law.climb_s + law.descend_s + reserve_s < lasts_s)
    hold_s = np.where(np.arange(len(xy_m)) % 3 == 1, 20.0, 0.0)
    line, holds = home_in_time(xy_m, hold_s, law, battery)
    if len(line) == 1:
        return  # nothing could be flown
    flight = timed(line, holds, law)
    after_s, where = track_points(line, flight, law)
    used_s = law.climb_s + after_s
    on_the_ground_s = float(used_s[-1]) + law.descend_s
    assert on_the_ground_s + reserve_s <= lasts_s + 1e-6
    out = after_s <= flight.leaves_s[-2]
    still_s = battery.home_s(where[out], law) - 1.5 * law.speed_mps / law.acceleration_mps2
    assert np.all(used_s[out] + still_s + reserve_s <= lasts_s + 1e-6)


@settings(max_examples=40, deadline=None)
@given(PLACES, LAWS)
def test_the_track_is_where_even_acceleration_takes_it(
    places: list[tuple[int, int]], law: FlightLaw
) -> None:
    """A quarter of a metre at most from the motion in fine steps, and never too fast."""
    xy_m = apart(places)
    assume(len(xy_m) > 1)
    hold_s = np.where(np.arange(len(xy_m)) % 2 == 1, 3.0, 0.0)
    flight = timed(xy_m, hold_s, law)
    after_s, where = track_points(xy_m, flight, law)
    assert np.all(np.diff(after_s) > 0)
    assert after_s[-1] == pytest.approx(flight.leaves_s[-1])
    speed = np.hypot(*np.diff(where, axis=0).T) / np.diff(after_s)
    assert speed.max() <= law.speed_mps + math.hypot(*law.wind_mps) + 1e-6
    if math.isinf(law.acceleration_mps2):
        return
    for leg in range(len(xy_m) - 1):
        moved = xy_m[leg + 1] - xy_m[leg]
        first, last, cruise = *flight.passes_mps[leg : leg + 2], flight.cruises_mps[leg]
        fine_s = np.linspace(0.0, flight.arrives_s[leg + 1] - flight.leaves_s[leg], 4001)
        speeds = np.minimum(
            np.minimum(first + law.acceleration_mps2 * fine_s, cruise),
            last + law.acceleration_mps2 * (fine_s[-1] - fine_s),
        )
        along_m = np.concatenate(
            ([0.0], np.cumsum((speeds[1:] + speeds[:-1]) / 2 * np.diff(fine_s)))
        )
        length_m = math.hypot(*moved)
        assert along_m[-1] == pytest.approx(length_m, rel=1e-3)
        here = [np.interp(flight.leaves_s[leg] + fine_s, after_s, column) for column in where.T]
        ahead_m = np.stack(here, axis=1) @ (moved / length_m) - xy_m[leg] @ (moved / length_m)
        assert np.abs(ahead_m - along_m).max() <= OFF_M + 2e-3 * length_m


def test_a_flight_that_is_short_enough_stays_as_it_is() -> None:
    xy_m, law = np.array([[0.0, 0.0], [300.0, 0.0]]), FlightLaw(10.0, 2.0, 2.0)
    line, holds = home_in_time(xy_m, np.zeros(2), law, Battery())
    assert np.array_equal(line, xy_m)
    assert holds.tolist() == [0.0, 0.0]


def test_it_turns_where_the_way_home_gets_too_long() -> None:
    """10 m/s for 100 s: out to 500 m and back, for the ideal aircraft."""
    xy_m, law = np.array([[0.0, 0.0], [5000.0, 0.0]]), FlightLaw(10.0)
    line, _ = home_in_time(xy_m, np.zeros(2), law, Battery(100.0, home_m=(0.0, 0.0)))
    assert line == pytest.approx(np.array([[0.0, 0.0], [500.0, 0.0], [0.0, 0.0]]))
    against = Battery(100.0, home_m=(0.0, 0.0), headwind_mps=5.0)
    line, _ = home_in_time(xy_m, np.zeros(2), law, against)
    assert line[1, 0] == pytest.approx(1000.0 / 3.0)  # d / 10 + d / 5 = 100


def test_it_leaves_off_hovering_in_time() -> None:
    xy_m, law = np.array([[0.0, 0.0], [100.0, 0.0], [200.0, 0.0]]), FlightLaw(10.0)
    battery = Battery(100.0, reserve_s=20.0, home_m=(0.0, 0.0))
    line, holds = home_in_time(xy_m, np.array([0.0, 500.0, 0.0]), law, battery)
    assert line.tolist() == [[0.0, 0.0], [100.0, 0.0], [0.0, 0.0]]
    assert holds.tolist() == pytest.approx([0.0, 60.0, 0.0])


@pytest.mark.parametrize("seed", range(6))
def test_the_ideal_aircraft_flies_the_plan_as_it_is(seed: int) -> None:
    problem = random_problem(seed)
    plan = plan_of_legs(problem, "any", [0, 5, 3, 3, 2])
    speed = problem.uav.speed_mps
    flown = as_flown(plan, FlightLaw(speed), Battery())
    (track,), (legs,) = flown.tracks, flown.legs
    (planned,) = plan.tracks
    for column in ("time_s", "x_m", "y_m"):
        assert getattr(track, column) == pytest.approx(getattr(planned, column))
    assert [leg.leg for leg in legs] == [leg.leg for leg in plan.legs[0]]
    assert [leg.end_s for leg in legs] == pytest.approx([leg.end_s for leg in plan.legs[0]])


@pytest.mark.parametrize("seed", range(6))
def test_a_real_one_is_on_its_roads_when_it_says_so_and_home_in_time(seed: int) -> None:
    problem = random_problem(seed)
    plan = plan_of_legs(problem, "any", [0, 5, 3, 3, 2])
    speed, uav = problem.uav.speed_mps, problem.uav
    law = FlightLaw(speed, 1.4, 2.0, climb_mps=2.5, descend_mps=1.5, altitude_m=100.0)
    lasts_s = 0.7 * (plan.end_s - plan.take_off_s) + 300.0
    battery = Battery(lasts_s, 60.0, (uav.x_m, uav.y_m), 5.0)
    flown = as_flown(plan, law, battery)
    (track,), (legs,) = flown.tracks, flown.legs
    assert track.time_s[-1] - track.time_s[0] <= lasts_s - 60.0 + 1e-6
    assert (track.x_m[-1], track.y_m[-1]) == (uav.x_m, uav.y_m)
    assert track.time_s[0] == uav.take_off_s - 40.0
    if problem.sensor.detects_in_transit:
        assert track.sensor_on[0].tolist() == [uav.take_off_s, track.time_s[-1] - law.descend_s]
    assert len(legs) < 5
    for leg, planned in zip(legs, plan.legs[0], strict=False):
        for flown_s, planned_s in zip(
            (leg.start_s, leg.end_s), (planned.start_s, planned.end_s), strict=True
        ):
            assert flown_s > planned_s
            here = plan.tracks[0].xy(planned_s)
            assert track.xy(flown_s) == pytest.approx(here, abs=0.02)


def test_where_it_stays_it_hovers_as_long_as_planned() -> None:
    track = Track([0.0, 10.0, 40.0, 50.0], [0.0, 100.0, 100.0, 200.0], [0.0] * 4, [[0.0, 50.0]])
    flown = as_flown(Plan("x", (track,), ((),)), FlightLaw(20.0), Battery())
    assert flown.tracks[0].time_s.tolist() == [0.0, 5.0, 35.0, 40.0]


@settings(max_examples=40, deadline=None)
@given(PLACES, st.floats(1, 300))
def test_what_is_left_out_of_a_line_is_passed_closely(
    places: list[tuple[int, int]], off_m: float
) -> None:
    xy_m = apart(places)
    stay = np.arange(len(xy_m)) % 4 == 2
    kept = needed(xy_m, stay, off_m)
    assert kept[0] == 0
    assert kept[-1] == len(xy_m) - 1
    assert set(np.flatnonzero(stay)) <= set(kept.tolist())
    for a, b in itertools.pairwise(kept.tolist()):
        way = np.linspace(xy_m[a], xy_m[b], 500)
        for place in xy_m[a : b + 1]:
            assert np.hypot(*(way - place).T).min() <= off_m + 5.0


def test_a_curve_drawn_finely_is_not_flown_at_full_speed() -> None:
    """A circle of 10 m in 200 pieces: at each it turns little, and round it 5 m/s are fast."""
    angle = np.linspace(0.0, 2.0 * math.pi, 201)
    x_m, y_m = 10.0 * np.cos(angle), 10.0 * np.sin(angle)
    times_s = np.linspace(0.0, 2.0 * math.pi * 10.0 / 15.0, 201)
    track = Track(times_s, x_m, y_m, [[0.0, times_s[-1]]])
    flown = as_flown(Plan("x", (track,), ((),)), FlightLaw(15.0, 1.5, 2.0), Battery()).tracks[0]
    fastest = np.hypot(np.diff(flown.x_m), np.diff(flown.y_m)) / np.diff(flown.time_s)
    assert fastest.max() < 7.0


@pytest.mark.parametrize("seed", range(3))
def test_a_sensor_that_looks_along_roads_is_on_there_alone(seed: int) -> None:
    problem = random_problem(seed)
    sensor = replace(problem.sensor, detects_in_transit=False)
    plan = plan_of_legs(problem.replace(sensor=sensor), "any", [0, 5, 3, 2])
    flown = as_flown(plan, FlightLaw(problem.uav.speed_mps, 2.0, 2.0), Battery())
    (track,), (legs,) = flown.tracks, flown.legs
    on_s = [(leg.start_s, leg.end_s) for leg in legs]
    for from_s, to_s in track.sensor_on.tolist():
        assert any(from_s == pytest.approx(start_s) for start_s, _ in on_s)
        assert any(to_s == pytest.approx(end_s) for _, end_s in on_s)
    assert sum(np.diff(track.sensor_on)[:, 0]) == pytest.approx(sum(b - a for a, b in on_s))
