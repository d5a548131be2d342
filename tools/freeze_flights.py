"""Write the test flights: a small instance, 20 flights in it, and their scores by tools/score.py.

Nothing is simulated: vehicles keep their speeds on a grid of streets, some are gone at its edge,
and some do not exist. Tests hold the scores against the program and against a slow twin.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from score import score

from planner import Futures
from planner.experiments.licences import INVENTED
from planner.experiments.portable import OF_TESTS, rounded, write_futures, write_text
from planner.files import json_text
from planner.futures.even_speed import Drive, at_even_speed
from planner.network.straight_roads import grid

FOLDER = Path(__file__).parents[1] / "docs" / "instances" / "test"
NODES, ROAD_M, VEHICLES, HORIZON_S = 4, 400.0, 300, 600.0
UAVS = (  # place, take-off, speed, landing, and where it lands
    (-500.0, 300.0, 20.0, 25.0, None, None),
    (0.0, -1500.0, 0.0, 15.0, 500.0, None),
    (1400.0, 200.0, 60.0, 40.0, 560.0, [1400.0, 200.0]),
)
DETECTS = (1.0, 0.9, 0.5, 0.1)
DIGITS = 6


def futures() -> Futures:
    """Return vehicles that drive east and south; of ten, nine exist."""
    rng = np.random.default_rng(2026)
    network, routes, drives = grid(NODES, NODES, road_m=ROAD_M), [], []
    for _ in range(VEHICLES):
        row, column, route = 0, 0, []
        for way in rng.permutation(list("eeesss"))[: rng.integers(1, 7)].tolist():
            to = (row, column + 1) if way == "e" else (row + 1, column)
            route.append(f"r{row}c{column}-r{to[0]}c{to[1]}")
            row, column = to
        routes.append(route)
        start_m, speed_mps, depart_s = rng.uniform(0, 200), rng.uniform(3, 14), rng.uniform(0, 40)
        drives.append(Drive(float(start_m), float(speed_mps), float(depart_s)))
    weight = rng.uniform(1.0, 3.0, VEHICLES)
    gone = rng.random(VEHICLES) < 0.4
    weight *= 0.9 / weight.sum()
    return rounded(at_even_speed(network, routes, drives, gone=gone.tolist(), weight=weight))


def instance() -> dict[str, Any]:
    """Return what instance.json holds."""
    network = grid(NODES, NODES, road_m=ROAD_M)
    names = ("x_m", "y_m", "take_off_s", "speed_mps", "landing_s", "return_to_m")
    ends = zip(network.road_ids, network.road_from, network.road_to, strict=True)
    return {
        "schema": "planner.instance/1",
        "name": "test",
        "licence": "Apache-2.0",
        "made_by": "tools/freeze_flights.py",
        "horizon_s": HORIZON_S,
        "sensor": {"radius_m": 60.0, "detects": 1.0},
        "uavs": [dict(zip(names, uav, strict=True)) for uav in UAVS],
        "network": {"sha256": network.sha256, "projection": None, "net_offset_m": [0.0, 0.0]},
        "nodes": [
            {"id": name, "x_m": x_m, "y_m": y_m}
            for name, (x_m, y_m) in zip(network.node_ids, network.node_xy_m.tolist(), strict=True)
        ],
        "roads": [
            {
                "id": name,
                "from": network.node_ids[start],
                "to": network.node_ids[end],
                "both_ways": False,
                "line_m": network.shape(road).tolist(),
            }
            for road, (name, start, end) in enumerate(ends)
        ],
        "bound": None,
    }


def way(number: int, rng: np.random.Generator) -> list[list[float]]:
    """Return the waypoints of one UAV: a few random points, at most of its speed, with stops."""
    x_m, y_m, time_s, speed_mps, landing_s, home = UAVS[number]
    last_s = min(HORIZON_S + 50.0, np.inf if landing_s is None else float(landing_s))
    points = [[time_s, x_m, y_m]]
    while True:
        place = rng.uniform([-100, -1300], [1300, 100])
        takes_s = np.hypot(*(place - points[-1][1:])) / speed_mps * rng.choice([1.0, 1.0, 1.5])
        back_s = 0.0 if home is None else np.hypot(*(place - home)) / speed_mps
        if points[-1][0] + takes_s + back_s > last_s:
            break
        points.append([points[-1][0] + float(takes_s), *map(float, place)])
        if rng.random() < 0.3 and points[-1][0] + 40.0 + back_s < last_s:
            points.append([points[-1][0] + 40.0, *map(float, place)])
    if home is not None:
        away_s = float(np.hypot(*np.subtract(points[-1][1:], home))) / speed_mps
        points.append([points[-1][0] + away_s, *home])
    return [[round(number, 4) for number in point] for point in points]


def flights() -> list[dict[str, Any]]:
    """Return 20 flights: one to three UAVs, four sensors; one that sees nothing, one that waits."""
    rng = np.random.default_rng(7)
    found = []
    for number in range(18):
        uavs, detects = 1 + number % 3, DETECTS[number % 4]
        ways = [{"waypoints": way(uav, rng)} for uav in range(uavs)]
        name = f"{uavs} UAV{'s' * (uavs > 1)}, p = {detects:g}, {number:02}"
        found.append({"name": name, "detects": detects, "uavs": ways})
    start = [UAVS[0][2], UAVS[0][0], UAVS[0][1]]
    away = {"waypoints": [start, [620.0, -9500.0, 300.0]]}
    waits = {"waypoints": [start, [60.0, 400.0, 0.0], [700.0, 400.0, 0.0]]}
    found.append({"name": "flies away", "detects": 1.0, "uavs": [away]})
    found.append({"name": "waits where vehicles set out, p = 0.5", "detects": 0.5, "uavs": [waits]})
    return found


def main() -> None:
    """Write the folder."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=FOLDER)
    folder = parser.parse_args().output
    about, futures_file, flights_file, notice = (folder / name for name in OF_TESTS)
    folder.mkdir(parents=True, exist_ok=True)
    write_futures(futures_file, futures())
    write_text(about, json_text(instance()))
    with np.load(futures_file) as file:
        columns = dict(file)
    scored = flights()
    for flight in scored:
        found = score(instance(), flight, columns, flight["detects"])
        flight["score"] = json.loads(
            json.dumps(found), parse_float=lambda x: round(float(x), DIGITS)
        )
    lines = ",\n".join(json.dumps(flight) for flight in scored)
    write_text(flights_file, f"[\n{lines}\n]\n")
    write_text(notice, INVENTED)


if __name__ == "__main__":
    main()
