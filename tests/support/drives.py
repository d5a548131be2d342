"""SUMO drives of particles, each alone on a freshly loaded net: a witness to hold clocks against.

As a program: ``python -m tests.support.drives DRIVES.npz POSITIONS.npz``. One loaded net serves all
particles: it steps on to the second at which a particle starts, and a forked child drives it.
"""

import os
import subprocess
import sys
from array import array
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from planner.belief.particles import Particles
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork

ROOT = Path(__file__).parents[2]


def driven(network: RoadNetwork, particles: Particles, *, horizon_s: int) -> Futures:
    """Return where SUMO has particles, second for second; those that never enter have no knot."""
    with TemporaryDirectory() as folder:
        asked, told = Path(folder, "drives.npz"), Path(folder, "positions.npz")
        np.savez(
            asked,
            net=str(network.path),
            horizon_s=horizon_s,
            edge_ids=np.array(network.edge_ids),
            first_edge=particles.first_edge,
            route_edge=particles.route_edge,
            speed_mps=particles.speed_mps,
            start_m=np.minimum(
                particles.start_m,
                network.edge_length_m[particles.route_edge[particles.first_edge[:-1]]] - 0.1,
            ),
            phase_s=particles.phase_s,
        )
        command = [sys.executable, "-m", "tests.support.drives", str(asked), str(told)]
        subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
        with np.load(told) as columns:
            xy_m, count = columns["xy_m"], columns["count"]
    first = np.concatenate(([0], np.cumsum(count)))
    return Futures(
        time_s=np.arange(len(xy_m)) - np.repeat(first[:-1], count),
        x_m=xy_m[:, 0],
        y_m=xy_m[:, 1],
        first_knot=first,
        weight=particles.weight,
        gone=particles.gone,
    )


def main(asked: str, told: str) -> None:
    """Drive all particles and write their positions."""
    import libsumo

    with np.load(asked) as columns:
        drives = {name: columns[name] for name in columns.files}
    options = ["--no-step-log", "--no-warnings", "--time-to-teleport", "-1"]
    options += ["--collision.action", "none", "--seed", "7"]
    libsumo.start(["sumo", "-n", str(drives["net"]), *options])
    libsumo.vehicletype.copy("DEFAULT_VEHTYPE", "particle")
    libsumo.vehicletype.setSpeedDeviation("particle", 0.0)
    found: dict[int, bytes] = {}
    now_s = 0
    for k in np.argsort(drives["phase_s"], kind="stable").tolist():
        while now_s < drives["phase_s"][k]:
            libsumo.simulationStep()
            now_s += 1
        found[k] = _in_a_child(libsumo, drives, k)
    xy_m = np.frombuffer(b"".join(found[k] for k in range(len(found)))).reshape(-1, 2)
    count = [len(found[k]) // 16 for k in range(len(found))]
    np.savez(told, xy_m=xy_m, count=count)
    os._exit(0)


def _in_a_child(libsumo: Any, drives: dict[str, Any], k: int) -> bytes:
    read, write = os.pipe()
    if os.fork() == 0:
        with os.fdopen(write, "wb") as pipe:
            pipe.write(_drive(libsumo, drives, k))
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        positions = pipe.read()
    os.wait()
    return positions


def _drive(libsumo: Any, drives: dict[str, Any], k: int) -> bytes:
    route = slice(*drives["first_edge"][k : k + 2])
    edges = [str(drives["edge_ids"][edge]) for edge in drives["route_edge"][route]]
    libsumo.route.add("route", edges)
    libsumo.vehicletype.setMaxSpeed("particle", float(drives["speed_mps"][route][0]))
    libsumo.vehicle.add(
        "particle",
        "route",
        typeID="particle",
        depart="now",
        departLane="best",
        departPos=f"{drives['start_m'][k]:.2f}",
        departSpeed="desired",
    )
    positions = array("d")
    for _ in range(int(drives["horizon_s"]) + 1):
        libsumo.simulationStep()
        if "particle" not in libsumo.vehicle.getIDList():
            break
        positions.extend(libsumo.vehicle.getPosition("particle"))
    return positions.tobytes()


if __name__ == "__main__":
    main(*sys.argv[1:])
