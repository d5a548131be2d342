"""Flights by hand: few legs, along streets with names, without holds, and home in time."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import InputError
from planner.export.by_hand import Judge, Pilot, by_hand, chosen_legs
from planner.export.directions import directions
from planner.export.line import Line
from planner.export.stretches import stretches
from planner.flight.as_flown import Battery, line_flown
from planner.flight.law import FlightLaw
from planner.futures.futures import Futures
from planner.mission.opening import OpenScenario
from planner.network.street_names import street_names

LAW = FlightLaw(
    15.0, acceleration_mps2=1.4, corner_m=2.0, climb_mps=2.5, descend_mps=1.5, altitude_m=100.0
)
START = np.array([600.0, 700.0])
BATTERY = Battery(1500.0, 300.0, (600.0, 700.0), 5.0)
STREET = "Rudower Chaussee"


def resting(places: np.ndarray) -> Futures:
    many = len(places)
    return Futures(
        time_s=np.zeros(many),
        x_m=places[:, 0],
        y_m=places[:, 1],
        first_knot=np.arange(many + 1),
        weight=np.full(many, 1.0 / many),
        gone=np.zeros(many, bool),
    )


@pytest.fixture(scope="module")
def on_street(berlin: OpenScenario) -> np.ndarray:
    """Places all along one street."""
    network = berlin.network
    roads = [k for k, name in enumerate(street_names(network).road) if name == STREET]
    return np.vstack([network.xy(k, network.road_length_m[k] / 2) for k in roads])


def a_plan(places: np.ndarray) -> Line:
    xy_m = np.vstack([START, places, START])
    zeros = np.zeros(len(xy_m))
    return Line(np.arange(len(xy_m), dtype=float), xy_m, zeros, ("",) * (len(xy_m) - 1))


def judge(places: np.ndarray) -> Judge:
    return Judge(resting(places), Sensor(60.0), Objective(1800.0))


def test_it_flies_along_the_street_where_targets_are(
    berlin: OpenScenario, on_street: np.ndarray
) -> None:
    pilot = Pilot(LAW, BATTERY, 160.0)
    way = by_hand(a_plan(on_street), 3, pilot, judge(on_street), berlin.network)
    assert len(way.legs) <= 3
    assert STREET in way.streets
    track, times = line_flown(way.xy_m, way.hold_s, LAW, up_s=160.0, lands=True)
    assert track.end_s - float(track.time_s[0]) <= 1200.0
    assert (way.xy_m[-1] == START).all()
    said = directions(berlin.network, way, 160.0 + times.leaves_s)
    assert len(said) == len(way.legs)
    along = next(one for one in said if one.phrase.startswith(f"{STREET}, from "))
    assert " towards " in along.phrase
    assert said[-1].phrase == "straight home"
    assert sum(one.length_m for one in said) == pytest.approx(
        float(np.hypot(*np.diff(way.xy_m, axis=0).T).sum())
    )


def test_bearings_are_from_true_north(berlin: OpenScenario) -> None:
    from pyproj import Geod

    from planner.export.way import Way
    from planner.network.georeference import lonlat

    away = START + np.array([300.0, 1200.0])
    way = Way(np.vstack([START, away]), np.zeros(2), ("",))
    (leg,) = directions(berlin.network, way, np.zeros(2))
    (a, b), (c, d) = lonlat(berlin.network, way.xy_m).tolist()
    azimuth_deg, _, metres = Geod(ellps="WGS84").inv(a, b, c, d)
    assert leg.bearing_deg == pytest.approx(azimuth_deg % 360.0, abs=0.02)
    grid_deg = math.degrees(math.atan2(300.0, 1200.0))
    assert abs(leg.bearing_deg - grid_deg) > 1.0  # the net's north is another one
    assert leg.length_m == pytest.approx(metres, rel=1e-3)
    assert "bearing 013 (N)" in leg.line or "bearing 013 (NE)" in leg.line


def test_what_cannot_be_flown_is_refused(berlin: OpenScenario, on_street: np.ndarray) -> None:
    pilot = Pilot(LAW, BATTERY, 160.0)
    with pytest.raises(InputError, match=r"--by-hand 1: .*give more legs"):
        by_hand(a_plan(on_street), 1, pilot, judge(on_street), berlin.network)
    nowhere = replace(pilot, clear=lambda *_: False)
    with pytest.raises(InputError, match="--by-hand 9"):
        by_hand(a_plan(on_street), 9, nowhere, judge(on_street), berlin.network)


def test_stretches_lead_along_one_street_from_crossing_to_crossing(berlin: OpenScenario) -> None:
    network = berlin.network
    names = street_names(network)
    found = stretches(network, np.ones(len(network.node_ids), bool))
    assert len(found) > 200
    for one in found:
        assert (one.xy_m[0] == network.node_xy_m[one.from_node]).all()
        assert (one.xy_m[-1] == network.node_xy_m[one.to_node]).all()
        assert one.street in names.node[one.from_node]
        assert min(len(names.node[k]) for k in (one.from_node, one.to_node)) > 1
        assert np.any(np.diff(one.xy_m, axis=0) != 0.0, axis=1).all()
    assert stretches(network, np.zeros(len(network.node_ids), bool)) == []


@pytest.mark.parametrize("seed", range(5))
def test_legs_are_put_in_one_by_one_where_they_add_most(seed: int) -> None:
    value = np.random.default_rng(seed).normal(size=(4, 4))

    def worth(chosen: Sequence[int]) -> float:
        return sum(value[k, at] for at, k in enumerate(chosen)) - 0.1 * len(chosen)

    chosen = chosen_legs(range(4), 2, worth)
    single = max(worth([k]) for k in range(4))
    assert worth(chosen[:2]) >= single
    every = [[*flown] for n in (1, 2) for flown in product(range(4), repeat=n)]  # some twice
    assert worth(chosen) <= max(map(worth, every))
    assert len(chosen) <= 2
    assert chosen_legs(range(4), 2, lambda _: -math.inf) == []
