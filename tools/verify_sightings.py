"""Read a certified run and tell who sees whom, for verify.py: shares no code with the planner."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from pyarrow.parquet import read_table

PLANNED = ("horizon_s", "radius_m", "found_by_s")
CERTIFIED = ("plan_class", "transit", "speed_mps", "landing_s", "bin_s")


def motions(time: Any, place: Any, begin: float, end: float) -> list[Any]:
    """Return the motions along a path between two times: from, to, place at from, velocity."""
    velocity = np.diff(place) / np.maximum(np.diff(time), 1e-9)
    on, off = np.maximum(time[:-1], begin), np.minimum(time[1:], end)
    moves = zip(on, off, place[:-1] + velocity * (on - time[:-1]), velocity, strict=True)
    return [move for move in moves if move[0] <= move[1]]


class Sightings(SimpleNamespace):
    """The files of a certified run, and who sees whom."""

    def __init__(self, folder: Path) -> None:
        plan, net = (json.loads((folder / name).read_text()) for name in ("plan.json", "net.json"))
        names = ("motion.parquet", "weights.parquet", "prices.parquet")
        motion, weights, prices = (read_table(folder / n).to_pydict().values() for n in names)
        self.planned, self.certificate = plan["planned"], plan["certificate"]
        self.assumed = {key: self.planned.get(key) for key in PLANNED}
        self.assumed |= {key: self.certificate[key] for key in CERTIFIED}
        super().__init__(**self.assumed, **{key: net[key] for key in ("node_xy_m", "roads")})
        self.time, x, y = np.array(plan["uavs"][0]["waypoints"]).T
        self.path, self.on = x + 1j * y, plan["uavs"][0]["sensor_on"]  # places: complex numbers
        self.place = np.append(self.node_xy_m @ np.array([1, 1j]), self.path[0])  # nodes, take-off
        self.who, begin, end, x, y, vx, vy = map(np.array, motion)
        self.pieces, self.nodes = (begin, end, x + 1j * y, vx + 1j * vy), len(self.node_xy_m)
        self.weight = np.array(*weights)
        self.prices = {tuple(hops): np.array(price) for hops, price in zip(*prices, strict=True)}

    def reward(self, at: Any) -> Any:
        """Return what sightings at some times are worth."""
        return at <= self.found_by_s if self.found_by_s else np.maximum(0, self.horizon_s - at)

    def sweep(self, moves: Any, starts: Any, radius: float, growth: float = 0.0) -> Any:
        """Return when motions, begun at each start, have whom in a growing radius, (starts, N)."""
        seen = np.full((len(starts), len(self.weight)), np.inf)
        for begin, end, origin, u in moves:
            a, b, place, v = self.pieces
            half = (np.minimum(b, starts[-1] + end) - a) / 2
            middle, far = place + v * half - origin, radius + growth * end + abs(v) * half + 1e-3
            passed = np.clip((middle * np.conj(u)).real / max(abs(u) ** 2, 1e-9), 0, end - begin)
            low, high = np.searchsorted(starts, [a - end - 1e-6, a + 2 * half - begin + 1e-6])
            many = np.where(abs(middle - u * passed) <= far, np.maximum(0, high - low), 0)
            p = np.repeat(np.arange(len(a)), many)
            i = np.arange(len(p)) + (low - np.cumsum(many) + many)[p]
            a, b, place, v = (column[p] for column in self.pieces)
            on, off = np.maximum(starts[i] + begin, a), np.minimum(starts[i] + end, b)
            flown, drift = on - starts[i] - begin, v - u
            offset, reach = place + v * (on - a) - origin - u * flown, radius + growth * flown
            turned, away = np.conj(offset) * drift, abs(offset) ** 2  # for |offset + drift t|
            root = (np.conj(drift) * drift).real * reach**2 - turned.imag**2
            root += growth * (growth * away - 2 * turned.real * reach)
            after = (away - reach**2) / (growth * reach - turned.real + np.sqrt(root))
            after = np.where(away <= reach**2, 0, np.where(after >= 0, after, np.inf))
            met = np.where((on <= off) & (after <= off - on), on + after, np.inf)
            np.minimum.at(seen, (i, self.who[p]), met)
        return seen
