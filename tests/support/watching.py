"""Functions that watch the traffic where a user's own would steer it; they write step by step."""

import os
from pathlib import Path
from typing import Any

from planner.futures.rider import OURS

FILE = "WATCHED"  # the variable that names the file


def _write(said: str) -> None:
    with Path(os.environ[FILE]).open("a", encoding="utf-8") as file:
        file.write(f"{said}\n")


def arrivals(libsumo: Any) -> None:
    """Write who has arrived in the step before, but for particles."""
    names = libsumo.simulation.getArrivedIDList()
    _write(str(sum(not name.startswith(OURS) for name in names)))


def lights(libsumo: Any) -> None:
    """Write the time, and what all signals show."""
    shown = [
        libsumo.trafficlight.getRedYellowGreenState(name)
        for name in sorted(libsumo.trafficlight.getIDList())
    ]
    _write(f"{libsumo.simulation.getTime():g} {'|'.join(shown)}")
