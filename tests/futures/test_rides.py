"""Vehicles that ride alone: forks of one loaded session against fresh SUMO, and what may fail."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from planner.belief.particles import Particles
from planner.belief.sampling import SETTLED_S, sample
from planner.errors import LostError, SumoError
from planner.futures import workers
from planner.futures.record import SESSION, record, session_of, session_seed
from planner.futures.rides import Ride, Session, drive_session
from planner.futures.tracks import tracks_of_rides
from planner.futures.worker import running
from planner.futures.workers import in_processes
from planner.mission.opening import OpenScenario
from planner.network.road_network import RoadNetwork
from support.dying_rides import dying, threads_and_modules
from support.sumo_instances import town, walkers
from support.towns import luxembourg

FRESH = partial(drive_session, forks=False)


@pytest.fixture(autouse=True)
def _none_left() -> None:
    workers.dismiss()


def particles_of(network: RoadNetwork, count: int) -> Particles:
    """Particles in the built town, each at another second of its signals."""
    some = walkers(network, count, np.random.default_rng(3), start="nw-n", roads=12)
    return replace(some, driving="free", phase_s=(7 + 13 * np.arange(count)) % 90)


def session(particles: Particles, network: RoadNetwork, *, end_s: float = 300.0) -> Session:
    return session_of(network, particles, np.arange(len(particles)), 42, end_s)


def driven(task: Session, how: partial[list[Ride]] | None = None) -> list[Ride]:
    (answer,) = in_processes(how or drive_session, [task], workers=1)
    return answer


@pytest.mark.parametrize("driving", ["free", "constant"])  # SUMO's driver is imperfect, or perfect
def test_a_fork_is_a_fresh_sumo(driving: str) -> None:
    network = town()
    particles = replace(particles_of(network, 6), driving=driving)
    task = session(particles, network)
    assert driven(task) == driven(task, FRESH)


def test_a_fork_is_a_fresh_sumo_among_actuated_signals(berlin: OpenScenario) -> None:
    assert_fork_is_fresh(berlin, 5)


@pytest.mark.long
def test_a_fork_is_a_fresh_sumo_in_a_large_town(tmp_path: Path) -> None:
    assert_fork_is_fresh(luxembourg(tmp_path), 3)


def assert_fork_is_fresh(opened: OpenScenario, count: int) -> None:
    rng = np.random.default_rng(5)
    particles = sample(opened.prior, opened.network, count, rng, horizon_s=600.0)
    assert np.all(particles.phase_s >= SETTLED_S)
    assert len(set(particles.phase_s)) > 1
    for driving in ("free", "constant"):
        task = session(replace(particles, driving=driving), opened.network, end_s=600.0)
        assert driven(task) == driven(task, FRESH)


def test_speeds_drawn_by_road_are_kept_in_forks() -> None:
    network = town()
    some = walkers(network, 3, np.random.default_rng(9), start="nw-n", roads=8, speed_per_road=True)
    for driving in ("free", "constant"):
        task = session(replace(some, driving=driving), network)
        rides = driven(task)
        assert rides == driven(task, FRESH)
        for ride, vehicle in zip(rides, task.vehicles, strict=True):
            xy_m = np.frombuffer(ride.xy_m).reshape(-1, 2)
            pace = np.linalg.norm(np.diff(xy_m, axis=0), axis=1).max()
            assert pace <= max(vehicle.speeds_mps) * 1.05


def test_neither_order_nor_company_nor_workers_change_a_ride() -> None:
    network = town()
    particles = particles_of(network, 24)
    task = session(particles, network)
    whole = driven(task)
    turned = replace(task, vehicles=task.vehicles[::-1], phases_s=task.phases_s[::-1])
    assert driven(turned) == whole[::-1]
    assert driven(replace(task, vehicles=task.vehicles[5:6], phases_s=task.phases_s[5:6])) == [
        whole[5]
    ]
    several = [record(network, particles, horizon_s=300.0, workers=n) for n in (1, 2, 3)]
    for futures in several[1:]:
        for column in ("time_s", "x_m", "y_m", "first_knot"):
            assert getattr(futures, column).tobytes() == getattr(several[0], column).tobytes()


def test_sessions_have_seeds_by_number() -> None:
    particles = particles_of(town(), 3)
    assert len({session_seed(particles, number) for number in range(50)}) == 50
    assert session_seed(particles, 7) == session_seed(replace(particles, driving="constant"), 7)


def test_what_forks_has_no_threads_and_is_light() -> None:
    network = town()
    task = session(particles_of(network, 1), network, end_s=20.0)
    ((threads, modules),) = in_processes(threads_and_modules, [task], workers=1)
    assert threads == 1
    assert "libsumo" in modules
    assert not modules & {"numba", "pyarrow", "pandas", "scipy", "pydantic"}


@pytest.mark.parametrize("times", [1, 2])
def test_a_killed_ride_is_driven_again_once(times: int, tmp_path: Path) -> None:
    network = town()
    task = session(particles_of(network, 4), network)
    counter = tmp_path / "deaths"
    counter.touch()
    how = partial(dying, k=2, times=times, counter=counter)
    if times == 1:
        assert driven(task, how) == driven(task)
    else:
        with pytest.raises(LostError, match=r"^particle 2: its process was killed by signal 9, 2"):
            driven(task, how)
    assert counter.stat().st_size == times


def test_no_process_is_left() -> None:
    network = town()
    driven(session(particles_of(network, 4), network))
    (worker,) = running
    children = Path(f"/proc/{worker.process.pid}/task/{worker.process.pid}/children")
    assert children.read_bytes() == b""


def test_a_vehicle_that_cannot_set_out_is_named() -> None:
    network = town()
    task = session(particles_of(network, 2), network)
    broken = replace(task.vehicles[1], edges=("nw-n", "no such edge"))
    with pytest.raises(SumoError, match="no such edge"):
        driven(replace(task, vehicles=(task.vehicles[0], broken)))
    assert len(driven(task)) == 2  # and the worker goes on


def test_a_session_ends_with_the_horizon_and_with_the_route() -> None:
    network = town()
    some = walkers(network, 2, np.random.default_rng(3), start="nw-n", roads=2, driving="free")
    long = driven(session(some, network, end_s=900.0))
    short = driven(session(some, network, end_s=10.0))
    for whole, cut in zip(long, short, strict=True):
        assert whole.arrival is not None
        assert cut.arrival is None
        assert len(cut.xy_m) == 16 * 11  # seconds 0 to 10
        assert whole.xy_m.startswith(cut.xy_m)
        assert cut.roads == tuple(road for road in whole.roads if road[0] <= 10)


@pytest.mark.parametrize(("end_s", "samples"), [(60.0, 61), (60.3, 62), (0.5, 2)])
def test_a_ride_reaches_a_horizon_within_a_step(end_s: float, samples: int) -> None:
    network = town()
    (ride,) = driven(session(particles_of(network, 1), network, end_s=end_s))
    assert ride.from_s == 0.0
    assert len(ride.xy_m) == samples * 2 * 8  # one at each second from 0 on, the last not before


def test_who_is_in_a_junction_counts_to_the_edge_after_it() -> None:
    network = town()
    particles = particles_of(network, 3)
    for k, ride in enumerate(driven(session(particles, network))):
        assert any(road.startswith(":") for _, road, _ in ride.roads)
        tracks = tracks_of_rides([ride], network, step_s=1.0)
        assert tracks.change_edge.tolist() == particles.route(k)[: len(tracks.change_s)].tolist()
        for last, _, onto in ride.roads:  # whenever it ends
            short = replace(ride, roads=tuple(some for some in ride.roads if some[0] <= last))
            cut = tracks_of_rides([short], network, step_s=1.0)
            assert network.edge_ids[cut.change_edge[-1]] == onto
            assert cut.change_s.tolist() == tracks.change_s[tracks.change_s <= last].tolist()


CYCLE_S, GREEN_S, AMBER_S = 90, 41, 4  # of the town's only signal, for who comes from the north


def test_a_car_stands_as_long_as_the_signal_is_red() -> None:
    network = town()
    one = walkers(network, 1, np.random.default_rng(1), start="n-centre", roads=2, driving="free")
    route = [network.edge_index[name] for name in ("n-centre", "centre-s")]
    one = replace(one, route_edge=route, speed_mps=[13.0, 13.0], start_m=[0.0])
    waited = 0
    for phase_s in range(0, CYCLE_S, 6):
        (ride,) = driven(session(replace(one, phase_s=[phase_s]), network))
        crosses = next(sample for sample, road, _ in ride.roads if road.startswith(":"))
        assert (phase_s + crosses) % CYCLE_S < GREEN_S + AMBER_S
        moved_m = np.linalg.norm(np.diff(np.frombuffer(ride.xy_m).reshape(-1, 2), axis=0), axis=1)
        stands = np.flatnonzero(moved_m < 1e-6)
        if len(stands):
            waited += 1
            assert (phase_s + stands[-1] + 2) % CYCLE_S == 0  # off it goes with the green
    assert waited >= 4


def driven_m(answers: list[list[Ride]], at_s: int) -> np.ndarray:
    """How far each vehicle of each session has driven by a time, (S, n) metres."""

    def metres(ride: Ride) -> float:
        xy_m = np.frombuffer(ride.xy_m).reshape(-1, 2)[: at_s + 1]
        return float(np.linalg.norm(np.diff(xy_m, axis=0), axis=1).sum())

    return np.array([[metres(ride) for ride in rides] for rides in answers])


@pytest.mark.long
def test_sessions_vary_no_more_than_seeds_of_their_own(berlin: OpenScenario) -> None:
    """Drivers of one session dawdle by the same random numbers: what that adds to its mean."""
    sessions, each, share = 20, 12, 0.1
    rng = np.random.default_rng(1)
    count = sessions * each
    particles = sample(berlin.prior, berlin.network, count, rng, horizon_s=300.0)
    together, alone = [], []
    for number in range(sessions):
        batch = np.arange(number * each, (number + 1) * each)
        seed = session_seed(particles, number)
        together.append(session_of(berlin.network, particles, batch, seed, 300.0))
        for k in batch:
            seed = int(particles.seed[k])
            alone.append(session_of(berlin.network, particles, np.array([k]), seed, 300.0))
    shared = list(in_processes(drive_session, together))
    own = [rides[0] for rides in in_processes(drive_session, alone)]
    for at_s in (120, 300):
        one = driven_m(shared, at_s)
        other = driven_m([own[i : i + each] for i in range(0, count, each)], at_s)
        # Routes, speeds and phases are the same in both, so what differs is the driver alone.
        apart = one - other
        in_common = apart.mean(axis=1).var(ddof=1) - apart.var(ddof=1) / each
        assert abs(in_common) < share * other.var(ddof=1) / SESSION
