"""Flights by hand: few legs, along streets with names, without holds, and home in time."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from planner.clock import clock
from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import InputError
from planner.export.about import About, Flown, Summary, Worth
from planner.export.by_hand import TURN_S, Judge, Pilot, by_hand, chosen_legs
from planner.export.checks import faults
from planner.export.directions import directions
from planner.export.formats import Wanted
from planner.export.from_run import Hand, RunFlight, hand_flight
from planner.export.line import Line
from planner.export.stretches import stretches
from planner.flight.as_flown import Battery, line_flown
from planner.flight.law import FlightLaw
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import StoredPlan
from planner.network.street_names import street_names
from planner.scenario.aircraft_file import with_aircraft

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


@pytest.fixture(scope="module")
def flown(berlin: OpenScenario, on_street: np.ndarray) -> RunFlight:
    """A plan over all these places, flown by hand in three legs."""
    line = a_plan(on_street)
    track, _ = line_flown(line.xy_m, line.hold_s, LAW, up_s=160.0, lands=True)
    asked = judge(on_street)
    stored = StoredPlan(Plan("flown", (track,), ((),)), asked.sensor, asked.objective, {})
    return hand_flight(berlin, stored, Hand(3, asked))


def test_it_flies_along_the_street_where_targets_are(flown: RunFlight) -> None:
    out, along, home = flown.by_hand
    assert out.phrase.startswith("straight to ")
    assert along.phrase.startswith(f"{STREET}, from ")
    assert " towards " in along.phrase
    assert home.phrase == "straight home"
    assert STREET in {one.street for one in flown.flight.waypoints}
    assert sum(leg.length_m for leg in flown.by_hand) == pytest.approx(sum(flown.flight.lengths_m))
    begins_s = [leg.begins_s for leg in flown.by_hand]
    assert begins_s == sorted(begins_s)


def test_it_holds_nowhere_and_is_home_in_time(flown: RunFlight) -> None:
    assert not any(one.hold_s for one in flown.flight.waypoints)
    assert flown.flight.comes_home
    assert flown.lasts_s <= 1200.0
    assert list(faults(flown, most_waypoints=600)) == []
    arrives_s = [one.arrives_s for one in flown.flight.waypoints]
    at_once, _ = line_flown(
        np.array([(one.x_m, one.y_m) for one in flown.flight.waypoints]),
        np.zeros(len(arrives_s)),
        LAW,
        up_s=arrives_s[0],
        lands=True,
    )
    assert flown.track.end_s - at_once.end_s >= 2 * TURN_S  # it rests to turn


def test_what_it_loses_is_told(flown: RunFlight, on_street: np.ndarray) -> None:
    sensor, objective = judge(on_street)[1:]
    found = evaluate((flown.track,), resting(on_street), sensor, objective)
    everyone = replace(found, seen_at=np.zeros(len(on_street)))
    wanted = Wanted.of(None, "px4", "relative")
    worth = Worth(Flown(everyone, 900.0), Flown(found, flown.lasts_s))
    text = About((Summary(flown, wanted, (), worth),)).text
    assert text.startswith("The height, 100 m, is above the launch point, and flat ground")
    assert "research software, not certified" in text
    lost = 1.0 - found.detection_probability
    assert f"flown by hand it loses {100 * lost:.1f} points of the 100.0 % planned" in text
    assert "as planned     by hand" in text
    assert "  3. " in text
    assert "    begins   length  bearing" in text
    assert text.count("  straight ") == 2
    better = About((Summary(flown, wanted, (), Worth(worth.written, worth.planned)),)).text
    assert "flown by hand it gains" in better
    same = About((Summary(flown, wanted, (), Worth(worth.written, worth.written)),)).text
    assert f"finds as many as planned, {100 * found.detection_probability:.1f} %" in same
    assert f"in the air for {clock(flown.lasts_s)}, as planned" in same


def test_a_leg_that_is_long_in_words_goes_on_below_them(
    flown: RunFlight, on_street: np.ndarray
) -> None:
    first, *others = flown.by_hand
    long = replace(flown, by_hand=(first._replace(phrase="way " * 15), *others))
    sensor, objective = judge(on_street)[1:]
    worth = Flown(evaluate((flown.track,), resting(on_street), sensor, objective), 900.0)
    text = About((Summary(long, Wanted.of(None, "px4", "relative"), (), Worth(worth, worth)),)).text
    (leg, more) = (line for line in text.splitlines() if "way way" in line)
    assert len(leg) <= 80
    assert leg.index("way") == more.index("way")


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
    assert leg.line == " 0:00:00  1,237 m  013 N   straight on"


def test_what_cannot_be_flown_is_refused(berlin: OpenScenario, on_street: np.ndarray) -> None:
    pilot = Pilot(LAW, BATTERY, 160.0)
    with pytest.raises(InputError, match=r"--by-hand 1: .*give more legs"):
        by_hand(a_plan(on_street), 1, pilot, judge(on_street), berlin.network)
    nowhere = replace(pilot, clear=lambda *_: False)
    with pytest.raises(InputError, match="--by-hand 9"):
        by_hand(a_plan(on_street), 9, nowhere, judge(on_street), berlin.network)


def test_an_aircraft_on_wings_is_not_flown_so(
    berlin: OpenScenario, on_street: np.ndarray, flown: RunFlight
) -> None:
    asked = judge(on_street)
    plan = Plan("flown", (flown.track,), ((),))
    stored = StoredPlan(plan, asked.sensor, asked.objective, {})
    wings = with_aircraft(berlin.scenario.uav, Path("fixed-wing"))
    with pytest.raises(InputError, match=r"--by-hand: .* cannot hover"):
        hand_flight(berlin, stored, Hand(3, asked), uav=wings)


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
    others = [[*chosen[:at], k, *chosen[at + 1 :]] for at in range(len(chosen)) for k in range(4)]
    assert worth(chosen) >= max(map(worth, others))  # no single change is better
    assert chosen_legs(range(4), 2, lambda _: -math.inf) == []
