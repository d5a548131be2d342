"""Score a flight on recorded futures: E[min(tau, horizon)] and P(found), each with 95 % of it.

    python score.py INSTANCE PLAN.json [--futures planning.npz] [--detects 0.8]
    python score.py --test test          # flights whose scores are known

INSTANCE is a folder with an instance.json; PLAN.json holds {"uavs": [{"waypoints": [[time_s, x_m,
y_m], ...]}, ...]}, as plan.json does. Needs NumPy and nothing else. Within its radius R of a target
a UAV detects it at the rate -ln(1 - p) v / (2 R), v its speed, so that flying straight over it does
with probability p; the exposure adds up over all contacts and UAVs. With p = 1 the first contact is
the detection.
"""

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Json = dict[str, Any]
Z = 1.959963984540054  # the 97.5 % point of the standard normal distribution


def ways_of(plan: Any) -> list[Array]:
    """Return the waypoints of each UAV, (W, 3) each; ValueError if a plan holds none."""
    try:
        ways = [np.array(one["waypoints"], float)[:, :3] for one in plan["uavs"]]
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ValueError(
            'should hold {"uavs": [{"waypoints": [[time_s, x_m, y_m], ...]}, ...]}'
        ) from error
    if not ways or any(way.shape[0] < 1 or way.shape[1] < 3 for way in ways):
        raise ValueError("should hold time_s, x_m and y_m of one waypoint or more for each UAV")
    return ways


def flights_of(plan: Any, instance: Json) -> list[Array]:
    """Return the waypoints of each UAV; ValueError if its UAV cannot fly them."""
    uavs, ways = instance["uavs"], ways_of(plan)
    if len(ways) > len(uavs):
        raise ValueError(f"flies {len(ways)} UAVs, and the instance has {len(uavs)}")
    for number, (way, uav) in enumerate(zip(ways, uavs, strict=False)):
        who = f"uavs[{number}]"
        start, seconds = (uav["take_off_s"], uav["x_m"], uav["y_m"]), np.diff(way[:, 0])
        if not np.isfinite(way).all() or (seconds < 0).any():
            raise ValueError(f"{who}: times should never fall, and all be finite")
        if not np.allclose(way[0], start, rtol=0, atol=0.01):
            raise ValueError(f"{who}: should begin with {list(start)}, not {way[0].tolist()}")
        if (np.hypot(*np.diff(way[:, 1:], axis=0).T) > uav["speed_mps"] * seconds + 0.01).any():
            raise ValueError(f"{who}: is faster than {uav['speed_mps']} m/s")
        if uav["landing_s"] is not None and way[-1, 0] > uav["landing_s"] + 0.01:
            raise ValueError(f"{who}: is in the air after {uav['landing_s']} s")
        home = uav["return_to_m"]
        if home is not None and not np.allclose(way[-1, 1:], home, rtol=0, atol=0.01):
            raise ValueError(f"{who}: should end at {home}")
    return ways


def contacts(way: Array, motion: Array, gone: bool, radius_m: float) -> Array:
    """Return from and to when a UAV has a target within the radius, (C, 2) seconds.

    Both move straight from point to point, (time, x, y); the sensor is on during the flight, and
    the target is there from its first point to its last, or for ever if it is not gone then.
    """
    if len(motion) == 0:
        return np.zeros((0, 2))
    begin, end = max(way[0, 0], motion[0, 0]), min(way[-1, 0], motion[-1, 0] if gone else math.inf)
    if begin > end:
        return np.zeros((0, 2))
    times = np.concatenate([way[:, 0], motion[:, 0], [begin, end]])
    times = np.unique(times[(times >= begin) & (times <= end)])
    times = np.append(times, times[-1])  # so that a single moment is a piece as well
    off = [
        np.interp(times, *way[:, [0, k]].T) - np.interp(times, *motion[:, [0, k]].T) for k in (1, 2)
    ]
    (x, dx), (y, dy) = ((one[:-1], np.diff(one)) for one in off)
    # |off + share * step| <= radius, a square in the share of each piece that has passed
    a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - radius_m**2
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - a * c)
        enters = np.where(a > 0, (-b - root) / a, np.where(c <= 0, 0.0, np.nan))
        leaves = np.where(a > 0, (-b + root) / a, np.where(c <= 0, 1.0, np.nan))
    inside = (enters <= 1) & (leaves >= 0)
    spans = np.stack([np.clip(enters, 0, 1), np.clip(leaves, 0, 1)], axis=1)[inside]
    within: Array = times[:-1][inside, None] + spans * np.diff(times)[inside, None]
    return within


def outcome(spans: Array, rate: Array, horizon_s: float) -> tuple[float, float]:
    """Return E[min(tau, horizon)] and P(tau <= horizon) of one target, from all contacts with it.

    Parameters
    ----------
    spans, rate
        (C, 2) seconds, from and to, and (C,) per second; infinite: detected at once.
    """
    spans, rate = spans[spans[:, 0] <= horizon_s], rate[spans[:, 0] <= horizon_s]
    if len(spans) == 0:
        return horizon_s, 0.0
    if np.isinf(rate).any():
        return float(spans[:, 0].min()), 1.0
    times = np.unique(np.concatenate([[0.0, horizon_s], np.minimum(spans, horizon_s).ravel()]))
    active = (spans[:, :1] <= times[:-1]) & (spans[:, 1:] >= times[1:])
    hazard, lasts = rate @ active, np.diff(times)
    unseen = np.exp(-np.concatenate([[0.0], np.cumsum(hazard * lasts)]))
    steady = np.where(hazard > 0, hazard, 1.0)
    spent = np.where(hazard > 0, (unseen[:-1] - unseen[1:]) / steady, unseen[:-1] * lasts)
    return float(spent.sum()), float(1.0 - unseen[-1])


def score(instance: Json, plan: Any, futures: Json, detects: float | None = None) -> Json:
    """Return E and P of a plan with their 95 % intervals."""
    sensor, horizon_s = instance["sensor"], float(instance["horizon_s"])
    radius_m, p = sensor["radius_m"], sensor["detects"] if detects is None else detects
    tracks, first = flights_of(plan, instance), futures["first_knot"]
    rates = [
        math.inf if p >= 1 else -math.log1p(-p) * uav["speed_mps"] / (2 * radius_m)
        for uav in instance["uavs"]
    ]
    motion = np.stack([futures[k] for k in ("time_s", "x_m", "y_m")], axis=1).astype(float)
    rows = []
    for k, gone in enumerate(futures["gone"]):
        mine = motion[first[k] : first[k + 1]]
        met = [contacts(way, mine, gone, radius_m) for way in tracks]
        rate = np.repeat(rates[: len(met)], [len(one) for one in met])
        rows.append(outcome(np.concatenate(met), rate, horizon_s))
    time_s, found = np.array(rows).T
    weight = futures["weight"]  # the rest of the probability: there is no target to be found
    share, there = weight / weight.sum(), weight.sum()
    draws = 1.0 / (share @ share)
    mean_s, seen = share @ time_s, share @ found
    spread = math.sqrt(share**2 @ (time_s - mean_s) ** 2)
    half_s = Z * there * spread * math.sqrt(draws / (draws - 1)) if draws > 1.5 else math.inf
    expected_s, z2 = there * mean_s + (1 - there) * horizon_s, Z * Z / draws
    middle, half = seen + z2 / 2, math.sqrt(max(0.0, seen * (1 - seen)) * z2 + z2 * z2 / 4)
    return {
        "expected_detection_time_s": float(expected_s),
        "ci95_s": [float(expected_s - half_s), float(expected_s + half_s)],
        "detection_probability": float(there * seen),
        "detection_ci95": [float(there * (middle + s * half) / (1 + z2)) for s in (-1, 1)],
    }


def test(folder: Path) -> float:
    """Print the scores of test flights beside those known; return the greatest difference."""
    instance, futures = read(folder)
    most = 0.0
    for flight in json.loads((folder / "flights.json").read_text(encoding="utf-8")):
        found, known = score(instance, flight, futures, flight["detects"]), flight["score"]
        numbers = [np.hstack([*scored.values()]) for scored in (found, known)]
        most = max(most, float(np.abs(numbers[0] - numbers[1]).max()))
        print(f"{flight['name']:40} {found['expected_detection_time_s']:10.3f} s")
    print(f"at most {most:.2g} from the scores known")
    return most


def read(folder: Path, futures: str = "judging.npz") -> tuple[Json, Json]:
    """Return an instance and its futures."""
    with np.load(folder / futures) as file:
        columns = dict(file)
    return json.loads((folder / "instance.json").read_text(encoding="utf-8")), columns


def main() -> None:
    """Print the score of a plan as JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("instance", type=Path, help="folder with instance.json and its futures")
    parser.add_argument("plan", nargs="?", type=Path, help="JSON with the waypoints of each UAV")
    parser.add_argument("--futures", default="judging.npz", help="(default: %(default)s)")
    parser.add_argument("--detects", type=float, help="p in place of the instance's")
    parser.add_argument("--test", action="store_true", help="score the flights of a test folder")
    wanted = parser.parse_args()
    if wanted.test:
        raise SystemExit(int(test(wanted.instance) > 0.001))
    if wanted.plan is None:
        parser.error("name a plan")
    try:
        instance, futures = read(wanted.instance, wanted.futures)
    except (OSError, ValueError, KeyError) as error:
        parser.error(f"{wanted.instance}: is no folder of an instance ({error})")
    try:
        plan = json.loads(wanted.plan.read_text(encoding="utf-8"))
        found = score(instance, plan, futures, wanted.detects)
    except (OSError, ValueError) as error:
        parser.error(f"{wanted.plan}: {error}")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
