"""An aircraft that cannot hover never stops, never turns too tightly, and is home in time."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flight.test_as_flown import PLACES, apart
from planner.arrays import Floats
from planner.errors import InputError
from planner.flight.as_flown import Battery, as_flown, home_in_time, track_points
from planner.flight.law import FlightLaw, timed
from planner.flight.track import Track
from planner.flight.turning import LONGEST_TURN, STEP, merged, turned
from planner.search.plan import plan_of_legs, plan_of_wait
from support.search_instances import random_problem

WINGS = st.builds(
    FlightLaw,
    st.floats(12, 25),
    min_speed_mps=st.floats(8, 12),
    acceleration_mps2=st.floats(2, 10),
    corner_m=st.floats(5, 40),
    climb_mps=st.floats(1, 10),
    descend_mps=st.floats(1, 10),
    altitude_m=st.floats(0, 120),
    wind_mps=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
)
WING = FlightLaw(14.0, 5.0, 20.0, min_speed_mps=12.0)


def turns(xy_m: Floats) -> Floats:
    steps = np.diff(xy_m, axis=0)
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    return np.asarray(np.angle(np.exp(1j * np.diff(heading))))


def refuse(xy_m: Floats, law: FlightLaw) -> None:
    """Fail where a corner is too tight: an arc of the least radius has no room, or is too far."""
    length_m = np.hypot(*np.diff(xy_m, axis=0).T)
    assert np.all(length_m > 0.0)
    half = np.abs(turns(xy_m)) / 2.0
    room_m = np.minimum(length_m[:-1], length_m[1:]) / 2.0
    drawn = half <= STEP / 2.0 + 1e-6  # of a circle, whose sides are tangents of one as wide
    need_m = law.least_radius_m * np.tan(half)
    off_m = law.least_radius_m * (1.0 / np.cos(half) - 1.0)
    wide = (need_m <= room_m + 1e-9) & (off_m <= law.corner_m + 1e-6)
    circle_m = law.turn_radius_m * 2.0 * np.sin(STEP / 2.0)
    assert np.all(wide | (drawn & (room_m <= circle_m)))


@settings(max_examples=30, deadline=None)
@given(PLACES, WINGS)
def test_every_corner_can_be_flown(places: list[tuple[int, int]], law: FlightLaw) -> None:
    xy_m = apart(places)
    assume(len(xy_m) > 1)
    hold_s = np.where(np.arange(len(xy_m)) % 3 == 1, 40.0, 0.0)
    way = turned(xy_m, hold_s, law)
    refuse(way.xy_m, law)
    assert not way.hold_s.any()
    assert np.array_equal(way.xy_m[way.arrives], xy_m)
    assert np.array_equal(way.xy_m[way.leaves], xy_m)
    flight = timed(way.xy_m, way.hold_s, law)
    assert np.all(flight.passes_mps >= law.min_speed_mps - math.hypot(*law.wind_mps) - 1e-9)
    around_m = (
        np.hypot(*np.diff(way.xy_m, axis=0).T).sum() - np.hypot(*np.diff(xy_m, axis=0).T).sum()
    )
    circles = math.ceil(40.0 * law.speed_mps / law.turn_radius_m / 2.0 / math.pi)
    most = len(xy_m) * (LONGEST_TURN + 2.0 * math.pi * circles) * law.turn_radius_m
    assert -1e-6 <= around_m <= most


@pytest.mark.parametrize("turn_deg", [-180.0, -120.0, -90.0, 60.0, 100.0, 179.0])
def test_on_the_spot_it_ends_where_it_began_with_the_new_heading(turn_deg: float) -> None:
    angle = math.radians(turn_deg)
    end_m = [500.0 + 500.0 * math.cos(angle), 500.0 * math.sin(angle)]
    line = np.array([[0.0, 0.0], [500.0, 0.0], end_m])
    law = FlightLaw(14.0, 5.0, 1.0, min_speed_mps=12.0)
    around = turned(line, np.zeros(3), law).xy_m[1:-1]
    assert around[0] == pytest.approx(around[-1])
    lies_on = np.concatenate([[line[0]], around, [line[2]]])
    assert np.abs(turns(lies_on)).max() <= STEP + 1e-6
    turned_by = turns(lies_on).sum() - angle
    assert math.remainder(turned_by, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_waits_become_circles() -> None:
    line, law = np.array([[0.0, 0.0], [500.0, 0.0], [1000.0, 0.0]]), WING
    circle_s = 2.0 * math.pi * law.turn_radius_m / law.speed_mps
    way = turned(line, np.array([0.0, 3.1 * circle_s, 0.0]), law)
    flight = timed(way.xy_m, way.hold_s, law)
    around_s = flight.leaves_s[way.leaves[1]] - flight.arrives_s[way.arrives[1]]
    assert around_s == pytest.approx(3.0 * circle_s, rel=0.02)  # polygons are a little shorter
    assert len(turned(line, np.array([0.0, 0.4 * circle_s, 0.0]), law).xy_m) == 3


def test_short_pieces_are_merged_within_its_corners() -> None:
    bend = np.array([[10.0 * k, 200.0 - 200.0 * math.cos(k / 20.0)] for k in range(40)])
    kept = merged(bend, np.zeros(40), WING)
    assert len(kept) < 8
    there = np.interp(bend[:, 0], bend[kept, 0], bend[kept, 1])
    assert np.abs(there - bend[:, 1]).max() <= WING.corner_m * 1.5
    assert len(merged(bend, np.zeros(40), FlightLaw(14.0, 5.0, 20.0))) == 40
    to_and_fro = np.array([[0.0, 0.0], [400.0, 0.0], [410.0, 0.0], [400.0, 0.0], [800.0, 0.0]])
    assert np.all(np.diff(to_and_fro[merged(to_and_fro, np.zeros(5), WING)], axis=0).any(axis=1))


@settings(max_examples=30, deadline=None)
@given(PLACES, WINGS, st.floats(300, 1500), st.floats(0, 100), st.floats(0, 5))
def test_it_is_home_in_time(
    places: list[tuple[int, int]], law: FlightLaw, lasts_s: float, reserve_s: float, wind: float
) -> None:
    xy_m = apart(places)
    assume(len(xy_m) > 1)
    headwind_mps = max(wind, math.hypot(*law.wind_mps))
    battery = Battery(lasts_s, reserve_s, (float(xy_m[0, 0]), float(xy_m[0, 1])), headwind_mps)
    assume(law.climb_s + law.descend_s + reserve_s < lasts_s)
    way = turned(xy_m, np.zeros(len(xy_m)), law)
    line, holds = home_in_time(way.xy_m, way.hold_s, law, battery)
    assert not holds.any()
    if len(line) > 1:
        refuse(line, law)
        after_s, where = track_points(line, timed(line, holds, law), law)
        away_m = np.hypot(*(where - xy_m[0]).T)
        still_s = away_m / (law.speed_mps - headwind_mps) + law.descend_s + reserve_s
        assert np.all(law.climb_s + after_s + still_s <= lasts_s + 1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_its_plans_have_no_waits(seed: int) -> None:
    problem = random_problem(seed)
    law = FlightLaw(60.0, 20.0, 50.0, min_speed_mps=50.0, climb_mps=2.5, altitude_m=100.0)
    place = problem.network.node_xy_m[0].tolist()
    battery = Battery(1500.0, 100.0, (problem.uav.x_m, problem.uav.y_m), 5.0)
    for plan in (
        plan_of_legs(problem, "any", [0, 5, 3, 3, 2]),
        plan_of_wait(problem, "wait", *place),
    ):
        flown = as_flown(plan, law, battery, planned_mps=problem.uav.speed_mps)
        (track,), (legs,) = flown.tracks, flown.legs
        up = (track.time_s >= track.sensor_on[0, 0]) & (track.time_s <= track.sensor_on[0, 1])
        moved = np.hypot(np.diff(track.x_m[up]), np.diff(track.y_m[up]))
        assert np.all(moved[np.diff(track.time_s[up]) > 0.0] > 0.0)
        assert track.end_s - track.time_s[0] <= 1400.0 + 1e-6
        assert [leg.leg for leg in legs] == [leg.leg for leg in plan.legs[0]][: len(legs)]


@pytest.mark.parametrize(
    ("rates", "said"),
    [
        ({"min_speed_mps": 20.0, "acceleration_mps2": 1.0, "corner_m": 2.0}, "more than speed_mps"),
        ({"min_speed_mps": 9.0}, "goes with acceleration_mps2"),
    ],
)
def test_laws_that_no_aircraft_has(rates: dict[str, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        FlightLaw(10.0, **rates)


def test_corners_are_turns_of_more_than_thirty_degrees() -> None:
    x_m, y_m = [0.0, 100.0, 100.0, 200.0, 200.0, 100.0], [0.0, 0.0, 0.0, 20.0, 120.0, 120.0]
    assert Track(np.arange(6.0), x_m, y_m, [[0.0, 5.0]]).corners == 2
    circle = turned(np.array([[0.0, 0.0], [9.0, 0.0]]), np.array([60.0, 0.0]), WING).xy_m
    assert Track(np.arange(float(len(circle))), *circle.T, [[0.0, 1.0]]).corners == 0
