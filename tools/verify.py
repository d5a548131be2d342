"""Check a certified plan without the code that made it: verify.py DIR.

Computes its figures and the bound anew from the files in DIR, and says whether the claims hold
(exit code 0) or not (1). What the bound is stands in planner/search/bound.py and branches.py; it
may be tighter than is claimed. A path is rows of time, x and y.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace as Run
from typing import Any

import numpy as np
import pyarrow.parquet

TOLERANCE = 1e-6  # of the horizon, or of one


def read(folder: Path) -> Run:
    """Return the plan, its claims, the particles, the net and the prices."""
    plan, net = (json.loads((folder / name).read_text()) for name in ("plan.json", "net.json"))
    names = ("motion.parquet", "weights.parquet", "prices.parquet")
    tables = [pyarrow.parquet.read_table(folder / name).to_pydict() for name in names]
    run = Run(**{"found_by_s": None, **plan["planned"], **plan["certificate"], **net})
    run.flight, run.sensor_on = (np.array(plan["uavs"][0][n]) for n in ("waypoints", "sensor_on"))
    run.place = np.array([*run.node_xy_m, run.flight[0, 1:]])  # of nodes, then of the take-off
    run.who, *run.pieces = map(np.array, tables[0].values())
    run.weight, prices = np.array(tables[1]["weight"]), zip(*tables[2].values(), strict=True)
    run.prices = {tuple(hops): np.array(price) for hops, price in prices}
    return run


def reward(run: Run, seen: Any) -> Any:
    """Return what sightings at some times are worth."""
    return np.maximum(0, run.horizon_s - seen) if run.found_by_s is None else seen <= run.found_by_s


def motions(path: Any, begin: float, end: float) -> Any:
    """Return a path's straight motions between two times: from, to, place at from, velocity."""
    step = np.diff(path, axis=0)
    velocity = step[:, 1:] / np.maximum(step[:, :1], 1e-9)
    on, off = np.maximum(path[:-1, 0], begin), np.minimum(path[1:, 0], end)
    place = path[:-1, 1:] + velocity * (on - path[:-1, 0])[:, None]
    return np.column_stack([on, off, place, velocity])[on < off]


def sweep(run: Run, moves: Any, starts: Any, radius: float, growth: float = 0.0) -> Any:
    """Return when motions, begun at each start, first see each particle, (starts, N).

    The radius may grow with time. Of the many pieces of motion, those far aside are left out.
    """
    seen = np.full((len(starts), len(run.weight)), np.inf)
    for begin, end, x, y, ux, uy in moves:
        a, b, px, py, pu, pv = run.pieces
        half = (np.minimum(b, starts[-1] + end) - a) / 2
        dx, dy, far = px + pu * half - x, py + pv * half - y, np.hypot(pu, pv) * half
        passed = np.clip((dx * ux + dy * uy) / max(ux**2 + uy**2, 1e-9), 0, end - begin)
        near = np.hypot(dx - ux * passed, dy - uy * passed) <= radius + far + 1e-3
        low = np.searchsorted(starts, a - end - 1e-6)
        many = np.searchsorted(starts, a + 2 * half - begin + 1e-6) - low
        many = np.where((near | (growth > 0)) & (half >= 0), np.maximum(0, many), 0)
        p = np.repeat(np.arange(len(a)), many)
        i = np.arange(len(p)) + (low - np.cumsum(many) + many)[p]
        a, b, px, py, pu, pv = (column[p] for column in run.pieces)
        on, off = np.maximum(starts[i] + begin, a), np.minimum(starts[i] + end, b)
        flown, vx, vy = on - starts[i] - begin, pu - ux, pv - uy
        dx, dy = px + pu * (on - a) - x - ux * flown, py + pv * (on - a) - y - uy * flown
        reach, away, nearing = radius + growth * flown, dx**2 + dy**2, -(dx * vx + dy * vy)
        root = (vx**2 + vy**2) * reach**2 - (dx * vy - dy * vx) ** 2
        root += growth * (growth * away + 2 * nearing * reach)
        with np.errstate(divide="ignore", invalid="ignore"):
            after = (away - reach**2) / (nearing + growth * reach + np.sqrt(root))
        after = np.where(away <= reach**2, 0, np.where(after >= 0, after, np.inf))
        met = np.where((on <= off) & (after <= off - on), on + after, np.inf)
        np.minimum.at(seen, (i, run.who[p]), met)
    return seen


def direct(place: Any, a: int, b: int) -> bool:
    """Tell whether a straight flight is no two flights, as over a node or from one at take-off."""
    way, away, take_off = place[b] - place[a], place[:-1] - place[a], a == len(place) - 1
    along, aside, far = away @ way, np.abs(away @ (-way[1], way[0])), way @ way
    after = along > (-1e-6 if take_off else 1e-6 * far)
    between = after & (along < (1 - 1e-6) * far) & (aside < 1e-9 * far)
    return bool((take_off or far > 0) and not between.any())


def list_hops(run: Run) -> None:
    """List what plans consist of: legs, straight flights between nodes, flights from take-off."""
    roads = zip(run.road_from, run.road_to, map(np.array, run.shape_m), strict=True)
    hops = [leg for a, b, shape in roads for leg in ((a, b, shape), (b, a, shape[::-1]))]
    run.legs, straight = len(hops), {(a, b) for a, b, points in hops if len(points) == 2}
    ends = [pair for pair in np.ndindex(len(run.place), len(run.place) - 1) if pair not in straight]
    hops += [(a, b, run.place[[a, b]]) for a, b in ends if direct(run.place, a, b)]
    run.ends, run.paths, rest = np.array([ends for *ends, _ in hops]), [], run.bin_s
    for *_, points in hops:  # with rests at both ends
        far = np.hypot(*np.diff(points, axis=0).T) / run.speed_mps
        points = np.pad(points, ((1, 1), (0, 0)), "edge")
        run.paths.append(np.column_stack([np.cumsum([-rest, rest, *far, rest]), points]))
    run.lasts, bins = np.array([(path[-2, 0], path[-2, 0] / rest) for path in run.paths]).T
    run.lasting = np.array([np.floor(bins + 1e-9), np.ceil(bins - 1e-9)]).astype(int)
    run.state = run.ends[:, 1].copy()  # after a hop: the node, or the leg itself
    run.state[: run.legs] = len(run.place) + np.arange(run.legs)


def seen_on(run: Run, h: int, starts: Any, rest: float = 0.0) -> Any:
    """Return when a hop sees whom, maybe; with less than no rest: surely sees."""
    path = run.paths[h] if h < run.legs or run.transit else run.paths[h][:0]
    moves = motions(path, -rest, run.lasts[h] + rest)
    return sweep(run, moves, starts, run.radius_m + run.speed_mps * rest)


def list_sales(run: Run, hops: int, least: Any) -> Any:
    """Return all sales: row (a hop, or a hop after a leg that surely made them), bin, who, reward.

    The pairs of the leg and the hop are listed too.
    """
    starts, slack = run.first_s + run.bin_s * np.arange(run.bins), run.bin_s / 2
    sure = [np.isfinite(seen_on(run, h, starts, -slack)) for h in range(run.legs)]
    run.pairs, sales, again = [], [], []
    for h in range(hops):
        earned = reward(run, seen_on(run, h, starts, slack))
        i, k = np.nonzero(earned > least)
        sales.append((np.full(len(i), h), i, k, earned[i, k]))
        for g in np.flatnonzero(run.ends[: run.legs, 1] == run.ends[h, 0]) if h < run.legs else ():
            late, early = i - run.lasting[:, g, None]
            known = (early >= 0) & sure[g][late, k] & sure[g][early, k]
            again.append([column[known] for column in sales[-1]])
            again[-1][0][:] = hops + len(run.pairs)
            run.pairs.append((g, h))
    return [np.concatenate(columns) for columns in zip(*sales, *again, strict=True)]


def worths(run: Run, sales: Any, price: Any, since: int) -> Any:
    """Return the most that flights from each bin and state on earn above prices."""
    (row, i, k, earned), (leg, then) = sales, np.array(run.pairs).T
    hops, nodes = np.sum(run.ends[:, 0] < len(run.place) - 1), run.state >= len(run.place)
    above, shape = run.weight[k] * np.maximum(0, earned - price[k]), (run.bins, hops + len(leg))
    gains = np.bincount(i * shape[1] + row, above, shape[0] * shape[1]).reshape(shape)
    (start, end), (soon, late), states = run.ends[:hops].T, run.lasting[:, :hops], run.state[:hops]
    legs, worth = slice(run.legs), np.zeros((run.bins + late.max() + 1, max(run.state) + 1))
    for i in range(run.bins - 1, since - 1, -1):
        value = gains[i, :hops] + np.maximum(worth[i + soon, states], worth[i + late, states])
        np.maximum.at(worth[i], start[run.legs :], value[run.legs :])
        worth[i, states[legs]] = worth[i, end[legs]]
        np.maximum.at(worth[i], start[legs], value[legs])
        np.maximum.at(worth[i], states[leg], value[then] - gains[i, hops:])
    return worth


def proven(run: Run, flight: tuple[int, ...], at: Any, sales: Any, inherited: float) -> float:
    """Return the greatest reward of plans that begin with some hops, as far as prices prove."""
    if flight not in run.prices:
        return inherited
    (node, time, got), price, most = at, run.prices[flight], run.weight @ at[2]
    since = max(0, round((time - run.first_s) / run.bin_s))
    left = (sales[1] >= since) & (got[sales[2]] == 0)
    sales = [column[left] for column in sales]
    worth = worths(run, sales, price, since)
    for h in np.flatnonzero(run.ends[:, 0] == node):
        now = np.maximum(got, reward(run, seen_on(run, h, np.array([time]))[0]))
        i = min(round((time + run.lasts[h] - run.first_s) / run.bin_s), len(worth) - 1)
        bound = min(inherited, run.weight @ np.where(now > 0, now, price) + worth[i, run.state[h]])
        there = (run.ends[h, 1], time + run.lasts[h], now)
        most = max(most, proven(run, (*flight, h), there, sales, bound))
    return most


def road_bound(run: Run) -> float:
    """Return the greatest expected reward of a road plan that the prices allow."""
    start, least = len(run.place) - 1, np.min([*run.prices.values()], axis=0)
    hops, sharp = np.sum(run.ends[:, 0] < start), run.radius_m - run.speed_mps * run.bin_s / 2
    if run.lasting[0, :hops].min() < 1 or sharp < 0 or not least.min() >= 0:
        return np.inf  # such bins or prices prove nothing
    run.first_s = run.flight[0, 0] + run.lasts[hops:].min()
    ends = run.horizon_s - least.min() if run.found_by_s is None else run.found_by_s
    ends = min(ends, run.landing_s or np.inf)
    run.bins = max(1, int(np.ceil((ends - run.first_s) / run.bin_s)) + 1)
    at, sales = (start, run.flight[0, 0], 0 * run.weight), list_sales(run, hops, least)
    return proven(run, (), at, sales, np.inf)


def over_roads(run: Run) -> tuple[Any, bool]:
    """Tell which steps of a flight follow roads, and if it turns on roads that meet nodes."""
    legs = [path[1:-1, 1:] for path in run.paths[: run.legs]]
    meet = np.abs([way[[0, -1]] for way in legs] - run.place[run.ends[: run.legs]]).max()
    ways = np.vstack([np.hstack([way[:-1], way[1:]]) for way in legs])
    aside = np.abs(np.hstack([run.flight[:-1, 1:], run.flight[1:, 1:]])[:, None] - ways)
    along, turns = (aside[..., s:].max(axis=2).min(axis=1) <= 0.01 for s in (0, 2))
    return along, bool(turns.all() and meet <= 0.01)


def checked(run: Run) -> Iterator[tuple[str, Any, Any, bool]]:
    """Return each claim: its name, what is claimed and found, and whether it holds."""
    step, horizon, (take_off, *place) = np.diff(run.flight, axis=0), run.horizon_s, run.flight[0]
    fits, along = (
        np.all(np.hypot(*step[:, 1:].T) <= run.speed_mps * step[:, 0] + 0.01),
        step[:, 0] >= 0,
    )
    circle, met_by = (0, horizon, *place, 0, 0), np.array([take_off])
    most = run.weight @ reward(run, sweep(run, [circle], met_by, run.radius_m, run.speed_mps)[0])
    if run.plan_class == "roads":
        list_hops(run)
        along, turns = over_roads(run)
        fits, most = fits and turns, min(most, road_bound(run))
    watched = [(s, on) for s in np.flatnonzero(along | run.transit) for on in run.sensor_on]
    moves = [motions(run.flight[s : s + 2], *on) for s, on in watched]
    seen = sweep(run, np.vstack([np.zeros((0, 6)), *moves]), np.zeros(1), run.radius_m)[0]
    time, found = (
        horizon - run.weight @ np.maximum(0, horizon - seen),
        run.weight @ reward(run, seen),
    )
    run.flies = True
    rows = [("flies", bool(fits), 1, 0), ("expected_detection_time_s", time, horizon, 0)]
    if run.found_by_s is None:
        rows += [("lower_bound_s", horizon - most, horizon, 1)]
        gap = time / run.lower_bound_s - 1
    else:
        rows += [("found_by_probability", found, 1, 0), ("upper_bound_probability", most, 1, -1)]
        gap = 1 - found / run.upper_bound_probability
    for name, figure, scale, side in [*rows, ("gap", gap, 1, 0)]:
        off = (vars(run)[name] - figure) / scale
        yield name, vars(run)[name], figure, (side * off if side else abs(off)) <= TOLERANCE


def main() -> int:
    """Check the run in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder of a certified run")
    folder = parser.parse_args().directory
    try:
        rows = list(checked(read(folder)))
    except (OSError, LookupError, AttributeError, TypeError, ValueError) as error:
        parser.error(f"{folder}: holds no certified run ({error}); `planner certify` makes one")
    for name, claimed, found, holds in rows:
        print(f"{name}: claimed {claimed}, found {found}: {'holds' if holds else 'WRONG'}")
    return 0 if all(holds for *_, holds in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
