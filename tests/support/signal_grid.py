"""A grid of streets with fixed signals, as netgenerate makes it."""

import os
import subprocess
from functools import cache
from pathlib import Path

from planner.network.read import read_net
from planner.network.road_network import RoadNetwork
from planner.network.sumo import binary, sumo_environment

MADE = "--grid --grid.number 5 --grid.length 220 -L 2 --default-junction-type traffic_light"


def signal_grid() -> RoadNetwork:
    """Five by five junctions, two lanes each way."""
    return _signal_grid(os.environ["PLANNER_CACHE"])


@cache
def _signal_grid(cache_folder: str) -> RoadNetwork:
    path = Path(cache_folder, "signal_grid.net.xml")
    if not path.exists():
        sumo_environment()
        path.parent.mkdir(parents=True, exist_ok=True)
        new = path.with_name(f"{os.getpid()}-{path.name}")
        command = [str(binary("netgenerate")), *MADE.split(), "-o", str(new)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        new.replace(path)
    return read_net(path)
