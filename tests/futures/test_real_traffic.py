"""What riders do to real traffic and it to them, in Berlin: minutes, so in no gate."""

import logging
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from planner.belief.sampling import sample
from planner.futures import workers
from planner.futures.riders import Ridden, TrafficSession, ride_in_traffic
from planner.futures.simulation import Vehicle
from planner.futures.steering import control_of
from planner.futures.tracks import futures_of_tracks, motion_of, tracks_of_rides
from planner.futures.vehicles import vehicles_of
from planner.futures.workers import in_parts
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.recorder import Recorder
from planner.mission.validate import Validation, validated
from planner.streams import stream
from support import watching
from support.queues import nobody, session
from support.signal_grid import signal_grid

log = logging.getLogger(__name__)
pytestmark = pytest.mark.traffic

HORIZON_S = 1200.0
JAM = 4500  # vehicles an hour, which this net cannot take
TOLERANCE_M = 5.0


def berlin(per_hour: int, *more: str) -> OpenScenario:
    """Berlin with so many vehicles setting out in an hour."""
    given = (
        "target.start={ x_m = 1492.6, y_m = 671.7, radius_m = 150 }",
        f"traffic.vehicles_per_hour={per_hour}",
        f"search.horizon_s={HORIZON_S}",
        "truth.driving=traffic",
    )
    return open_scenario("berlin", overrides=[*given, *more])


def vehicles(opened: OpenScenario, count: int, name: str) -> tuple[Vehicle, ...]:
    particles = sample(opened.prior, opened.network, count, stream(1, name), horizon_s=HORIZON_S)
    return vehicles_of(opened.network, particles, np.arange(count))


def ridden(task: TrafficSession) -> list[Ridden]:
    workers.dismiss()
    return [part for _, part in in_parts(ride_in_traffic, [task], workers=1)]


def watched(
    task: TrafficSession, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[list[Ridden], list[str]]:
    """Return what riders do, and what a watch has written since time 0."""
    file = tmp_path / "watched.txt"
    file.unlink(missing_ok=True)
    monkeypatch.setenv(watching.FILE, str(file))
    traffic = replace(task.traffic, control=control_of(f"support.watching:{what}"))
    parts = ridden(replace(task, traffic=traffic))
    return parts, file.read_text().splitlines()[-1 - round(task.end_s) :]


def test_a_jam_stays_a_jam(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No more cars arrive with riders than without: none drives through a queue."""
    opened = berlin(JAM)
    assert opened.traffic is not None
    some = vehicles(opened, 10, "jam")
    later = (replace(some[0], depart_s=1e6),)
    arrived = {}
    for name, together in (("with", some), ("without", later)):
        arrived[name] = 0
        for realisation in range(4):
            task = session(opened.network, opened.traffic, (together,), end_s=HORIZON_S)
            task = replace(task, realisation=realisation)
            _, lines = watched(task, "arrivals", tmp_path, monkeypatch)
            arrived[name] += sum(map(int, lines))
    log.warning("arrivals with riders %(with)d, without %(without)d", arrived)
    assert arrived["with"] <= 1.03 * arrived["without"]


def test_a_rider_waits_at_red(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It enters junctions while its own link shows green, and within seconds where it waited."""
    network = signal_grid()
    net = ElementTree.parse(network.path).getroot()
    route = ["A2B2", "B2C2", "C2D2", "D2E2"]
    index = {
        (link.get("from"), link.get("to"), link.get("fromLane")): int(link.get("linkIndex", "0"))
        for link in net.iter("connection")
        if link.get("tl")
    }
    names = sorted(tls.get("id", "") for tls in net.iter("tlLogic"))
    car = Vehicle("0", tuple(route), (13.0,) * 4, (200.0,) * 4, 20.0, 0.0)
    waited = 0
    for at_s in (100.0, 117.0, 134.0, 151.0, 168.0):
        task = session(network, nobody(tmp_path, at_s=at_s), ((car,),), end_s=200.0)
        (copy,), lines = watched(task, "lights", tmp_path, monkeypatch)
        shown = {float(line.split()[0]): line.split()[1].split("|") for line in lines}
        ride = copy.rides[0]
        speeds = np.hypot(*np.diff(motion_of(ride, copy.step_s)[:, 1:], axis=0).T)
        for (_, before, _), (sample_, road, onto) in zip(ride.roads, ride.roads[1:], strict=False):
            if not road.startswith(":"):
                continue
            own = [number for key, number in index.items() if key[:2] == (before, onto)]
            junction = names.index(road[1:].split("_")[0])
            # What they show is read before a step, in which they may change.
            state = [shown[at_s + sample_ - back][junction] for back in range(-1, 6)]
            green = [any(one[k] in "Ggy" for k in own) for one in state]
            assert green[0] or green[1], (at_s, before, onto, state, own)
            stood = speeds[max(0, sample_ - 8) : sample_ - 2].min() < 0.1
            if stood:
                waited += 1
                assert not all(green), (at_s, before, onto)  # it was red a few seconds ago
    log.warning("waited at %d signals", waited)
    assert waited >= 3


def test_an_actuated_signal_heeds_a_rider(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = berlin(1000)
    traffic = nobody(tmp_path, at_s=300.0)
    some = vehicles(opened, 10, "actuated")
    shown = [
        watched(
            session(opened.network, traffic, (who,), end_s=300.0), "lights", tmp_path, monkeypatch
        )[1]
        for who in (some, (replace(some[0], depart_s=1e6),))
    ]
    assert len(shown[0]) == len(shown[1]) > 290
    assert shown[0] != shown[1]


def test_knots_are_as_near_as_they_say_and_few() -> None:
    """At the time of every sample, waiting in queues and all."""
    opened = berlin(2000)
    assert opened.traffic is not None
    task = session(
        opened.network, opened.traffic, (vehicles(opened, 10, "knots"),), end_s=HORIZON_S
    )
    (copy,) = ridden(task)
    tracks = tracks_of_rides(copy.rides, opened.network, step_s=copy.step_s)
    futures = futures_of_tracks(tracks, tolerance_m=TOLERANCE_M)
    worst_m, samples = 0.0, 0
    for k, ride in enumerate(copy.rides):
        time_s, x_m, y_m = motion_of(ride, copy.step_s).T
        off_m = np.hypot(*(futures.xy(k, time_s) - np.column_stack([x_m, y_m])).T)
        worst_m, samples = max(worst_m, float(off_m.max())), samples + len(time_s)
        assert tuple(futures.xy(k, time_s[0])) == (x_m[0], y_m[0])
        assert tuple(futures.xy(k, time_s[-1])) == (x_m[-1], y_m[-1])
    minutes = samples / 60
    log.warning("at most %.2f m off, %.1f knots a minute", worst_m, len(futures.time_s) / minutes)
    assert worst_m <= TOLERANCE_M + 1e-9
    assert len(futures.time_s) / minutes < 12


def coverage(opened: OpenScenario) -> Validation:
    recorder = Recorder(opened, workers=1)
    truths = recorder.validation(20, 10).futures
    assert truths.fates is not None
    cloud = recorder.planning().futures
    found = validated(cloud, truths, truths.fates.realisation, HORIZON_S, seed=1)
    for check in found.checks:
        log.warning("%s", check)
    return found


def test_a_belief_in_traffic_covers_unseen_traffic() -> None:
    found = coverage(berlin(1000, "target.driving=traffic", "search.particles=400"))
    assert not found.is_off
    # One look at 200 truths and 400 particles is off by 2.6 % on average, by chance alone.
    assert abs(np.mean([check.covered for check in found.checks]) - 0.9) <= 0.04
    assert max(abs(check.covered - 0.9) for check in found.checks) <= 0.08


def test_a_belief_in_free_driving_is_found_out_in_a_jam() -> None:
    found = coverage(berlin(JAM, "target.driving=free", "search.particles=400"))
    assert found.is_off
    assert min(check.covered for check in found.checks) < 0.85
