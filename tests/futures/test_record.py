"""Recorded motion against physics, against the bare sumo program, and against itself."""

import re
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from planner.belief.particles import Particles
from planner.errors import SumoError
from planner.futures.futures import Futures
from planner.futures.record import record, session_seed, way_of
from planner.futures.store import describe, write_recording
from planner.network.build import build_net
from planner.network.read import read_net
from planner.network.road_network import RoadNetwork
from planner.network.sumo import binary, sumo_environment
from support.sumo_instances import NETS, grid5x5, town, walkers

GRID_HORIZON_S = 10_000.0


def physics(network: RoadNetwork, particles: Particles, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and places at which a particle at its drawn speeds passes the ends of its edges."""
    route, speeds = particles.route(k), particles.speeds(k)
    length_m = network.edge_length_m[route].copy()
    length_m[0] -= particles.start_m[k]
    times = np.concatenate(([0.0], np.cumsum(length_m / speeds)))
    first = network.edge_xy(route[0], particles.start_m[k])
    return times, np.vstack([first, network.node_xy_m[network.road_to[network.edge_road[route]]]])


def farthest_from_physics(network: RoadNetwork, particles: Particles, futures: Futures) -> float:
    worst = 0.0
    for k in range(len(particles)):
        times, places = physics(network, particles, k)
        knots = futures.time_s[futures.first_knot[k] : futures.first_knot[k + 1]]
        checked = np.concatenate([knots, (knots[1:] + knots[:-1]) / 2])
        checked = checked[checked <= times[-1]]
        expected = np.stack([np.interp(checked, times, places[:, i]) for i in (0, 1)], axis=-1)
        worst = max(worst, float(np.abs(futures.xy(k, checked) - expected).max()))
    return worst


def edge_changes(network: RoadNetwork, futures: Futures, k: int) -> list[tuple[str, float]]:
    """Each edge of a particle with the time at which it was left."""
    rows = slice(futures.edges.first_change[k], futures.edges.first_change[k + 1])
    names = [network.edge_ids[edge] for edge in futures.edges.edge[rows]]
    left_s = [*futures.edges.time_s[rows][1:].tolist(), float(futures.end_s[k])]
    return list(zip(names, left_s, strict=True))


@pytest.mark.parametrize("speed_per_road", [False, True])
def test_constant_driving_on_the_grid_is_physics(speed_per_road: bool) -> None:
    network = grid5x5()
    rng = np.random.default_rng(1)
    particles = walkers(
        network, 150, rng, start="r0c0-r0c1", roads=10, speed_per_road=speed_per_road
    )
    futures = record(network, particles, horizon_s=GRID_HORIZON_S, workers=1)
    assert farthest_from_physics(network, particles, futures) < 1.0
    arrivals = np.array([physics(network, particles, k)[0][-1] for k in range(150)])
    arrived = arrivals < GRID_HORIZON_S
    assert arrived.sum() > 140
    np.testing.assert_allclose(futures.end_s[arrived], arrivals[arrived], rtol=1e-4)
    assert len(futures.time_s) / len(futures) < 12  # knots, not ticks


def test_a_slow_particle_is_recorded_up_to_the_horizon() -> None:
    network = grid5x5()
    particles = walkers(network, 1, np.random.default_rng(2), start="r0c0-r0c1", roads=10)
    slow = replace(particles, speed_mps=np.full(10, 10.0), start_m=np.zeros(1))
    futures = record(network, slow, horizon_s=2_000.0, workers=1)
    assert futures.end_s[0] >= 2_000.0
    np.testing.assert_allclose(futures.xy(0, 2_000.0), physics_xy(network, slow, 2_000.0))


def physics_xy(network: RoadNetwork, particles: Particles, time_s: float) -> np.ndarray:
    times, places = physics(network, particles, 0)
    return np.array([np.interp(time_s, times, places[:, i]) for i in (0, 1)])


def test_particles_do_not_notice_each_other() -> None:
    network = grid5x5()
    particles = walkers(network, 60, np.random.default_rng(3), start="r0c0-r1c0", roads=10)
    together = record(network, particles, horizon_s=GRID_HORIZON_S, workers=1)
    for k in (0, 17, 59):
        alone = record(network, one(particles, k), horizon_s=GRID_HORIZON_S, workers=1)
        kept = together.take(np.array([k]))
        np.testing.assert_array_equal(alone.time_s, kept.time_s)
        np.testing.assert_array_equal(alone.x_m, kept.x_m)
        np.testing.assert_array_equal(alone.y_m, kept.y_m)


def one(particles: Particles, k: int) -> Particles:
    return replace(
        particles,
        weight=particles.weight[[k]],
        start_m=particles.start_m[[k]],
        depart_s=particles.depart_s[[k]],
        first_edge=[0, len(particles.route(k))],
        route_edge=particles.route(k),
        speed_mps=particles.speeds(k),
        seed=particles.seed[[k]],
        gone=particles.gone[[k]],
        target=particles.target[[k]],
        phase_s=particles.phase_s[[k]],
        stop_s=particles.stop_s[[k]],
        end_m=particles.end_m[[k]],
        flees_s=particles.flees_s[[k]],
        flees=particles.flees[[k]],
        realisation=particles.realisation[[k]],
    )


def test_the_number_of_workers_changes_no_byte(tmp_path: Path) -> None:
    network = grid5x5()
    particles = walkers(network, 230, np.random.default_rng(4), start="r0c0-r0c1", roads=10)
    written = []
    for workers in (1, 2):
        folder = tmp_path / str(workers)
        futures = record(network, particles, horizon_s=GRID_HORIZON_S, workers=workers)
        write_recording(folder, futures, particles, network, describe(network, {}, 1.0))
        written.append([path.read_bytes() for path in sorted(folder.iterdir())])
    assert written[0] == written[1]


def test_a_tolerance_given_decides_how_many_knots_there_are() -> None:
    network = town()
    particles = walkers(
        network, 6, np.random.default_rng(6), start=network.edge_ids[0], roads=5, driving="free"
    )
    exact, default, given, rough = (
        record(network, particles, horizon_s=200.0, tolerance_m=tolerance_m, workers=1)
        for tolerance_m in (1e-6, None, 5.0, 50.0)
    )
    np.testing.assert_array_equal(default.time_s, given.time_s)  # what holds in towns
    assert len(rough.time_s) < len(given.time_s) < len(exact.time_s)
    for futures, tolerance_m in ((given, 5.0), (rough, 50.0)):
        for k in range(6):
            knots = slice(exact.first_knot[k], exact.first_knot[k + 1])
            times_s = exact.time_s[knots]
            off_m = np.hypot(*(futures.xy(k, times_s) - exact.xy(k, times_s)).T)
            assert off_m.max() <= tolerance_m + 1e-6


def test_progress_counts_up_to_all_particles() -> None:
    network = grid5x5()
    particles = walkers(network, 120, np.random.default_rng(5), start="r0c0-r0c1", roads=2)
    told: list[tuple[int, int]] = []
    record(network, particles, horizon_s=500.0, workers=1, progress=lambda *n: told.append(n[:2]))
    assert told == [(100, 120), (120, 120)]


def test_constant_driving_in_a_town_keeps_its_speed_on_curves_and_many_lanes() -> None:
    network = town()
    particles = walkers(network, 12, np.random.default_rng(6), start="nw-n", roads=12)
    futures = record(network, particles, horizon_s=3_600.0, workers=2)
    for k in range(len(particles)):
        driven = [edge for edge, _ in edge_changes(network, futures, k)]
        assert driven == [network.edge_ids[edge] for edge in particles.route(k)]
        knots = slice(futures.first_knot[k], futures.first_knot[k + 1])
        steps = np.hypot(np.diff(futures.x_m[knots]), np.diff(futures.y_m[knots]))
        pace = steps / np.diff(futures.time_s[knots])
        # Thinned by a metre, a bend is cut a little, and never driven faster than drawn.
        assert np.all(pace <= particles.speeds(k)[0] * 1.12 + 2.0)
        assert steps.sum() / (futures.end_s[k] - futures.time_s[knots][0]) == pytest.approx(
            particles.speeds(k)[0], rel=0.03
        )


def exit_times(
    net: Path, particles: Particles, network: RoadNetwork, k: int, folder: Path
) -> list[tuple[str, float]]:
    """Edges and exit times that the bare sumo program writes for one vehicle."""
    route = " ".join(network.edge_ids[edge] for edge in particles.route(k))
    speed = float(particles.speeds(k)[0])
    (folder / "one.rou.xml").write_text(
        f'<routes><vType id="t" maxSpeed="{speed!r}" speedFactor="1" speedDev="0"/>'
        f'<vehicle id="v" type="t" depart="0" departLane="best" departSpeed="desired" '
        f'departPos="{float(particles.start_m[k])!r}"><route edges="{route}"/></vehicle></routes>'
    )
    sumo_environment()
    quiet = ["--no-step-log", "--no-warnings", "--seed", str(session_seed(particles, 0))]
    output = ["--vehroute-output", "routes.xml", "--vehroute-output.exit-times"]
    subprocess.run(
        [binary("sumo"), "-n", net, "-r", "one.rou.xml", *quiet, *output],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    driven = ElementTree.parse(folder / "routes.xml").find("vehicle/route")
    assert driven is not None
    times = map(float, driven.attrib["exitTimes"].split())
    return list(zip(driven.attrib["edges"].split(), times, strict=True))


@pytest.mark.parametrize("place", ["grid", "town"])
def test_free_driving_agrees_with_the_bare_sumo_program(place: str, tmp_path: Path) -> None:
    network = grid5x5() if place == "grid" else town()
    start, roads = ("r0c0-r0c1", 4) if place == "grid" else ("nw-n", 8)
    rng = np.random.default_rng(7)
    particles = walkers(network, 4, rng, start=start, roads=roads, driving="free")
    futures = record(network, particles, horizon_s=GRID_HORIZON_S, workers=1)
    for k in range(len(particles)):
        told = exit_times(network.path, particles, network, k, tmp_path)
        seen = edge_changes(network, futures, k)
        assert [edge for edge, _ in seen] == [edge for edge, _ in told]
        late = np.array([t for _, t in told]) - np.array([t for _, t in seen])
        assert np.all(late[:-1] == 0.0)  # both say the first second after it
        assert 0.0 <= late[-1] <= 1.0  # SUMO rounds up to the step


def test_a_lowered_speed_limit_slows_free_targets_there_and_only_there(tmp_path: Path) -> None:
    folder = Path(str(tmp_path))
    text = (NETS / "town" / "town.edg.xml").read_text()
    lowered = text.replace(
        '<edge id="n-ne" from="n" to="ne" numLanes="1" speed="13.89"',
        '<edge id="n-ne" from="n" to="ne" numLanes="1" speed="4.0"',
    )
    assert lowered != text
    (folder / "slow.edg.xml").write_text(lowered)
    slow = read_net(
        build_net(NETS / "town" / "town.nod.xml", folder / "slow.edg.xml", abstract=False)
    )
    particles = fixed_route(town(), "nw-n n-ne ne-e")
    usual, slowed = (
        dict(edge_changes(net, record(net, particles, horizon_s=3_600.0, workers=1), 0))
        for net in (town(), slow)
    )
    assert slowed["nw-n"] - usual["nw-n"] < 8.0  # SUMO brakes ahead of the sign
    length_m = town().edge_length_m[town().edge_index["n-ne"]]
    took = slowed["n-ne"] - slowed["nw-n"]
    assert length_m / 4.0 < took < 1.4 * length_m / 4.0  # SUMO's driver dawdles below the limit
    assert took > 2 * (usual["n-ne"] - usual["nw-n"])


def test_a_signal_holds_free_targets_and_not_constant_ones() -> None:
    network = town()
    free = fixed_route(network, "nw-n n-centre centre-s")
    waits = []
    for depart_s in np.arange(0.0, 90.0, 10.0):
        delayed = replace(free, depart_s=np.array([depart_s]))
        pair = [replace(delayed, driving=driving) for driving in ("free", "constant")]
        ends = [record(network, p, horizon_s=3_600.0, workers=1).end_s[0] for p in pair]
        waits.append(ends[0] - ends[1])
    assert max(waits) > 15.0  # a red phase
    assert min(waits) < 15.0


def fixed_route(network: RoadNetwork, names: str) -> Particles:
    route = [network.edge_index[name] for name in names.split()]
    return Particles(
        weight=np.ones(1),
        start_m=np.zeros(1),
        depart_s=np.zeros(1),
        first_edge=[0, len(route)],
        route_edge=route,
        speed_mps=np.full(len(route), 13.0),
        seed=np.array([42]),
        gone=np.zeros(1, dtype=bool),
        driving="free",
    )


def test_sumos_own_message_is_shown() -> None:
    network = grid5x5()
    broken = replace(
        walkers(network, 1, np.random.default_rng(8), start="r0c0-r0c1", roads=2),
        route_edge=np.array([network.edge_index["r0c0-r0c1"], network.edge_index["r4c4-r5c4"]]),
    )
    with pytest.raises(SumoError, match=r"r0c0-r0c1.*r4c4-r5c4|[Nn]o connection"):
        record(network, broken, horizon_s=100.0, workers=1)


def test_one_place_says_how_particles_are_driven(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    grid, streets = grid5x5(), town()
    rng = np.random.default_rng(1)
    on_grid = walkers(grid, 2, rng, start="r0c0-r0c1", roads=2)
    in_streets = walkers(streets, 2, rng, start="n-centre", roads=2)  # of two lanes
    assert way_of(grid, on_grid).together
    for network, particles, why in (
        (grid, replace(on_grid, driving="free"), "signals"),
        (streets, in_streets, "several lanes"),
    ):
        way = way_of(network, particles)
        assert not way.together
        assert "one fork of a loaded session each" in way.why
        assert why in way.why
    monkeypatch.setattr("planner.futures.record.CAN_FORK", False)
    record(streets, in_streets, horizon_s=5.0, workers=1)
    assert "cannot fork" in caplog.text
    assert "loaded anew" in way_of(streets, in_streets).why


def test_who_never_moves_is_told_of(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    text = town().path.read_text(encoding="utf-8")
    red = re.sub(r'(<phase [^>]*state=")\w+"', lambda m: m[1] + 20 * "r" + '"', text)
    assert red != text
    (tmp_path / "red.net.xml").write_text(red, encoding="utf-8")
    network = read_net(tmp_path / "red.net.xml")
    length_m = network.edge_length_m[network.edge_index["n-centre"]]
    two = walkers(network, 2, np.random.default_rng(1), start="n-centre", roads=2, driving="free")
    route = [network.edge_index[name] for name in ("n-centre", "centre-s")]
    near = replace(two, route_edge=route * 2, start_m=[length_m - 1.2, 5.0])
    record(network, near, horizon_s=600.0, workers=1)
    assert "1 of 2 particles stand where they start" in caplog.text
    caplog.clear()
    record(town(), near, horizon_s=600.0, workers=1)
    assert "stand where" not in caplog.text
