"""Check a certified plan without the code that made it: verify.py DIR.

The bound is that of planner/bounds/particle_prices.py; belief, net and what it prints as assumed
are given.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from pyarrow.parquet import read_table


class Run(argparse.Namespace):
    """A certified plan, its claims, the particles, the net and the prices."""

    def __init__(self, folder: Path) -> None:
        plan, net = (json.loads((folder / name).read_text()) for name in ("plan.json", "net.json"))
        names = ("motion.parquet", "weights.parquet", "prices.parquet")
        motion, weights, prices = (read_table(folder / n).to_pydict().values() for n in names)
        planned, told, (uav,) = plan["planned"], plan["certificate"], plan["uavs"]
        keys = ("horizon_s", "radius_m", "plan_class", "transit", "speed_mps", "landing_s", "bin_s")
        given = {k: (planned | told)[k] for k in keys} | {"found_by_s": planned.get("found_by_s")}
        super().__init__(**given, given=given, planned=planned, told=told, roads=net["roads"])
        self.time, x, y = np.array(uav["waypoints"]).T
        self.path, self.on = x + 1j * y, uav["sensor_on"]  # places are complex numbers
        self.place = np.append(net["node_xy_m"] @ np.array([1, 1j]), self.path[0])  # and take-off
        self.who, begin, end, x, y, vx, vy = map(np.array, motion)
        self.pieces, self.weight = (begin, end, x + 1j * y, vx + 1j * vy), np.array(*weights)
        self.prices = {tuple(hops): np.array(price) for hops, price in zip(*prices, strict=True)}

    def _reward(self, at: Any) -> Any:
        return at <= self.found_by_s if self.found_by_s else np.maximum(0, self.horizon_s - at)

    def sweep(self, path: Any, on: Any, starts: Any, radius: float, growth: float = 0.0) -> Any:
        """Return when a flight, begun at each start, has whom in a growing radius, (starts, N)."""
        seen, (time, _) = np.full((len(starts), len(self.weight)), np.inf), path
        time = np.r_[on[0], time[(time > on[0]) & (time < on[1])], on[1]]
        way = np.interp(time, *path)  # it rests before and after
        speeds = np.diff(way) / np.maximum(np.diff(time), 1e-9)
        for begin, end, origin, u in zip(time[:-1], time[1:], way[:-1], speeds, strict=True):
            a, b, place, v = self.pieces
            half = (np.minimum(b, starts[-1] + end) - a) / 2
            middle, far = place + v * half - origin, radius + growth * end + abs(v) * half + 1e-3
            passed = np.clip((middle * np.conj(u)).real / max(abs(u) ** 2, 1e-9), 0, end - begin)
            low, high = np.searchsorted(starts, [a - end - 1e-6, a + 2 * half - begin + 1e-6])
            many = np.where(abs(middle - u * passed) <= far, np.maximum(0, high - low), 0)
            p = np.repeat(np.arange(len(a)), many)
            i = np.arange(len(p)) + (low - np.cumsum(many) + many)[p]
            a, b, place, v = (column[p] for column in self.pieces)
            start, stop = np.maximum(starts[i] + begin, a), np.minimum(starts[i] + end, b)
            flown, w = start - starts[i] - begin, v - u
            offset, reach = place + v * (start - a) - origin - u * flown, radius + growth * flown
            out = abs(offset) ** 2 - reach**2  # until |offset + w t| = reach + growth t
            b, c = (np.conj(offset) * w).real - growth * reach, (abs(w) ** 2 - growth**2) * out
            after = np.where(out <= 0, 0, out / (np.sqrt(b**2 - c) - b))
            met = np.where((after >= 0) & (after <= stop - start), start + after, np.inf)
            np.minimum.at(seen, (i, self.who[p]), met)
        return seen

    def list_hops(self) -> None:
        """List what plans consist of: legs, straight flights, and those from take-off."""
        xy, many, axes = self.place, len(self.place) - 1, np.array([1, 1j])
        hops = [(a, b, np.r_[xy[a], (way @ axes)[1:-1], xy[b]]) for a, b, way in self.roads]
        self.legs, straight = len(hops), {(a, b) for a, b, way in hops if len(way) == 2}
        for a, b in np.ndindex(many + 1, many):  # over a node, or at one, it is two
            ratio, low = (xy[:-1] - xy[a]) / (xy[b] - xy[a]), 1e-6 if a < many else -1e-9
            over = (ratio.real > low) & (ratio.real < 1 - 1e-6) & (abs(ratio.imag) < 1e-9)
            if (a, b) not in straight and (xy[a] != xy[b] or a == many) and not over.any():
                hops.append((a, b, xy[[a, b]]))
        self.start, self.end = np.array([ends for *ends, _ in hops]).T
        self.state = np.r_[many + 1 + np.arange(self.legs), self.end[self.legs :]]  # after each
        self.hops = sum(self.start < many)  # the others are from take-off
        self.paths = [(np.r_[0, np.cumsum(abs(np.diff(w))) / self.speed_mps], w) for *_, w in hops]
        self.lasts = np.array([time[-1] for time, _ in self.paths])
        self.lasting = (self.lasts / self.bin_s + [[1e-9], [1 - 1e-9]]).astype(int)  # down, up

    def seen_on(self, h: int, starts: Any, rest: float = 0.0) -> Any:
        """Return when a hop may see whom, or, with less than no rest, surely sees."""
        on = (-rest, self.lasts[h] + rest) if h < self.legs or self.transit else (0, -1)
        radius = self.radius_m + self.speed_mps * rest - 1e-6 * np.sign(rest)  # a tie either way
        return self.sweep(self.paths[h], on, starts, radius)

    def worths(self, sales: Any, price: Any, since: int) -> Any:
        """Return the most that flights from each bin and state on earn above prices."""
        (row, i, k, earned), (before, hop, share) = sales, np.array(self.steps).T
        above = self.weight[k] * np.maximum(0, earned - price[k])
        shape = (len(self.starts), len(hop) + 1)
        gains = np.bincount(i * shape[1] + row, above, np.prod(shape)).reshape(shape)
        to, (soon, late) = self.state[: self.hops], self.lasting[:, : self.hops]
        worth = np.zeros((len(self.starts) + late.max() + 1, max(self.state) + 1))
        for i in range(len(self.starts) - 1, since - 1, -1):
            value = gains[i, : self.hops] + np.maximum(worth[i + soon, to], worth[i + late, to])
            np.maximum.at(worth[i], before, value[hop] - gains[i, share])
        return worth

    def proven(self, flight: tuple[int, ...], at: Any, sales: Any, inherited: Any) -> Any:
        """Return the greatest reward of plans that begin with some hops, as prices prove."""
        if flight not in self.prices:
            return inherited
        (node, time, got), price, most = at, self.prices[flight], self.weight @ at[2]
        since = max(0, round((time - self.starts[0]) / self.bin_s))
        sales = [column[(sales[1] >= since) & (got[sales[2]] == 0)] for column in sales]
        worth = self.worths(sales, price, since)
        for h in np.flatnonzero(self.start == node).tolist():
            now = np.maximum(got, self._reward(self.seen_on(h, np.array([time]))[0]))
            there = (self.end[h], time + self.lasts[h], now)
            i = min(round((there[1] - self.starts[0]) / self.bin_s), len(worth) - 1)
            bound = self.weight @ np.where(now > 0, now, price) + worth[i, self.state[h]]
            most = max(most, self.proven((*flight, h), there, sales, min(inherited, bound)))
        return most

    def road_bound(self) -> Any:
        """Return the greatest expected reward of a road plan that the prices allow."""
        least, slack = np.min([*self.prices.values()], axis=0), self.bin_s / 2
        sharp, shortest = self.radius_m - self.speed_mps * slack, self.lasting[0, : self.hops].min()
        if not (least.min() >= 0 and sharp >= 0 and shortest >= 1):
            return np.inf  # such prices or bins prove nothing
        first = self.time[0] + self.lasts[self.hops :].min()
        ends = min(self.found_by_s or self.horizon_s - least.min(), self.landing_s or np.inf)
        self.starts = starts = np.arange(first, max(first, ends) + self.bin_s, self.bin_s)
        sure = [np.isfinite(self.seen_on(h, starts, -slack)) for h in range(self.legs)]
        self.steps, sales = [(self.start[h], h, -1) for h in range(self.hops)], []
        for h in range(self.hops):
            worth = self._reward(self.seen_on(h, starts, slack))
            i, k = np.nonzero(worth > least)
            sales.append([0 * i + h, i, k, worth[i, k]])  # row, bin, particle, reward
            for g in np.flatnonzero(self.end[: self.legs] == self.start[h]):
                late, early = np.maximum(-1, i - self.lasting[:, g, None])  # as legs remember
                known = (h < self.legs) & (early >= 0) & sure[g][late, k] & sure[g][early, k]
                sales.append([c[known] for c in (0 * i + len(self.steps), i, k, worth[i, k])])
                self.steps.append((self.state[g], h, len(self.steps)))
        table = [np.concatenate(columns) for columns in zip(*sales, strict=True)]
        return self.proven((), (len(self.place) - 1, self.time[0], 0 * self.weight), table, np.inf)

    def follow(self) -> Any:
        """Return which parts of the path are flown along roads, if it consists of whole hops."""
        i, watched, roads = 0, list[int](), [way for _, way in self.paths[: self.legs]]
        while i < len(self.path) - 1:  # is it a road, or a straight flight to a node?
            flown = (len(w) for w in roads if np.array_equal(w, self.path[i : i + len(w)]))
            if (many := next(flown, 0)) == 0 and self.path[i + 1] not in self.place[:-1]:
                return None
            watched += range(i, i + many - 1)
            i += max(1, many - 1)
        return watched

    def claims(self) -> Any:
        """Return each claim: its name, what is claimed and found, and by how much it is wrong."""
        path, here = (self.time, self.path), (np.zeros(1), self.path[:1])
        late = abs(np.diff(self.path)) - self.speed_mps * np.diff(self.time)  # roads: never early
        ever = (0, max(self.horizon_s, self.found_by_s or 0))
        met = self.sweep(here, ever, self.time[:1], self.radius_m, self.speed_mps)[0]
        most, watched = self.weight @ self._reward(met), [*np.flatnonzero(np.diff(self.path) == 0)]
        if self.plan_class == "roads":
            self.list_hops()
            late, watched, most = abs(late), self.follow(), min(most, self.road_bound())
        fits = watched is not None and np.maximum(late, 0).sum() <= 1e-4
        fits &= self.time[-1] <= (self.landing_s or np.inf) + 1e-6
        parts = [self.time[s : s + 2] for s in watched or []] if not self.transit else [self.time]
        on = [(max(a, t[0]), min(b, t[-1])) for a, b in self.on for t in parts] or [(0, -1)]
        seen = np.min([self.sweep(path, w, np.zeros(1), self.radius_m)[0] for w in on], axis=0)
        time = self.horizon_s - self.weight @ np.maximum(0, self.horizon_s - seen)
        found, told, planned = self.weight @ self._reward(seen), self.told, self.planned
        name = "upper_bound_probability" if self.found_by_s else "lower_bound_s"
        gap = abs((found if self.found_by_s else time) / (claimed := told[name]) - 1)
        gap = None if gap == np.inf else gap
        likely = min(self.weight.min(), self.who.min()) >= 0 and self.weight.sum() <= 1 + 1e-9
        yield "weights are probabilities", "at most 1", self.weight.sum(), 1 - likely
        yield "flight as its class allows", True, bool(fits), 1 - fits
        figures = [(planned, "expected_detection_time_s", time), (told, "gap", gap)]
        figures += [(planned, "detection_probability", self.weight @ (seen <= self.horizon_s))]
        figures += [(of, "particles", len(self.weight)) for of in (planned, told)]
        figures += [(planned, "found_by_probability", found)] if self.found_by_s else []
        for of, key, figure in figures:
            yield key, of[key], figure, of[key] != figure and abs(of[key] - figure) / max(1, figure)
        sign, bound = (-1, most) if self.found_by_s else (1, self.horizon_s - most)
        yield name, claimed, bound, sign * (claimed - bound) / max(1, bound)


def main() -> int:
    """Check the run in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder of a certified run")
    folder = parser.parse_args().directory
    np.seterr(divide="ignore", invalid="ignore")  # where nobody is met
    try:
        claims = list((run := Run(folder)).claims())
    except (OSError, LookupError, AttributeError, TypeError, ValueError, ArithmeticError) as error:
        parser.error(f"{folder}: holds no certified run ({error}); `planner certify` makes one")
    given = (f"{key} {value!r}," for key, value in run.given.items())
    print("assumed:", *given, f"take-off {run.time[0]} s at {run.path[0]:.1f}")
    for name, claimed, found, wrong in claims:
        print(f"{name}: claimed {claimed}, found {found}: {'holds' if wrong <= 1e-6 else 'WRONG'}")
    return 0 if all(wrong <= 1e-6 for *_, wrong in claims) else 1


if __name__ == "__main__":
    raise SystemExit(main())
