"""Motion from elsewhere is read: a table of a thousand vehicles at a thousand times, in each form.

Seconds are those of one core at work, so that a busy machine measures the same. With another
checkout to compare with, both read in turn, each time in a process of its own.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.figures import Figure
from planner import RoadNetwork, open_scenario, stream
from planner.arrays import Floats, Ints

ROOT = Path(__file__).resolve().parents[2]
GRID = "grid5x5"
VEHICLES, TIMES, STEP_S = 1000, 1000, 10.0
AT_MOST = 1.1  # times what the other checkout takes

READER = """
import sys, time
from pathlib import Path
from planner import open_scenario, read_recording
network = open_scenario(sys.argv[1]).network
file = Path(sys.argv[2])
read_recording(file.with_name("few.parquet"), network)  # what is imported once is not counted
begun = time.process_time()
read_recording(file, network)
print(time.process_time() - begun)
"""


def reading(repeats: int, against: Path | None = None) -> Iterator[Figure]:
    """Read 1,000 vehicles x 1,000 rows as FCD Parquet, FCD XML and futures.parquet."""
    with TemporaryDirectory() as folder:
        for file in write_files(Path(folder)):
            ours, theirs = [], []
            for _ in range(repeats):
                ours.append(_cpu_s(ROOT, file))
                if against is not None:
                    theirs.append(_cpu_s(against.resolve(), file))
            yield Figure(file.name, "CPU s", tuple(ours))
            if theirs:
                yield Figure(f"{file.name}, the other checkout", "CPU s", tuple(theirs))
                times = np.median(ours) / np.median(theirs)
                yield Figure(f"{file.name}, medians", "times", (float(times),), at_most=AT_MOST)


def _cpu_s(checkout: Path, file: Path) -> float:
    said = {**os.environ, "PYTHONPATH": str(checkout)}
    command = [sys.executable, "-c", READER, GRID, str(file)]
    done = subprocess.run(command, env=said, capture_output=True, text=True, check=True)
    return float(done.stdout)


def write_files(folder: Path) -> tuple[Path, ...]:
    """Return the files to read, written into a folder, and write a small one beside them."""
    import pyarrow
    import pyarrow.parquet

    network = open_scenario(GRID).network
    edge, along_m, speed_mps = _drives(network)
    xy_m, time_s = network.edge_xy(edge, along_m), STEP_S * np.arange(TIMES)
    lanes = np.array([f"{name}_0" for name in network.edge_ids], dtype=object)
    names = np.array([f"vehicle{k}" for k in range(VEHICLES)], dtype=object)
    # As SUMO writes them, step by step.
    columns = {
        "timestep_time": np.repeat(time_s, VEHICLES),
        "vehicle_id": np.tile(names, TIMES),
        "vehicle_x": xy_m[..., 0].T.ravel(),
        "vehicle_y": xy_m[..., 1].T.ravel(),
        "vehicle_speed": speed_mps.T.ravel(),
        "vehicle_pos": along_m.T.ravel(),
        "vehicle_lane": lanes[edge.T.ravel()],
    }
    knots = {
        "particle": np.repeat(np.arange(VEHICLES), TIMES),
        "time_s": np.tile(time_s, VEHICLES),
        "x_m": xy_m[..., 0].ravel(),
        "y_m": xy_m[..., 1].ravel(),
        "edge": pyarrow.array(np.array(network.edge_ids)[edge.ravel()]).dictionary_encode(),
    }
    files = folder / "fcd.parquet", folder / "fcd.xml", folder / "futures.parquet"
    table = pyarrow.table({name: pyarrow.array(column) for name, column in columns.items()})
    pyarrow.parquet.write_table(table, files[0])
    pyarrow.parquet.write_table(table.slice(0, 2 * VEHICLES), folder / "few.parquet")
    _write_xml(files[1], columns)
    pyarrow.parquet.write_table(pyarrow.table(knots), files[2], compression="zstd")
    return files


def _drives(network: RoadNetwork) -> tuple[Ints, Floats, Floats]:
    """Return edges, metres on them and speeds, each (VEHICLES, TIMES), of drives at random."""
    rng = stream(1, "benchmark", "reading")
    edge = np.empty((VEHICLES, TIMES), dtype=np.int64)
    along_m, speed_mps = np.zeros((2, VEHICLES, TIMES))
    for k, drawn_mps in enumerate(rng.uniform(15.0, 25.0, VEHICLES)):
        on, at_m = int(rng.integers(len(network.edge_ids))), 0.0
        for i in range(TIMES):
            onward = network.turns(on)
            if at_m > network.edge_length_m[on] and len(onward):
                at_m -= network.edge_length_m[on]
                on = int(rng.choice(onward))
            moves = at_m <= network.edge_length_m[on]
            at_m = min(at_m, float(network.edge_length_m[on]))
            edge[k, i], along_m[k, i], speed_mps[k, i] = on, at_m, drawn_mps if moves else 0.0
            at_m += STEP_S * drawn_mps
    return edge, along_m, speed_mps


def _write_xml(path: Path, columns: dict[str, Any]) -> None:
    with path.open("w", encoding="utf-8") as file:
        file.write("<fcd-export>\n")
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        for number, (time_s, name, x, y, speed, pos, lane) in enumerate(rows):
            if number % VEHICLES == 0:
                file.write(f'{"</timestep>" if number else ""}\n<timestep time="{time_s:.2f}">\n')
            file.write(
                f'<vehicle id="{name}" x="{x:.2f}" y="{y:.2f}" angle="90.00" type="t" '
                f'speed="{speed:.2f}" pos="{pos:.2f}" lane="{lane}" slope="0.00"/>\n'
            )
        file.write("</timestep>\n</fcd-export>\n")
