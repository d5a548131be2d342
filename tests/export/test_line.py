"""The line of a track is what was flown: corners and hovering, whatever the aircraft."""

import math

import numpy as np
import pytest

from planner.arrays import Floats
from planner.export.line import line_of, simplified
from planner.flight.as_flown import line_flown
from planner.flight.law import FlightLaw
from planner.flight.plan import FlownLeg
from planner.flight.track import Track
from support.instances import figure3

REAL = FlightLaw(
    15.0,
    acceleration_mps2=1.4,
    corner_m=2.0,
    climb_mps=2.5,
    descend_mps=1.5,
    altitude_m=100.0,
    wind_mps=(3.0, -1.0),
)
LAWS = (REAL, FlightLaw(15.0))
NETWORK = figure3()


def random_line(seed: int) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    many = int(rng.integers(2, 20))
    hold_s = rng.choice([0.0, 1.0], size=many) * rng.uniform(1, 60, many)
    return np.cumsum(rng.normal(0, 200, (many, 2)), axis=0), hold_s


@pytest.mark.parametrize("law", LAWS, ids=["real", "ideal"])
@pytest.mark.parametrize("seed", range(15))
def test_a_line_is_found_again_in_its_track(seed: int, law: FlightLaw) -> None:
    xy_m, hold_s = random_line(seed)
    track, times = line_flown(xy_m, hold_s, law, up_s=500.0, lands=True)
    line = line_of(track, (), NETWORK, up_s=law.climb_s, down_s=law.descend_s)
    assert np.allclose(line.xy_m, xy_m)
    assert np.allclose(line.hold_s, hold_s, atol=1e-6)
    assert np.allclose(line.time_s, 500.0 + times.arrives_s, atol=1e-6)


def test_places_on_a_straight_way_are_no_corners() -> None:
    x_m = np.array([0.0, 10.0, 10.0, 300.0, 400.0, 350.0, 350.0])
    track = Track(np.array([0, 2, 2, 30, 40, 45, 60.0]), x_m, 2 * x_m, np.zeros((0, 2)))
    line = line_of(track, (), NETWORK, up_s=0.0, down_s=0.0)
    assert line.xy_m[:, 0].tolist() == [0.0, 400.0, 350.0]
    assert line.hold_s.tolist() == [0.0, 0.0, 15.0]


def test_simplified_it_keeps_its_holds_and_its_time() -> None:
    xy_m = np.array([[0, 0], [100, 0], [104, 0], [100, 0], [200, 0], [200, 6], [0, 6.0]])
    hold_s = np.array([0, 5.0, 0, 7.0, 0, 0, 0])
    track, times = line_flown(xy_m, hold_s, FlightLaw(10.0), up_s=0.0, lands=False)
    line = simplified(line_of(track, (), NETWORK, up_s=0.0, down_s=0.0), 9.0)
    assert line.xy_m.tolist() == [[0, 0], [100, 0], [200, 6], [0, 6]]
    assert line.hold_s[1] == pytest.approx(12.8)  # with the way out and back in between
    assert line.time_s[-1] == pytest.approx(float(times.arrives_s[-1]))


def test_streets_are_those_flown_for_most_of_the_time() -> None:
    times_s = np.array([0.0, 100.0, 200.0, 250.0])
    track = Track(
        times_s, np.array([0, 100, 100, 0.0]), np.array([0, 0, 90, 90.0]), times_s[None, :2]
    )
    road = NETWORK.road_index["CE"]
    leg = FlownLeg(2 * road, 100.0, 110.0, 200.0)
    line = line_of(track, (leg,), NETWORK, up_s=0.0, down_s=0.0)
    assert line.streets == ("", "CE", "")
    assert simplified(line, math.inf).streets == ("",)
