"""Check a certified plan without the code that made it: verify.py DIR.

Reads plan.json, knots.parquet, prices.parquet and net.json of a run that `planner certify` has been
through, computes the plan's expected time and the bound of the particle prices anew, and says
whether the claims in plan.json hold (exit code 0) or not (1). What the bound is stands at the head
of planner/search/bound.py; nothing is imported from there.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet

TOLERANCE = 1e-6  # of the horizon, or of one for probabilities
Run = dict[str, Any]


def motions(at: Any) -> Any:
    """Return from, to, place at from and velocity, (S, 6), between rows of time and place."""
    step = np.diff(at, axis=0)
    some = step[:, 0] > 0
    return np.column_stack(
        [at[:-1, 0], at[1:, 0], at[:-1, 1:], step[:, 1:] / np.where(some, step[:, 0], 1)[:, None]]
    )[some]


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


def flight_sees(run: Run, flight: Any, on: Any, radius: float) -> Any:
    """Return when a flight first sees each particle while the sensor is on, (N,)."""
    seen = np.full(len(run["price"]), np.inf)
    for begin, end in on:
        for a, b, x, y, ux, uy in motions(np.asarray(flight, dtype=float)):
            low, high = max(a, begin), min(b, end)
            if low <= high:
                leg = (low, high, x + ux * (low - a), y + uy * (low - a), ux, uy)
                np.minimum.at(seen, run["who"], meeting(leg, 0.0, run["pieces"], radius))
    return seen


def sweep(hop: Any, run: Run, radius: float, until: Any) -> Any:
    """Return when a hop, begun in the middle of each bin, first sees each particle, (bins, N)."""
    first, step, bins, pieces, who = (
        run[key] for key in ("first", "step", "bins", "pieces", "who")
    )
    seen = np.full((bins, len(until)), np.inf)
    for leg in hop:
        begin, end, x, y, ux, uy = leg
        to = np.minimum(pieces[:, 1], np.minimum(until[who], first + bins * step + end))
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
        np.minimum.at(seen, (i, who[p]), meeting(leg, first + i * step, pieces[p], radius))
    return seen


def hops_of(net: Run, speed: float) -> tuple[list[Any], int]:
    """Return from, to, and time and place of each hop's points, and how many hops are legs."""
    xy, hops, straight = np.array(net["node_xy_m"]), [], set()
    for a, b, shape in zip(net["road_from"], net["road_to"], net["shape_m"], strict=True):
        for start, end, points in ((a, b, np.array(shape)), (b, a, np.array(shape)[::-1])):
            after = np.cumsum(np.append(0, np.hypot(*np.diff(points, axis=0).T))) / speed
            hops.append((start, end, np.column_stack([after, points])))
            straight |= {(start, end)} if len(points) == 2 else set()
    legs = len(hops)
    for a, b in np.ndindex(len(xy), len(xy)):
        way, far = xy[b] - xy[a], np.hypot(*(xy[b] - xy[a]))
        if far > 0 and (a, b) not in straight:
            along, aside = (xy - xy[a]) @ way / far, np.abs((xy - xy[a]) @ (-way[1], way[0])) / far
            over = (along > 1e-6 * far) & (along < (1 - 1e-6) * far) & (aside < 1e-9 * far)
            if not over.any():
                hops.append((a, b, np.column_stack([(0, far / speed), xy[[a, b]]])))
    return hops, legs


def lasting(seconds: float, step: float) -> tuple[int, int]:
    """Return in how many bins from now a flight ends, at least and at most."""
    return int(np.floor(seconds / step + 1e-9)), int(np.ceil(seconds / step - 1e-9))


def sightings(run: Run, hops: list[Any], legs: int, radius: float) -> tuple[list[Any], Any]:
    """Return bin, particle and gain of what each hop may sell; what legs surely see."""
    slack, earns = run["step"] / 2, []
    sure = np.zeros((legs, run["bins"], len(run["price"])), dtype=bool)
    for h, (_, _, at) in enumerate(hops):
        wide = np.vstack([at[0], at, at[-1]]) + np.outer([-slack, *[0] * len(at), slack], (1, 0, 0))
        seen = np.full((1, len(run["price"])), np.inf)
        if h < legs or run["transit"]:
            seen = sweep(motions(wide), run, radius + run["speed"] * slack, run["until"])
        gain = run["weight"] * (run["reward"](seen) - run["price"])
        i, k = np.nonzero((gain > 0) & np.isfinite(seen))
        earns.append((i, k, gain[i, k]))
        if h < legs and radius > run["speed"] * slack:
            core = motions(at)
            cut = np.maximum(0, slack - core[:, 0])
            core[:, 2:4] += core[:, 4:] * cut[:, None]
            core[:, 0], core[:, 1] = core[:, 0] + cut, np.minimum(core[:, 1], at[-1, 0] - slack)
            core, late = core[core[:, 0] < core[:, 1]], np.full(len(run["price"]), np.inf)
            sure[h] = np.isfinite(sweep(core, run, radius - run["speed"] * slack, late))
    return earns, sure


def arcs_of(run: Run, hops: list[Any], legs: int, radius: float, nodes: int) -> tuple[Any, ...]:
    """Return walk before, walk then, least and most bins of each arc; gains by bin; walks."""
    (earns, sure), memory = sightings(run, hops, legs, radius), run["memory"]
    layer: list[Any] = [((), node) for node in range(nodes)]
    walks = list(layer)
    for _ in range(memory):
        layer = [((*w, h), hops[h][1]) for w, n in layer for h in range(legs) if hops[h][0] == n]
        walks += layer
    index, arcs, gains = {walk: i for i, walk in enumerate(walks)}, [], []
    for h, (start, end, at) in enumerate(hops):
        i, k, gain = earns[h]
        for walk, _ in [one for one in walks if one[1] == start and (h < legs or one[0] == ())]:
            new = np.ones(len(i), dtype=bool)
            for back in range(len(walk)):
                ago = np.array(lasting(sum(hops[g][2][-1, 0] for g in walk[back:]), run["step"]))
                when = np.maximum(0, i - ago[:, None])
                new &= ~(sure[walk[back], when, k].all(axis=0) & (i >= ago[1]))
            then = (*walk, h)[-memory:] if h < legs and memory else ()
            gains.append(np.bincount(i[new], gain[new], minlength=run["bins"]))
            arcs.append((index[walk, start], index[then, end], *lasting(at[-1, 0], run["step"])))
    return np.array(arcs).T, np.array(gains), np.array([node for _, node in walks])


def road_bound(run: Run, plan: Run, net: Run, radius: float) -> float:
    """Return the greatest expected reward of a road plan that the prices allow."""
    xy, (take_off, *place) = np.array(net["node_xy_m"]), plan["uavs"][0]["waypoints"][0]
    run["memory"], run["step"] = (plan["certificate"][key] for key in ("memory", "bin_s"))
    arrive = take_off + np.hypot(*(xy - place).T) / run["speed"]
    first, landing = arrive.min(), plan["certificate"]["landing_s"] or np.inf
    bins = max(1, int(np.ceil((min(run["ends"], landing) - first) / run["step"])) + 1)
    run |= {"first": first, "bins": bins}
    hops, legs = hops_of(net, run["speed"])
    (before, then, least, most), gains, at_node = arcs_of(run, hops, legs, radius, len(xy))
    if least.min() < 1:
        return float(np.inf)  # such bins prove nothing
    worth, best = np.zeros((len(at_node), bins + most.max() + 1)), np.zeros(len(xy))
    for i in range(bins - 1, -1, -1):
        value = gains[:, i] + np.maximum(worth[then, i + least], worth[then, i + most])
        np.maximum.at(worth[:, i], before, value)
        best[:] = 0  # of straight flights, which may follow any walk
        straight = slice(len(before) - len(hops) + legs, None)
        np.maximum.at(best, before[straight], value[straight])
        worth[:, i] = np.maximum(worth[:, i], best[at_node])
    above = []
    for node, at in enumerate(arrive):
        on = [(take_off, at)] if run["transit"] else []
        seen = flight_sees(run, [(take_off, *place), (at, *xy[node])], on, radius)
        i = min(round((at - first) / run["step"]), bins)
        sold = run["weight"] @ np.maximum(0, run["reward"](seen) - run["price"])
        above.append(sold + worth[node, i] * (i < bins))
    return float(run["weight"] @ run["price"] + max(above))


def free_bound(run: Run, plan: Run, radius: float) -> float:
    """Return the expected reward if each particle is met as soon as the UAV can be there."""
    (take_off, x, y), (a, b, px, py, vx, vy) = plan["uavs"][0]["waypoints"][0], run["pieces"].T
    on, speed = np.maximum(a, take_off), run["speed"]
    qx, qy, ring = px + vx * (on - a) - x, py + vy * (on - a) - y, radius + speed * (on - take_off)
    square, half, c = (
        vx**2 + vy**2 - speed**2,
        qx * vx + qy * vy - ring * speed,
        qx**2 + qy**2 - ring**2,
    )
    root = np.sqrt(np.where(half**2 >= square * c, half**2 - square * c, np.nan))
    with np.errstate(divide="ignore", invalid="ignore"):
        roots = c / (np.array([root, -root]) - half)
    after = np.where(c <= 0, 0, np.where(roots >= 0, roots, np.inf).min(axis=0))
    seen = np.full(len(run["price"]), np.inf)
    np.minimum.at(seen, run["who"], np.where(on + after <= b, on + after, np.inf))
    return float(run["weight"] @ run["reward"](seen))


def read(folder: Path, plan: Run) -> Run:
    """Return the particles' motion, weights and prices, and what a sighting is worth."""
    knots, told = (
        {name: np.array(column) for name, column in table.to_pydict().items()}
        for table in map(
            pyarrow.parquet.read_table, (folder / "knots.parquet", folder / "prices.parquet")
        )
    )
    who, at = knots["particle"], np.column_stack([knots[name] for name in ("time_s", "x_m", "y_m")])
    last = np.flatnonzero(np.diff(who, append=-1))
    ends = at[last[~told["gone"][who[last]]]]
    still = np.column_stack([ends[:, 0], np.full(len(ends), np.inf), ends[:, 1:], 0 * ends[:, 1:]])
    pieces = [motions(at[who == k]) for k in range(len(told["price"]))]
    whose = np.repeat(np.arange(len(pieces)), [len(some) for some in pieces])
    horizon, by, price = (
        plan["planned"]["horizon_s"],
        plan["planned"].get("found_by_s"),
        told["price"],
    )
    return told | {
        "pieces": np.concatenate([*pieces, still]),
        "who": np.concatenate([whose, who[last][~told["gone"][who[last]]]]),
        "ends": min(horizon, by or np.inf),
        "until": horizon - price if by is None else np.where(price < 1, by, -np.inf),
        "reward": lambda t: np.maximum(0, horizon - t) if by is None else 1.0 * (t <= by),
        "speed": plan["certificate"]["speed_mps"],
        "transit": plan["certificate"]["transit"],
    }


def main() -> int:
    """Check the run in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder of a certified run")
    folder = parser.parse_args().directory
    try:
        plan, net = (json.loads((folder / name).read_text()) for name in ("plan.json", "net.json"))
        run = read(folder, plan)
    except (OSError, KeyError) as error:
        parser.error(f"{folder}: holds no certified run ({error}); `planner certify` makes one")
    claim, planned, uav = plan["certificate"], plan["planned"], plan["uavs"][0]
    radius, horizon, weight, by = (
        planned["radius_m"],
        planned["horizon_s"],
        run["weight"],
        planned.get("found_by_s"),
    )
    hop_s, way_m = (
        np.diff(np.array(uav["waypoints"]), axis=0)[:, 0],
        np.diff(np.array(uav["waypoints"])[:, 1:], axis=0),
    )
    fits = bool(np.all(np.hypot(*way_m.T) <= run["speed"] * hop_s + 0.01)) and bool(
        np.all(run["price"] >= 0)
    )
    seen = flight_sees(run, uav["waypoints"], uav["sensor_on"], radius)
    time = float(weight @ np.minimum(seen, horizon)) + max(0.0, 1 - weight.sum()) * horizon
    roads = claim["plan_class"] == "roads"
    most = road_bound(run, plan, net, radius) if roads else free_bound(run, plan, radius)
    bound, value = (
        (horizon - most, time) if by is None else (most, float(weight @ run["reward"](seen)))
    )
    rows = [("expected detection time", planned["expected_detection_time_s"], time, horizon)]
    rows += [] if by is None else [("probability", planned["found_by_probability"], value, 1.0)]
    key, scale = ("lower_bound_s", horizon) if by is None else ("upper_bound_probability", 1.0)
    rows += [
        ("bound", claim[key], bound, scale),
        ("gap", claim["gap"], abs(value - bound) / bound, 1.0),
    ]
    print(f"flight within the UAV's speed, prices not negative: {fits}")
    for name, told, found, unit in rows:
        right = told is not None and abs(told - found) <= TOLERANCE * unit
        fits = fits and right
        print(f"{name}: claimed {told}, found {found:.6f}: {'holds' if right else 'WRONG'}")
    return 0 if fits else 1


if __name__ == "__main__":
    sys.exit(main())
