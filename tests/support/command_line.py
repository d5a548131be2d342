"""The command line as tests use it, and plans flown again by hand."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest

from planner.arrays import Floats
from planner.cli import main

TOWN = str(Path(__file__).parents[1] / "nets" / "town")


@dataclass(frozen=True)
class Said:
    """What a command answered."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The answer of a command with --json, which says nothing else."""
        assert self.code == 0, self.err
        return json.loads(self.out)


class Commands:
    """Runs commands in this process."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, *arguments: object) -> Said:
        self._capsys.readouterr()
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as ended:
            code = int(str(ended.code))
        said = self._capsys.readouterr()
        return Said(code, said.out, said.err)


def in_a_process(*arguments: object, timeout_s: float = 120.0, **environment: str) -> Said:
    """Run ``python -m planner`` as a user does."""
    done = subprocess.run(
        [sys.executable, "-m", "planner", *map(str, arguments)],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        check=False,
        timeout=timeout_s,
    )
    return Said(done.returncode, done.stdout, done.stderr)


def rows(path: Path) -> dict[str, Any]:
    """Columns of a Parquet file."""
    columns: dict[str, Any] = pyarrow.parquet.read_table(path).to_pydict()
    return columns


def flown_by_hand(plan: Mapping[str, Any], folder: Path) -> tuple[Floats, Floats]:
    """Times at which recorded particles are first seen, inf: never, and their weights.

    From the waypoints, the sensor's times and the knots in the files alone.
    """
    knots, particles = rows(folder / "futures.parquet"), rows(folder / "particles.parquet")
    (uav,) = plan["uavs"]
    flight = np.array(uav["waypoints"])
    particle = np.array(knots["particle"])
    motion = np.array([knots["time_s"], knots["x_m"], knots["y_m"]]).T
    last_s = plan["planned"]["horizon_s"] + 1.0
    seen = [
        _first_seen(
            flight,
            uav["sensor_on"],
            motion[particle == k],
            motion[particle == k][-1, 0] if at_end == "gone" else last_s,
            plan["planned"]["radius_m"],
        )
        for k, at_end in enumerate(particles["at_end"])
    ]
    return np.array(seen), np.array(particles["weight"])


def _first_seen(
    flight: Floats,
    sensor_on: Sequence[Sequence[float]],
    motion: Floats,
    there_s: float,
    radius: float,
) -> float:
    for from_s, to_s in sensor_on:
        begin, end = max(from_s, motion[0, 0], flight[0, 0]), min(to_s, there_s, flight[-1, 0])
        turns = np.concatenate([flight[:, 0], motion[:, 0]])
        times = [begin, *np.unique(turns[(turns > begin) & (turns < end)]), end]
        for a, b in pairwise(times):
            inside = _inside(_apart(flight, motion, a), _apart(flight, motion, b), radius)
            if a <= b and inside is not None:
                return float(a + inside * (b - a))
    return np.inf


def _apart(flight: Floats, motion: Floats, time_s: float) -> Floats:
    return np.array(
        [
            np.interp(time_s, flight[:, 0], flight[:, i])
            - np.interp(time_s, motion[:, 0], motion[:, i])
            for i in (1, 2)
        ]
    )


def _inside(before: Floats, after: Floats, radius: float) -> float | None:
    """Share of a straight relative motion after which it is within a circle."""
    if before @ before <= radius**2:
        return 0.0
    step = after - before
    square, middle = step @ step, before @ step
    under = middle**2 - square * (before @ before - radius**2)
    if square == 0.0 or under < 0.0 or middle >= 0.0:
        return None
    share = (-middle - np.sqrt(under)) / square
    return float(share) if share <= 1.0 else None


def expected_s(seen: Floats, weight: Floats, horizon_s: float) -> float:
    """E[min(tau, horizon)], where missing weight is a target that is not there."""
    return float(weight @ np.minimum(seen, horizon_s)) + (1 - float(weight.sum())) * horizon_s
