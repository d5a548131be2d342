"""Targets that set out later, rest on the way or at a goal: the same in SUMO and on the clock."""

from dataclasses import replace

import numpy as np
import pytest

from planner.belief.particles import Particles
from planner.futures.futures import Futures
from planner.futures.kinematic import kinematic_futures
from planner.futures.record import record
from planner.network.road_network import RoadNetwork
from planner.network.signals import signals_of
from support.sumo_instances import grid5x5, town, walkers

HORIZON_S = 600.0


def some(network: RoadNetwork, *, free: bool) -> Particles:
    start = "nw-n" if free else "r0c0-r0c1"
    drawn = walkers(
        network,
        4,
        np.random.default_rng(2),
        start=start,
        roads=4,
        driving="free" if free else "constant",
    )
    return replace(drawn, gone=np.zeros(4, bool))


def driven(particles: Particles, horizon_s: float = HORIZON_S) -> Futures:
    network = town() if particles.driving == "free" else grid5x5()
    return record(network, particles, horizon_s=horizon_s, workers=1, tolerance_m=0.5)


def guessed(particles: Particles) -> Futures:
    return kinematic_futures(town(), particles, signals_of(town()), horizon_s=HORIZON_S)


def at(futures: Futures, time_s: float) -> np.ndarray:
    return futures.positions(time_s)


@pytest.mark.parametrize("how", ["sumo", "clock", "grid"])
def test_who_stops_rests_where_it_was(how: str) -> None:
    particles = some(grid5x5() if how == "grid" else town(), free=how != "grid")
    drive = guessed if how == "clock" else driven
    stop_s = np.array([0.0, 13.0, 40.0, np.inf])
    whole = drive(particles)
    stopped = drive(replace(particles, stop_s=stop_s, gone=np.ones(4, bool)))
    assert stopped.gone.tolist() == [False, False, False, True]
    assert stopped.end_s[:3].tolist() == stop_s[:3].tolist()
    for time_s in (0.0, 7.0, 13.0, 25.0, 40.0):
        before = stop_s >= time_s
        np.testing.assert_allclose(at(stopped, time_s)[before], at(whole, time_s)[before], atol=1.5)
    for k in range(3):
        np.testing.assert_array_equal(at(stopped, 500.0)[k], at(stopped, stop_s[k])[k])
        first, after = stopped.edges.first_change[k : k + 2]
        assert np.all(stopped.edges.time_s[first:after] <= stop_s[k])
        assert after > first


@pytest.mark.parametrize("how", ["sumo", "clock", "grid"])
def test_who_reaches_its_goal_rests_there(how: str) -> None:
    network = grid5x5() if how == "grid" else town()
    particles = some(network, free=how != "grid")
    drive = guessed if how == "clock" else driven
    last = particles.route_edge[particles.first_edge[1:] - 1]
    end_m = 0.3 * network.edge_length_m[last]
    horizon_s = 8000.0 if how == "grid" else HORIZON_S
    found = (
        driven(replace(particles, end_m=end_m), horizon_s)
        if how == "grid"
        else drive(replace(particles, end_m=end_m))
    )
    whole = driven(particles, horizon_s) if how == "grid" else drive(particles)
    assert np.all(found.end_s < whole.end_s)
    away_m = np.linalg.norm(at(found, horizon_s) - network.edge_xy(last, end_m), axis=1)
    assert away_m.max() < (0.01 if how == "grid" else 8.0)  # a lane beside the drawn road


@pytest.mark.parametrize("how", ["sumo", "clock", "grid"])
def test_who_sets_out_later_drives_alike_but_later(how: str) -> None:
    particles = some(grid5x5() if how == "grid" else town(), free=how != "grid")
    drive = guessed if how == "clock" else driven
    depart_s = np.array([0.0, 90.0, 7.0, 33.0])
    # On a signal's clock they set out in the same second.
    phase_s = 180 - depart_s if how != "grid" else np.zeros(4)
    later = drive(replace(particles, depart_s=depart_s, phase_s=phase_s))
    at_once = drive(replace(particles, phase_s=np.full(4, 180 if how != "grid" else 0)))
    for k in range(4):
        assert later.time_s[later.first_knot[k]] == depart_s[k]
        for after_s in (0.0, 11.0, 47.0, 100.0):
            place = at(later, depart_s[k] + after_s)[k]
            np.testing.assert_allclose(place, at(at_once, after_s)[k], atol=1.0)
    assert later.end_s.max() <= HORIZON_S


def test_who_parks_at_an_exit_before_it_leaves_is_still_there() -> None:
    particles = replace(some(town(), free=True), gone=np.ones(4, bool))
    end_s = np.array([10.0, 20.0, 20.0, 30.0])
    stops = replace(particles, stop_s=[np.inf, 20.0, 21.0, 20.0])
    assert stops.gone_after(end_s).tolist() == [True, False, True, False]


@pytest.mark.parametrize("how", ["sumo", "clock"])
def test_who_flees_is_faster_at_first_and_then_as_others(how: str) -> None:
    """On streets for 13.89 m/s, by 20 % for 12 s: some 30 m ahead, and from then on no more."""
    network, drive = town(), guessed if how == "clock" else driven
    particles = replace(some(network, free=True), start_m=np.zeros(4))
    flees = replace(particles, flees_s=np.full(4, 12.0), flees=np.full(4, 1.2))
    usual, faster = drive(particles), drive(flees)
    on_first = network.edge_length_m[particles.route_edge[0]] / 13.89
    assert on_first > 14
    ahead = at(faster, 10.0)[:, 0] - at(usual, 10.0)[:, 0]  # eastwards
    assert np.all((ahead > 8) & (ahead < 40))
    sooner_s = usual.end_s - faster.end_s
    assert np.all(sooner_s > -30)  # a signal may stop who comes sooner


@pytest.mark.parametrize("how", ["sumo", "clock"])
def test_who_flees_for_no_time_drives_as_others(how: str) -> None:
    drive = guessed if how == "clock" else driven
    particles = some(town(), free=True)
    usual = drive(particles)
    none = drive(replace(particles, flees_s=np.zeros(4), flees=np.full(4, 2.0)))
    np.testing.assert_array_equal(usual.time_s, none.time_s)
    np.testing.assert_array_equal(usual.x_m, none.x_m)
