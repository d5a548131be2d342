"""Detection against SUMO's raw floating car data at 0.1 s, which never became futures."""

import subprocess
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from planner.belief.particles import Particles
from planner.detection.first_detection import first_detection
from planner.flight.track import Track
from planner.futures.record import record
from planner.network.road_network import RoadNetwork
from planner.network.sumo import binary, sumo_environment
from support.sumo_instances import grid5x5, walkers

TICK_S = 0.1
RADIUS_M = 500.0


def raw_positions(
    network: RoadNetwork, particles: Particles, k: int, folder: Path
) -> tuple[np.ndarray, np.ndarray]:
    """Times (T,) and places (T, 2) that the bare sumo program files for one particle."""
    route = " ".join(network.edge_ids[edge] for edge in particles.route(k))
    speed = float(particles.speeds(k)[0])
    (folder / "one.rou.xml").write_text(
        f'<routes><vType id="t" sigma="0" maxSpeed="{speed!r}" speedFactor="1" speedDev="0"/>'
        f'<vehicle id="v" type="t" depart="0" departSpeed="desired" '
        f'departPos="{float(particles.start_m[k])!r}"><route edges="{route}"/></vehicle></routes>'
    )
    sumo_environment()
    options = [
        "--fcd-output",
        "fcd.xml",
        "--step-length",
        str(TICK_S),
        "--end",
        "1500",
        "--no-step-log",
    ]
    subprocess.run(
        [binary("sumo"), "-n", network.path, "-r", "one.rou.xml", *options],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    rows = [
        (float(step.attrib["time"]), float(vehicle.attrib["x"]), float(vehicle.attrib["y"]))
        for step in ElementTree.parse(folder / "fcd.xml").iter("timestep")
        for vehicle in step
    ]
    times, x, y = np.array(rows).T
    return times, np.stack([x, y], axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_first_sighting_agrees_with_raw_samples(seed: int, tmp_path: Path) -> None:
    network = grid5x5()
    rng = np.random.default_rng(seed)
    particles = walkers(network, 3, rng, start="r0c0-r0c1", roads=3)
    futures = record(network, particles, horizon_s=1_500.0, workers=1)
    corners = rng.uniform((0, -12_000), (30_000, 3_000), (6, 2))
    corners[2] = (15_000, 0)  # the node where all of them turn
    legs_s = np.linalg.norm(np.diff(corners, axis=0), axis=1) / 100.0
    track = Track(np.concatenate(([0.0], np.cumsum(legs_s))), *corners.T, [[0.0, 1e5]])
    seen_at = first_detection(futures, track, RADIUS_M)
    for k in range(len(particles)):
        times, places = raw_positions(network, particles, k, tmp_path)
        off_m = np.linalg.norm(places - track.xy(times), axis=1)
        inside = times[off_m <= RADIUS_M]
        # In a tick both move at most 0.1 s * (100 + 25) m/s; SUMO files whole centimetres.
        slack_m = TICK_S * 125.0 + 0.02
        if np.isinf(seen_at[k]):
            assert np.nanmin(off_m) > RADIUS_M - 0.02
        else:
            assert seen_at[k] <= (inside[0] if len(inside) else np.inf) + 0.01
            near = off_m[np.abs(times - seen_at[k]) <= TICK_S]
            assert near.min() <= RADIUS_M + slack_m
