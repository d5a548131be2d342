"""Check a certified plan without the code that made it: verify.py DIR.

Exit code 1: not all claims hold. The bound is that of planner/search/bound.py and branches.py.
What is believed of the target and the net are given, as is what it prints as assumed.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from verify_sightings import Sightings, motions


class Run(Sightings):
    """A certified plan, its claims, the particles, the net and the prices."""

    def direct(self, a: int, b: int) -> bool:
        """Tell whether a straight flight is no leg and no two flights, as over a node."""
        way, away = self.place[b] - self.place[a], self.place[:-1] - self.place[a]
        ratio, low = away / way, 1e-6 if a < self.nodes else -1e-9  # at take-off, a node there
        over = (ratio.real > low) & (ratio.real < 1 - 1e-6) & (abs(ratio.imag) < 1e-9)
        return (a, b) not in self.straight and (way != 0 or a == self.nodes) and not over.any()

    def list_hops(self) -> None:
        """List what plans consist of: legs, straight flights, and those from take-off."""
        xy, many, rest, axes, self.paths = self.place, self.nodes, self.bin_s, np.array([1, 1j]), []
        hops = [(a, b, np.r_[xy[a], (way @ axes)[1:-1], xy[b]]) for a, b, way in self.roads]
        self.legs, self.straight = len(hops), {(a, b) for a, b, path in hops if len(path) == 2}
        hops += [(a, b, xy[[a, b]]) for a, b in np.ndindex(many + 1, many) if self.direct(a, b)]
        for *_, path in hops:  # with rests at both ends
            after = np.cumsum([-rest, rest, *abs(np.diff(path)) / self.speed_mps, rest])
            self.paths.append((after, np.pad(path, 1, "edge")))
        self.start, self.end = np.array([ends for *ends, _ in hops]).T
        self.state = np.r_[self.nodes + 1 + np.arange(self.legs), self.end[self.legs :]]  # after
        self.hops = sum(self.start < self.nodes)  # the others are from take-off
        self.lasts = lasts = np.array([time[-2] for time, _ in self.paths])
        self.lasting = np.array([lasts / rest + 1e-9, np.ceil(lasts / rest - 1e-9)]).astype(int)

    def seen_on(self, h: int, starts: Any, rest: float = 0.0) -> Any:
        """Return when a hop may see whom, or, with less than no rest, surely sees."""
        moves = motions(*self.paths[h], -rest, self.lasts[h] + rest)
        moves = moves if h < self.legs or self.transit else []
        radius = self.radius_m + self.speed_mps * rest - 1e-6 * np.sign(rest)  # touching is both
        return self.sweep(moves, starts, radius)

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
        left = (sales[1] >= since) & (got[sales[2]] == 0)
        sales = [column[left] for column in sales]
        worth = self.worths(sales, price, since)
        for h in np.flatnonzero(self.start == node).tolist():
            now = np.maximum(got, self.reward(self.seen_on(h, np.array([time]))[0]))
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
        self.steps, sales, shared = [(self.start[h], h, -1) for h in range(self.hops)], [], []
        for h in range(self.hops):
            earned = self.reward(self.seen_on(h, starts, slack))
            i, k = np.nonzero(earned > least)
            sales.append((0 * i + h, i, k, earned[i, k]))
            for g in np.flatnonzero(self.end[: self.legs] == self.start[h]):
                if h < self.legs:  # straight flights forget
                    late, early = i - self.lasting[:, g, None]
                    known = (early >= 0) & sure[g][late, k] & sure[g][early, k]
                    share = 0 * i + len(self.steps)
                    shared.append([part[known] for part in (share, *sales[-1][1:])])
                self.steps.append((self.state[g], h, len(self.steps)))
        table = [np.concatenate(columns) for columns in zip(*sales, *shared, strict=True)]
        return self.proven((), (self.nodes, self.time[0], 0 * self.weight), table, np.inf)

    def follow(self) -> Any:
        """Return which parts of the path are flown along roads, if it consists of whole hops."""
        nodes, i, watched = self.place[:-1], 0, list[int]()
        while i < len(self.path) - 1:
            after = self.path[i:]  # is it a road, or a straight flight to a node?
            roads = (road[1:-1] for _, road in self.paths[: self.legs])
            many = (len(road) for road in roads if np.array_equal(road, after[: len(road)]))
            if (flown := next(many, 0)) == 0 and after[1] not in nodes:
                return None
            watched += range(i, i + flown - 1)
            i += max(1, flown - 1)
        return watched

    def claims(self) -> Any:
        """Return each claim: its name, what is claimed and found, and by how much it is wrong."""
        lasts = np.diff(self.time)
        late = abs(np.diff(self.path)) - self.speed_mps * lasts  # metres; on roads never early
        circle, watched = (0, self.horizon_s, self.path[0], 0j), []
        met = self.sweep([circle], self.time[:1], self.radius_m, self.speed_mps)
        most, by_s, many = self.weight @ self.reward(met[0]), self.found_by_s, len(self.weight)
        if self.plan_class == "roads":
            self.list_hops()
            late, watched, most = abs(late), self.follow(), min(most, self.road_bound())
        fits = watched is not None and (lasts >= 0).all() and np.maximum(late, 0).sum() <= 1e-4
        fits &= self.time[-1] <= (self.landing_s or np.inf) + 1e-6
        parts = range(len(lasts)) if self.transit else watched or []
        path = [(self.time[s : s + 2], self.path[s : s + 2]) for s in parts]
        moves = [move for part in path for on in self.on for move in motions(*part, *on)]
        seen = self.sweep(moves, np.zeros(1), self.radius_m)[0]
        time = self.horizon_s - self.weight @ np.maximum(0, self.horizon_s - seen)
        found, told = self.weight @ self.reward(seen), self.certificate
        gap = found / told["upper_bound_probability"] if by_s else time / told["lower_bound_s"]
        likely = (self.weight >= 0).all() and self.weight.sum() <= 1 + 1e-9
        yield "weights are probabilities", True, bool(likely), 1 - likely
        yield "flight as its class allows", True, bool(fits), 1 - fits
        planned, detected = self.planned, self.weight @ (seen <= self.horizon_s)
        figures: list[Any] = [(planned, "expected_detection_time_s", time, self.horizon_s, abs)]
        figures += [(planned, "detection_probability", detected, 1, abs)]
        figures += [(part, "particles", many, 1, abs) for part in (planned, told)]
        figures += [(told, "gap", abs(gap - 1), 1, abs)]
        if by_s:
            figures += [(planned, "found_by_probability", found, 1, abs)]
            figures += [(told, "upper_bound_probability", most, 1, np.negative)]
        else:
            bound = self.horizon_s - most
            figures += [(told, "lower_bound_s", bound, self.horizon_s, np.positive)]
        for part, name, figure, scale, error in figures:
            yield name, part[name], figure, error((part[name] - figure) / scale)


def main() -> int:
    """Check the run in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder of a certified run")
    folder = parser.parse_args().directory
    np.seterr(divide="ignore", invalid="ignore")  # where nobody is met
    try:
        run = Run(folder)
        claims = list(run.claims())
    except (OSError, LookupError, AttributeError, TypeError, ValueError) as error:
        parser.error(f"{folder}: holds no certified run ({error}); `planner certify` makes one")
    start = f"take-off {run.time[0]} s at {run.path[0]:.1f}, weights' sum {run.weight.sum():.6g}"
    print("assumed:", *(f"{key} {value}," for key, value in run.assumed.items()), start)
    for name, claimed, found, wrong in claims:
        print(f"{name}: claimed {claimed}, found {found}: {'holds' if wrong <= 1e-6 else 'WRONG'}")
    return 0 if all(wrong <= 1e-6 for *_, wrong in claims) else 1


if __name__ == "__main__":
    raise SystemExit(main())
