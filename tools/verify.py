"""Check a certified plan without the code that made it: verify.py DIR.

Reads plan.json, knots.parquet, weights.parquet, prices.parquet and net.json of a run that `planner
certify` has been through, computes the plan's figures and the bound anew, and says whether the
claims hold (exit code 0) or not (1). What the bound is stands in planner/search/bound.py and
branches.py; nothing is imported from there. The bound may be tighter than is claimed.
"""

import argparse
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet

TOLERANCE = 1e-6  # of the horizon, or of one for probabilities
REMEMBERED = 8  # legs into a node
Run = SimpleNamespace


def motions(at: Any) -> Any:
    """Return from, to, place at from and velocity, (S, 6), between rows of time and place."""
    step = np.diff(at, axis=0)
    some = step[:, 0] > 0
    speed = step[:, 1:] / np.where(some, step[:, 0], 1)[:, None]
    return np.column_stack([at[:-1, 0], at[1:, 0], at[:-1, 1:], speed])[some]


def meeting(leg: Any, start: Any, pieces: Any, radius: float) -> Any:
    """Return when legs, begun at ``start``, first have pieces within the radius, else infinity."""
    (begin, end, x, y, ux, uy), (a, b, px, py, pu, pv) = leg, pieces.T
    on, off, vx, vy = np.maximum(start + begin, a), np.minimum(start + end, b), pu - ux, pv - uy
    dx = px + pu * (on - a) - x - ux * (on - start - begin)
    dy = py + pv * (on - a) - y - uy * (on - start - begin)
    outside, nearing = dx**2 + dy**2 - radius**2, -(dx * vx + dy * vy)
    root = (vx**2 + vy**2) * radius**2 - (dx * vy - dy * vx) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        after = outside / (nearing + np.sqrt(np.maximum(root, 0)))
    after = np.where((root >= 0) & (nearing > 0) & (after <= off - on), after, np.inf)
    return np.where(on <= off, on + np.where(outside <= 0, 0, after), np.inf)


def sweep(run: Run, hop: Any, first: float, bins: int, radius: float, until: Any) -> Any:
    """Return when a hop, begun in the middle of each bin, first sees each particle, (bins, N)."""
    seen, pieces, step = np.full((bins, len(until)), np.inf), run.pieces, run.step
    for leg in hop:
        begin, end, x, y, ux, uy = leg
        to = np.minimum(pieces[:, 1], np.minimum(until[run.who], first + bins * step + end))
        far = pieces[:, 2:4] + pieces[:, 4:] * (to - pieces[:, 0])[:, None]
        there = np.array([x + ux * (end - begin), y + uy * (end - begin)])
        near = np.minimum(pieces[:, 2:4], far) <= np.maximum((x, y), there) + radius
        near &= np.maximum(pieces[:, 2:4], far) >= np.minimum((x, y), there) - radius
        sides = [(at[:, 1] - y) * ux - (at[:, 0] - x) * uy for at in (far, pieces[:, 2:4])]
        aside = radius * np.hypot(ux, uy) + 1e-3
        near &= ((np.minimum(*sides) <= aside) & (np.maximum(*sides) >= -aside))[:, None]
        low = np.maximum(0, np.ceil((pieces[:, 0] - end - first) / step - 1e-9))
        high = np.minimum(bins - 1, np.floor((to - begin - first) / step + 1e-9))
        p = np.flatnonzero(near.all(axis=1) & (low <= high) & (to >= pieces[:, 0]))
        many = (high[p] - low[p] + 1).astype(int)
        i = np.arange(many.sum()) + np.repeat(low[p].astype(int) - np.cumsum(many) + many, many)
        p = np.repeat(p, many)
        np.minimum.at(seen, (i, run.who[p]), meeting(leg, first + i * step, pieces[p], radius))
    return seen


def sees(run: Run, flight: Any, on: Any) -> Any:
    """Return when each particle is first seen on a flight while the sensor is on, (N,)."""
    seen = np.full(len(run.weight), np.inf)
    for begin, end in on:
        for a, b, x, y, ux, uy in motions(np.asarray(flight, dtype=float)):
            low, high = max(a, begin), min(b, end)
            if low <= high:
                leg = (low, high, x + ux * (low - a), y + uy * (low - a), ux, uy)
                np.minimum.at(seen, run.who, meeting(leg, 0.0, run.pieces, run.radius))
    return seen


def passes(xy: Any, start: Any, end: Any) -> bool:
    """Tell whether a straight flight passes over a node between its ends."""
    way, away, far = end - start, xy - start, np.hypot(*(end - start))
    along, aside = away @ way / far, np.abs(away @ (-way[1], way[0])) / far
    return bool(np.any((along > 1e-6 * far) & (along < (1 - 1e-6) * far) & (aside < 1e-9 * far)))


def hops_of(run: Run) -> tuple[list[Any], int]:
    """Return from, to, and time and place of each hop's points, and how many hops are legs."""
    xy, net, hops, straight = run.xy, run.net, [], set()
    for a, b, shape in zip(net["road_from"], net["road_to"], net["shape_m"], strict=True):
        for start, end, points in ((a, b, np.array(shape)), (b, a, np.array(shape)[::-1])):
            after = np.cumsum(np.append(0, np.hypot(*np.diff(points, axis=0).T))) / run.speed
            hops.append((start, end, np.column_stack([after, points])))
            straight |= {(start, end)} if len(points) == 2 else set()
    legs = len(hops)
    for a, b in np.ndindex(len(xy), len(xy)):
        if np.any(xy[a] != xy[b]) and (a, b) not in straight and not passes(xy, xy[a], xy[b]):
            after = (0, np.hypot(*(xy[b] - xy[a])) / run.speed)
            hops.append((a, b, np.column_stack([after, xy[[a, b]]])))
    return hops, legs


def lasting(run: Run, hop: Any) -> Any:
    """Return in how many bins from now a hop ends, at least and at most."""
    bins = hop[2][-1, 0] / run.step
    return np.array([np.floor(bins + 1e-9), np.ceil(bins - 1e-9)]).astype(int)


def sightings(run: Run, least: Any) -> list[Any]:
    """Return hop, bin, particle, reward of what hops may sell, and after which legs it is known."""
    slack, until, sure, found = run.step / 2, run.until(least), {}, []
    sharp, wide = run.radius - run.speed * slack, run.radius + run.speed * slack
    for h, (_, _, at) in enumerate(run.hops[: run.legs]):
        core = motions(at)
        cut = np.maximum(0, slack - core[:, 0])
        core[:, 2:4] += core[:, 4:] * cut[:, None]
        core[:, 0], core[:, 1] = core[:, 0] + cut, np.minimum(core[:, 1], at[-1, 0] - slack)
        core = core[core[:, 0] < core[:, 1]] if sharp > 0 else core[:0]
        sure[h] = np.isfinite(sweep(run, core, run.first, run.bins, sharp, until + np.inf))
    for h, (start, _, at) in enumerate(run.hops if run.transit else run.hops[: run.legs]):
        rests = np.vstack([at[0], at, at[-1]])
        rests[[0, -1], 0] += -slack, slack
        seen = run.reward(sweep(run, motions(rests), run.first, run.bins, wide, until))
        i, k = np.nonzero(seen > least)
        known = np.zeros(len(i), dtype=np.uint8)
        for bit, g in enumerate(run.into[start][:REMEMBERED] if h < run.legs else ()):
            ago = lasting(run, run.hops[g])
            both = sure[g][np.maximum(0, i - ago[:, None]), k].all(axis=0) & (i >= ago[1])
            known |= both.astype(np.uint8) << np.uint8(bit)
        found.append((np.full(len(i), h), i, k, seen[i, k], known))
    return [np.concatenate(columns) for columns in zip(*found, strict=True)]


def worths(run: Run, price: Any, unseen: Any, since: int) -> Any:
    """Return the most that flights from a bin and a node, or after a leg, earn above prices."""
    h, i, k, reward, known = run.sightings
    gain, shape = run.weight[k] * (reward - price[k]), (len(run.hops), run.bins)
    some = (gain > 0) & unseen[k] & (i >= since)
    cell, gain, known = h[some] * run.bins + i[some], gain[some], known[some]
    after = [cell >= 0, *((known >> np.uint8(bit)) & 1 > 0 for bit in range(REMEMBERED))]
    gains, *hidden = (np.bincount(cell[a], gain[a], np.prod(shape)).reshape(shape) for a in after)
    hides, nodes = np.stack([*hidden, np.zeros(shape)]), len(run.xy)
    start, end = np.array([hop[:2] for hop in run.hops]).T
    state = np.where(np.arange(len(end)) < run.legs, nodes + np.arange(len(end)), end)
    soon, late = np.array([lasting(run, hop) for hop in run.hops]).T
    before, leg, bit = np.array(
        [
            (g, h, min(b, REMEMBERED))
            for h in range(run.legs)
            for b, g in enumerate(run.into[start[h]])
        ]
    ).T
    worth = np.zeros((run.bins + late.max() + 1, nodes + run.legs))
    for i in range(run.bins - 1, since - 1, -1):
        value = gains[:, i] + np.maximum(worth[i + soon, state], worth[i + late, state])
        np.maximum.at(worth[i], start[run.legs :], value[run.legs :])
        worth[i, nodes:] = worth[i, end[: run.legs]]
        np.maximum.at(worth[i], start[: run.legs], value[: run.legs])
        np.maximum.at(worth[i], nodes + before, value[leg] - hides[bit, leg, i])
    return worth


def proven(run: Run, flight: tuple[int, ...], place: Any, inherited: float) -> float:
    """Return the greatest reward of plans that begin with a flight, as far as prices prove."""
    if flight not in run.prices:
        return inherited
    (node, at, got), price, further = place, run.prices[flight], []
    for h, (start, end, path) in enumerate(run.hops if flight else ()):
        if start == node:
            on, path = [(at, at + path[-1, 0])], path + np.array([at, 0, 0])
            seen = run.reward(sees(run, path, on if run.transit or h < run.legs else []))
            there = (end, path[-1, 0], np.maximum(got, seen))
            further.append((h, there, len(run.xy) + h if h < run.legs else end))
    further = further or [(n, one, one[0]) for n, one in enumerate(run.flights)]
    bins = [round((there[1] - run.first) / run.step) for _, there, _ in further]
    worth = worths(
        run, price, got == 0, min(bins) if flight == () else round((at - run.first) / run.step)
    )
    most = float(run.weight @ got)
    for (number, there, state), i in zip(further, bins, strict=True):
        bound = run.weight @ np.where(there[2] > 0, there[2], price)
        bound += worth[i, state] if i < len(worth) else 0.0
        most = max(most, proven(run, (*flight, number), there, min(inherited, float(bound))))
    return most


def road_bound(run: Run, take_off: float, place: Any, landing: float) -> float:
    """Return the greatest expected reward of a road plan that the prices allow."""
    run.hops, run.legs = hops_of(run)
    run.into = [[h for h in range(run.legs) if run.hops[h][1] == n] for n in range(len(run.xy))]
    here = [n for n in range(len(run.xy)) if np.all(run.xy[n] == place)][:1]
    run.flights = []
    for n in here or [n for n, xy in enumerate(run.xy) if not passes(run.xy, place, xy)]:
        at = take_off + np.hypot(*(run.xy[n] - place)) / run.speed
        path, on = [(take_off, *place), (at, *run.xy[n])], [(take_off, at)] if run.transit else []
        run.flights.append((n, at, run.reward(sees(run, path, on))))
    least = np.min(list(run.prices.values()), axis=0)
    run.first, ends = min(at for _, at, _ in run.flights), min(run.until(least).max(), landing)
    run.bins = max(1, int(np.ceil((ends - run.first) / run.step)) + 1)
    run.sightings = sightings(run, least)
    if min(lasting(run, hop)[0] for hop in run.hops) < 1 or np.min(least) < 0:
        return float(np.inf)  # such bins or prices prove nothing
    return proven(run, (), (None, take_off, np.zeros(len(run.weight))), np.inf)


def free_bound(run: Run, take_off: float, place: Any) -> float:
    """Return the expected reward if each particle is met as soon as the UAV can be there."""
    a, b, x, y, vx, vy = run.pieces.T
    on = np.maximum(a, take_off)
    x, y = x + vx * (on - a) - place[0], y + vy * (on - a) - place[1]
    ring = run.radius + run.speed * (on - take_off)
    # |(x, y) + v t| = ring + speed t, that is square t^2 + 2 half t + rest = 0
    square, half = vx**2 + vy**2 - run.speed**2, x * vx + y * vy - ring * run.speed
    rest = x**2 + y**2 - ring**2
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(half**2 - square * rest)
        roots = rest / (np.array([root, -root]) - half)
    after = np.where(rest <= 0, 0, np.where(roots >= 0, roots, np.inf).min(axis=0))
    seen = np.full(len(run.weight), np.inf)
    np.minimum.at(seen, run.who, np.where(on + after <= b, on + after, np.inf))
    return float(run.weight @ run.reward(seen))


def read(folder: Path, plan: Any) -> Run:
    """Return the particles' motion, the net and the prices of a certified plan."""
    knots, told, prices = (
        pyarrow.parquet.read_table(folder / f"{name}.parquet").to_pydict()
        for name in ("knots", "weights", "prices")
    )
    who, gone = np.array(knots["particle"]), np.array(told["gone"])
    at = np.column_stack([knots[name] for name in ("time_s", "x_m", "y_m")])
    last, step = np.diff(who, append=-1) != 0, np.diff(at, axis=0, append=np.inf)
    move, rest = np.flatnonzero(~last & (step[:, 0] > 0)), np.flatnonzero(last & ~gone[who])
    moment = np.setdiff1d(np.arange(len(who)), np.concatenate([move, move + 1, rest]))
    place, speed = np.concatenate([move, rest, moment]), np.zeros((len(who), 2))
    speed[: len(move)] = step[move, 1:] / step[move, :1]
    ends = np.concatenate([at[move + 1, 0], at[rest, 0] + np.inf, at[moment, 0]])
    claim, planned = plan["certificate"], plan["planned"]
    horizon, by = planned["horizon_s"], planned.get("found_by_s")
    net = json.loads((folder / "net.json").read_text())
    run = Run(net=net, xy=np.array(net["node_xy_m"]), radius=planned["radius_m"], by=by)
    run.transit, run.speed, run.step = (claim[n] for n in ("transit", "speed_mps", "bin_s"))
    run.pieces = np.column_stack([at[place, 0], ends, at[place, 1:], speed[: len(place)]])
    run.who = who[place]
    run.weight, rows = np.array(told["weight"]), zip(prices["flight"], prices["price"], strict=True)
    run.prices = {tuple(flight): np.array(price) for flight, price in rows}
    run.reward = lambda t: np.maximum(0, horizon - t) if by is None else 1.0 * (t <= by)
    run.until = lambda p: horizon - p if by is None else np.where(p < 1, by + 1e-9, -np.inf)
    return run


def keeps_to_roads(run: Run, flight: Any) -> bool:
    """Tell whether roads meet their nodes, and waypoints after take-off lie on roads."""
    net, shapes = run.net, [np.array(shape) for shape in run.net["shape_m"]]
    ends = run.xy[np.column_stack([net["road_from"], net["road_to"]])]
    meet = np.allclose(ends, [shape[[0, -1]] for shape in shapes], atol=0.01)
    aside = flight[1:, None, 1:] - np.concatenate(shapes)
    return bool(meet and np.all(np.hypot(aside[..., 0], aside[..., 1]).min(axis=1) <= 0.01))


def main() -> int:
    """Check the run in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder of a certified run")
    folder = parser.parse_args().directory
    try:
        plan = json.loads((folder / "plan.json").read_text())
        claim, planned, run = plan["certificate"], plan["planned"], read(folder, plan)
    except (OSError, KeyError, ValueError) as error:
        parser.error(f"{folder}: holds no certified run ({error}); `planner certify` makes one")
    flight, horizon = np.array(plan["uavs"][0]["waypoints"]), planned["horizon_s"]
    seen, (take_off, *place) = sees(run, flight, plan["uavs"][0]["sensor_on"]), flight[0]
    time = run.weight @ np.minimum(seen, horizon) + max(0.0, 1 - run.weight.sum()) * horizon
    step, most = np.diff(flight, axis=0), free_bound(run, take_off, place)
    fits = bool(np.all(np.hypot(*step[:, 1:].T) <= run.speed * step[:, 0] + 0.01))
    if claim["plan_class"] == "roads":
        fits = fits and keeps_to_roads(run, flight)
        landing = claim["landing_s"] or np.inf
        most = min(most, road_bound(run, take_off, np.array(place), landing))
    told = planned["expected_detection_time_s"]
    rows = [("expected detection time", told, time, abs(told - time) <= TOLERANCE * horizon)]
    if run.by is None:
        key, value, bound = "lower_bound_s", time, horizon - most
        no_better = claim[key] <= bound + TOLERANCE * horizon
    else:
        key, value, bound = "upper_bound_probability", run.weight @ run.reward(seen), most
        told, no_better = planned["found_by_probability"], claim[key] >= most - TOLERANCE
        rows.append(("probability", told, value, abs(told - value) <= TOLERANCE))
    gap = abs(value - claim[key]) / claim[key]
    rows.append((key.replace("_", " "), claim[key], bound, no_better))
    rows.append(("gap", claim["gap"], gap, abs(claim["gap"] - gap) <= TOLERANCE))
    print(f"flight within the UAV's speed, over the roads if it says so: {fits}")
    for name, claimed, found, right in rows:
        print(f"{name}: claimed {claimed}, found {found:.6f}: {'holds' if right else 'WRONG'}")
    return 0 if fits and all(right for _, _, _, right in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
