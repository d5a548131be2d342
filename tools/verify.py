"""Check a certified plan without the code that made it: verify.py DIR.

Computes its figures and the bound of planner/search/bound.py and branches.py anew, and says
whether the claims hold (exit code 0) or not (1). The bound may be tighter than is claimed.
"""

import argparse
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet


def motions(path: Any, begin: float, end: float) -> Any:
    """Return motions (from, to, place at from, velocity) along rows of time, x and y."""
    step = np.diff(path, axis=0)
    velocity = step[:, 1:] / np.maximum(step[:, :1], 1e-9)
    on, off = np.maximum(path[:-1, 0], begin), np.minimum(path[1:, 0], end)
    place = path[:-1, 1:] + velocity * (on - path[:-1, 0])[:, None]
    return np.column_stack([on, off, place, velocity])[on < off]


class Run(SimpleNamespace):
    """A certified plan, its claims, the particles, the net and the prices."""

    def __init__(self, folder: Path) -> None:
        plan, net = (json.loads((folder / name).read_text()) for name in ("plan.json", "net.json"))
        names = ("motion.parquet", "weights.parquet", "prices.parquet")
        tables = [pyarrow.parquet.read_table(folder / name).to_pydict() for name in names]
        super().__init__(**{"found_by_s": None, **plan["planned"], **plan["certificate"], **net})
        self.flight, self.on = (np.array(plan["uavs"][0][n]) for n in ("waypoints", "sensor_on"))
        self.place = np.array([*self.node_xy_m, self.flight[0, 1:]])  # nodes, then the take-off
        self.who, *self.pieces = map(np.array, tables[0].values())
        self.weight, prices = np.array(tables[1]["weight"]), zip(*tables[2].values(), strict=True)
        self.prices = {tuple(hops): np.array(price) for hops, price in prices}

    def reward(self, seen: Any) -> Any:
        """Return what sightings at some times are worth."""
        by = self.found_by_s
        return np.maximum(0, self.horizon_s - seen) if by is None else seen <= by

    def sweep(self, moves: Any, starts: Any, radius: float, growth: float = 0.0) -> Any:
        """Return when motions, begun at each start, have whom in a growing radius, (starts, N)."""
        seen = np.full((len(starts), len(self.weight)), np.inf)
        for begin, end, x, y, ux, uy in moves:
            a, b, px, py, pu, pv = self.pieces
            half = (np.minimum(b, starts[-1] + end) - a) / 2
            dx, dy, far = px + pu * half - x, py + pv * half - y, np.hypot(pu, pv) * half
            passed = np.clip((dx * ux + dy * uy) / max(ux**2 + uy**2, 1e-9), 0, end - begin)
            far += radius + growth * end + 1e-3
            low, near = (
                np.searchsorted(starts, a - end - 1e-6),
                np.hypot(dx - ux * passed, dy - uy * passed) <= far,
            )
            many = np.searchsorted(starts, a + 2 * half - begin + 1e-6) - low
            many = np.where(near, np.maximum(0, many), 0)
            p = np.repeat(np.arange(len(a)), many)
            i = np.arange(len(p)) + (low - np.cumsum(many) + many)[p]
            a, b, px, py, pu, pv = (column[p] for column in self.pieces)
            on, off = np.maximum(starts[i] + begin, a), np.minimum(starts[i] + end, b)
            flown, vx, vy = on - starts[i] - begin, pu - ux, pv - uy
            dx, dy = px + pu * (on - a) - x - ux * flown, py + pv * (on - a) - y - uy * flown
            reach, away, nearing = radius + growth * flown, dx**2 + dy**2, -(dx * vx + dy * vy)
            root = (vx**2 + vy**2) * reach**2 - (dx * vy - dy * vx) ** 2
            root += growth * (growth * away + 2 * nearing * reach)
            after = (away - reach**2) / (nearing + growth * reach + np.sqrt(root))
            after = np.where(away <= reach**2, 0, np.where(after >= 0, after, np.inf))
            met = np.where((on <= off) & (after <= off - on), on + after, np.inf)
            np.minimum.at(seen, (i, self.who[p]), met)
        return seen

    def direct(self, a: int, b: int) -> bool:
        """Tell whether a straight flight is no leg and no two flights, as over a node."""
        way, away, nodes = (
            self.place[b] - self.place[a],
            self.place[:-1] - self.place[a],
            len(self.node_xy_m),
        )
        along, aside, far = away @ way, np.abs(away @ (-way[1], way[0])), way @ way
        after = along > (1e-6 * far if a < nodes else -1e-6)  # at take-off, the node there
        over = after & (along < (1 - 1e-6) * far) & (aside < 1e-9 * far)
        return (a, b) not in self.straight and (far > 0 or a == nodes) and not over.any()

    def list_hops(self) -> None:
        """List what plans consist of: legs, straight flights, and those from take-off."""
        place, nodes, rest, self.paths = self.place, len(self.place) - 1, self.bin_s, []
        hops = [(a, b, [place[a], *points[1:-1], place[b]]) for a, b, points in self.roads]
        self.legs, self.straight = len(hops), {(a, b) for a, b, xy in hops if len(xy) == 2}
        hops += [
            (a, b, place[[a, b]]) for a, b in np.ndindex(nodes + 1, nodes) if self.direct(a, b)
        ]
        for *_, points in hops:  # with rests at both ends
            far = np.hypot(*np.diff(points, axis=0).T) / self.speed_mps
            after = np.cumsum([-rest, rest, *far, rest])
            self.paths.append(np.column_stack([after, np.pad(points, ((1, 1), (0, 0)), "edge")]))
        self.start, self.end = np.array([ends for *ends, _ in hops]).T
        self.state = np.r_[nodes + 1 : nodes + 1 + self.legs, self.end[self.legs :]]  # afterwards
        self.lasts, self.hops = np.array([p[-2, 0] for p in self.paths]), sum(self.start < nodes)
        bins = self.lasts / rest
        self.lasting = np.array([np.floor(bins + 1e-9), np.ceil(bins - 1e-9)]).astype(int)

    def seen_on(self, h: int, starts: Any, rest: float = 0.0) -> Any:
        """Return when a hop may see whom, or, with less than no rest, surely sees."""
        path = self.paths[h][: None if h < self.legs or self.transit else 0]
        moves = motions(path, -rest, self.lasts[h] + rest)
        return self.sweep(moves, starts, self.radius_m + self.speed_mps * rest)

    def list_sales(self, starts: Any, least: Any) -> Any:
        """Return all sales: row (a hop, or what it shares with a leg before), bin, who, reward."""
        sure = [np.isfinite(self.seen_on(h, starts, -self.bin_s / 2)) for h in range(self.legs)]
        sales, shared = [], []
        self.steps = [(self.start[h], h, -1) for h in range(self.hops)]  # state, hop, row shared
        for h in range(self.hops):
            earned = self.reward(self.seen_on(h, starts, self.bin_s / 2))
            i, k = np.nonzero(earned > least)
            sales.append([0 * i + h, i, k, earned[i, k]])
            for g in np.flatnonzero(self.end[: self.legs] == self.start[h]):
                late, early = i - self.lasting[:, g, None]
                known = (early >= 0) & sure[g][late, k] & sure[g][early, k]
                shared.append([column[known] for column in sales[-1]])
                shared[-1][0] += len(self.steps) - h
                self.steps.append((self.state[g], h, len(self.steps)))
        return [np.concatenate(columns) for columns in zip(*sales, *shared, strict=True)]

    def worths(self, sales: Any, price: Any, since: int) -> Any:
        """Return the most that flights from each bin and state on earn above prices."""
        (row, i, k, earned), (before, hop, share) = sales, np.array(self.steps).T
        above, shape = self.weight[k] * np.maximum(0, earned - price[k]), (self.bins, len(hop) + 1)
        gains = np.bincount(i * shape[1] + row, above, np.prod(shape)).reshape(shape)
        to, (soon, late) = self.state[: self.hops], self.lasting[:, : self.hops]
        worth = np.zeros((self.bins + late.max() + 1, max(self.state) + 1))
        for i in range(self.bins - 1, since - 1, -1):
            value = gains[i, : self.hops] + np.maximum(worth[i + soon, to], worth[i + late, to])
            np.maximum.at(worth[i], before, value[hop] - gains[i, share])
        return worth

    def proven(self, flight: tuple[int, ...], at: Any, sales: Any, inherited: float) -> float:
        """Return the greatest reward of plans that begin with some hops, as prices prove."""
        if flight not in self.prices:
            return inherited
        (node, time, got), price, most = at, self.prices[flight], self.weight @ at[2]
        since = max(0, round((time - self.first_s) / self.bin_s))
        sales = [column[(sales[1] >= since) & (got[sales[2]] == 0)] for column in sales]
        worth = self.worths(sales, price, since)
        for h in np.flatnonzero(self.start == node):
            now = np.maximum(got, self.reward(self.seen_on(h, np.array([time]))[0]))
            then = time + self.lasts[h]
            i = min(round((then - self.first_s) / self.bin_s), len(worth) - 1)
            bound = self.weight @ np.where(now > 0, now, price) + worth[i, self.state[h]]
            at = (self.end[h], then, now)
            most = max(most, self.proven((*flight, h), at, sales, min(inherited, bound)))
        return most

    def road_bound(self) -> float:
        """Return the greatest expected reward of a road plan that the prices allow."""
        take_off, least = self.flight[0, 0], np.min([*self.prices.values()], axis=0)
        sharp = self.radius_m - self.speed_mps * self.bin_s / 2
        if self.lasting[0, : self.hops].min() < 1 or sharp < 0 or not least.min() >= 0:
            return np.inf  # such bins or prices prove nothing
        self.first_s = take_off + self.lasts[self.hops :].min()
        ends = min(self.found_by_s or self.horizon_s - least.min(), self.landing_s or np.inf)
        self.bins = max(1, int(np.ceil((ends - self.first_s) / self.bin_s)) + 1)
        sales = self.list_sales(self.first_s + self.bin_s * np.arange(self.bins), least)
        return self.proven((), (len(self.place) - 1, take_off, 0 * self.weight), sales, np.inf)

    def claims(self) -> Any:
        """Return each claim: its name, what is claimed and found, and by how much it is wrong."""
        step, (take_off, *place) = np.hstack([self.flight[:-1], self.flight[1:]]), self.flight[0]
        far = np.hypot(step[:, 4] - step[:, 1], step[:, 5] - step[:, 2])
        fits = far <= self.speed_mps * (step[:, 3] - step[:, 0]) + 0.01
        circle, watched = (0, self.horizon_s, *place, 0, 0), range(len(step))
        met = self.sweep([circle], np.array([take_off]), self.radius_m, self.speed_mps)
        most, told = self.weight @ self.reward(met[0]), vars(self)
        if self.plan_class == "roads":
            self.list_hops()
            ways = [np.hstack([p[1:-2, 1:], p[2:-1, 1:]]) for p in self.paths[: self.legs]]
            close = np.abs(step[:, None, [1, 2, 4, 5]] - np.vstack(ways)) <= 0.01
            fits &= close[..., 2:].all(axis=2).any(axis=1)  # turns where roads do
            watched = np.flatnonzero(close.all(axis=2).any(axis=1) | self.transit)
            most = min(most, self.road_bound())
        moves = [motions(self.flight[s : s + 2], *on) for s in watched for on in self.on]
        seen = self.sweep(np.vstack([np.zeros((0, 6)), *moves]), np.zeros(1), self.radius_m)[0]
        time = self.horizon_s - self.weight @ np.maximum(0, self.horizon_s - seen)
        found, bound = self.weight @ self.reward(seen), told.get("lower_bound_s")
        gap = 1 - found / self.upper_bound_probability if bound is None else time / bound - 1
        yield "flight as its class allows", True, bool(fits.all()), 1 - fits.all()
        for name, figure, scale, side in (
            ("expected_detection_time_s", time, self.horizon_s, 0),
            ("found_by_probability", found, 1, 0),
            ("lower_bound_s", self.horizon_s - most, self.horizon_s, 1),
            ("upper_bound_probability", most, 1, -1),
            ("gap", gap, 1, 0),
        ):
            if name in told:
                off = (told[name] - figure) / scale
                yield name, told[name], figure, side * off if side else abs(off)


def main() -> int:
    """Check the run in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder of a certified run")
    folder = parser.parse_args().directory
    np.seterr(divide="ignore", invalid="ignore")  # where nobody is met
    try:
        claims = list(Run(folder).claims())
    except (OSError, LookupError, AttributeError, TypeError, ValueError) as error:
        parser.error(f"{folder}: holds no certified run ({error}); `planner certify` makes one")
    for name, claimed, found, wrong in claims:
        print(f"{name}: claimed {claimed}, found {found}: {'holds' if wrong <= 1e-6 else 'WRONG'}")
    return 0 if all(wrong <= 1e-6 for *_, wrong in claims) else 1


if __name__ == "__main__":
    sys.exit(main())
