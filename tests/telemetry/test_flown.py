"""From points to a flight: which clock, what counts as seen, and what is refused."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.export.from_run import placed
from planner.flight.law import FlightLaw
from planner.telemetry.flown import Flown, Reading, flown
from planner.telemetry.log import TrackLog, log_of
from support.instances import grid

SEEN = datetime(2026, 5, 1, 12, 0, tzinfo=UTC)
NET = grid(2, 2)
LAW = FlightLaw(10.0, climb_mps=2.0, descend_mps=1.0, altitude_m=20.0)


def log(**columns: Any) -> TrackLog:
    """Points along x = 10 t, where nothing else is said."""
    many = len(next(iter(columns.values())))
    columns = {"time_s": np.arange(float(many)), **columns}
    times = columns.get("utc_s", columns["time_s"])
    columns = {"x_m": 10.0 * (np.array(times) - times[0]), "y_m": np.zeros(many), **columns}
    begins = columns.pop("begins", [k == 0 for k in range(many)])
    sampled = columns.pop("is_sampled", True)
    rows = [
        {"number": k + 1, "begins": begins[k], **{name: float(c[k]) for name, c in columns.items()}}
        for k in range(many)
    ]
    return log_of(Path("a.csv"), "line", rows, is_sampled=sampled)


def reading(**changed: Any) -> Reading:
    usual = Reading(around_m=NET.shape_xy_m, horizon_s=1000.0, law=LAW)
    return replace(usual, **changed)


def read(points: TrackLog, **changed: Any) -> Flown:
    return flown(points, NET, reading(**changed))


def spans(found: Flown) -> list[list[float]]:
    return np.round(found.track.sensor_on, 9).tolist()


# The clock


def test_its_times_of_day_count_from_when_the_target_was_seen() -> None:
    utc_s = SEEN.timestamp() + np.array([60.0, 61.0, 62.0])
    found = read(log(utc_s=utc_s), sighted_at=SEEN)
    assert found.clock == "utc"
    assert found.track.time_s.tolist() == [60.0, 61.0, 62.0]
    with pytest.raises(InputError, match=r"target\.sighted_at\); give --takes-off-at TIME"):
        read(log(utc_s=utc_s, time_s=[np.nan] * 3))


def test_without_a_moment_its_own_seconds_are_the_target_s() -> None:
    utc_s = SEEN.timestamp() + np.array([60.0, 61.0, 62.0])
    found = read(log(utc_s=utc_s, time_s=[5.0, 6.0, 7.0]))
    assert found.clock == "seconds"
    assert found.track.time_s.tolist() == [5.0, 6.0, 7.0]


def test_the_lift_off_may_be_given_instead() -> None:
    heights = [34.1, 34.0, 34.2, 40.0, 46.0, 52.0]  # on the ground until 2 s
    for shift_s in (0.0, 1e6):
        times = shift_s + np.arange(6.0)
        found = read(log(time_s=times, height_m=heights), take_off_s=120.0, sensor_from_m=10.0)
        assert found.clock == "takes-off-at"
        assert found.lift_off_s == pytest.approx(120.0)
        assert found.track.time_s.tolist() == pytest.approx([117.0, 118, 119, 120, 121, 122])
    in_the_air = read(log(time_s=np.arange(6.0), height_m=[50.0] * 6), take_off_s=120.0)
    assert in_the_air.heights == "told"  # the sensor counts from the ground on
    up = read(log(time_s=np.arange(6.0), height_m=[50.0] * 6), take_off_s=120.0, sensor_from_m=19.0)
    assert up.heights == "never down"
    assert up.track.time_s[0] == 130.0  # after its climb of 10 s


# Heights


def test_the_sensor_counts_from_a_height_above_the_lowest_point() -> None:
    found = read(log(height_m=[30.0, 40.0, 60.0, 60.0, 50.0, 30.0]), sensor_from_m=20.0)
    assert found.heights == "told"
    assert spans(found) == [[1.5, 4.0]]
    with pytest.raises(InputError, match=r"highest point is 30\.0 m .* give --sensor-from METRES"):
        read(log(height_m=[30.0, 60.0]), sensor_from_m=31.0)


def test_a_recording_that_is_never_down_counts_all_along() -> None:
    found = read(log(height_m=[60.0, 61.0, 59.0]), sensor_from_m=20.0)
    assert (found.heights, spans(found)) == ("never down", [[0.0, 2.0]])


def test_without_heights_it_climbs_and_comes_down_as_planned() -> None:
    points = log(time_s=np.arange(0.0, 50.0, 5.0))
    assert spans(read(points)) == [[10.0, 45.0]]
    assert spans(read(points, lands=True)) == [[10.0, 25.0]]
    assert read(points).heights == "none"


# What is unknown


def test_across_breaks_leaps_and_segments_nothing_is_seen() -> None:
    up = {"height_m": [0.0, *[50.0] * 9], "time_s": [0, 1, 2, 3, 20, 21, 22, 23, 24, 25]}
    found = read(log(**up), sensor_from_m=40.0)
    assert spans(found) == [[0.8, 3.0], [20.0, 25.0]]
    assert (found.breaks, found.unknown_s) == (1, 17.0)
    assert read(log(**up), sensor_from_m=40.0, break_s=17.0).breaks == 0

    parts = [True, *[False] * 6, True, False, False]
    assert spans(read(log(**up, begins=parts), sensor_from_m=40.0)) == [
        [0.8, 3.0],
        [20.0, 22.0],
        [23.0, 25.0],
    ]
    x_m = [0.0, 10, 20, 30, 200, 210, 900, 230, 240, 250]  # 690 m in a second: a bad fix
    assert spans(read(log(**up, x_m=x_m), sensor_from_m=40.0)) == [
        [0.8, 3.0],
        [20.0, 21.0],
        [23.0, 25.0],
    ]


def test_two_points_at_one_time_are_one() -> None:
    found = read(log(time_s=[0.0, 1.0, 1.0, 2.0], x_m=[0.0, 10.0, 12.0, 20.0]), law=FlightLaw(10.0))
    assert found.track.x_m.tolist() == [0.0, 10.0, 20.0]
    begins = [True, False, True, False]  # the one that is left out has begun anew
    again = log(time_s=[0.0, 1.0, 1.0, 2.0], begins=begins)
    assert spans(read(again, law=FlightLaw(10.0))) == [[0.0, 1.0]]
    with pytest.raises(InputError, match="all its points are at one time"):
        read(log(time_s=[1.0, 1.0]))


@settings(max_examples=40)
@given(st.data())
def test_spans_are_those_of_a_slow_clock(data: st.DataObject) -> None:
    many = data.draw(st.integers(2, 12))
    steps = data.draw(st.lists(st.integers(1, 15), min_size=many - 1, max_size=many - 1))
    time_s = np.cumsum([0, *steps]).astype(float)
    heights = np.array(data.draw(st.lists(st.integers(0, 9), min_size=many, max_size=many)), float)
    heights[0], heights[-1] = 0.0, 9.0
    begins = [True, *data.draw(st.lists(st.booleans(), min_size=many - 1, max_size=many - 1))]
    points = log(time_s=time_s, height_m=heights, begins=begins, x_m=time_s)
    found = read(points, sensor_from_m=4.5)
    for moment in np.arange(0.05, time_s[-1], 0.3):
        after = int(np.searchsorted(time_s, moment))
        known = not begins[after] and time_s[after] - time_s[after - 1] <= 10.0
        seen = known and np.interp(moment, time_s, heights) >= 4.5
        inside = any(a <= moment <= b for a, b in found.track.sensor_on)
        assert inside == seen or abs(np.interp(moment, time_s, heights) - 4.5) < 1e-9


def test_a_table_of_waypoints_is_flown_by_the_law_at_its_times() -> None:
    law = FlightLaw(10.0, acceleration_mps2=1.0, corner_m=1.0)
    points = log(
        time_s=[0.0, 30.0, 100.0], x_m=[0.0, 200.0, 200.0], y_m=[0.0, 0.0, 300.0],
        hold_s=[np.nan, 20.0, 0.0], is_sampled=False,
    )  # fmt: skip
    found = read(points, law=law)
    assert found.breaks == 0
    for time_s, place in ((0.0, (0, 0)), (15.0, (100, 0)), (30.0, (200, 0)), (50.0, (200, 0))):
        assert np.allclose(found.track.xy(time_s), place, atol=0.3)
    assert found.track.xy(5.0)[0] < 20.0  # it speeds up: even motion would be at 33 m
    assert found.track.end_s == 100.0
    against = replace(law, wind_mps=(-30.0, 0.0))
    assert np.allclose(read(points, law=against).track.xy(15.0), (100.0, 0.0))


# What is refused


def refused(points: TrackLog, said: str, net: Any = NET, **changed: Any) -> None:
    with pytest.raises(InputError) as caught:
        flown(points, net, reading(**changed))
    assert str(caught.value).startswith("a.csv: ")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_points_that_cannot_be() -> None:
    refused(log(time_s=[0.0, 2.0, 1.0]), "line 3: is 1 s earlier than the one before")
    refused(log(time_s=[0.0, np.nan, 1.0], x_m=[0.0] * 3), "line 2: has no time")
    refused(log(x_m=[0.0, np.nan, 1.0]), "line 2: has no place")
    refused(log(x_m=[0.0, 1e9, 1.0]), "line 2: x 1e+09 m, y 0 m is 999,993 km away")
    late = log(time_s=[2000.0, 2001.0])
    refused(late, "is from 0:33:20 to 0:33:21 after the target was last seen")


def test_degrees_lie_where_the_net_does() -> None:
    net = placed(NET, (-33.9, 18.4))
    lon, lat = [18.4, 18.401, 18.402], [-33.9, -33.901, -33.9]
    none = [np.nan] * 3
    points = log(lon_deg=lon, lat_deg=lat, x_m=none, y_m=none)
    track = flown(points, net, reading()).track
    assert track.x_m[0] == pytest.approx(0.0, abs=1e-6)
    assert track.y_m[1] == pytest.approx(-110.9, abs=0.1)
    refused(points, "does not say where on the Earth it lies; give --origin LAT,LON")
    turned = log(lon_deg=lat, lat_deg=lon, x_m=none, y_m=none)
    refused(turned, "line 1: longitude -33.9, latitude 18.4 is far from the search", net)
    refused(turned, "exchange longitude and latitude", net)
    gulf = log(lon_deg=[18.4, 0.0, 18.4], lat_deg=[-33.9, 0.0, -33.9], x_m=none, y_m=none)
    refused(gulf, "line 2: longitude 0, latitude 0 is 4,240 km away", net)
    beyond = log(lon_deg=[18.4, 18.4], lat_deg=[95.0, 95.0], x_m=none[:2], y_m=none[:2])
    refused(beyond, "is nowhere on the Earth from the search", net)
    missing = log(lon_deg=[18.4, np.nan, 18.4], lat_deg=lat, x_m=none, y_m=none)
    refused(missing, "line 2: has no place", net)
