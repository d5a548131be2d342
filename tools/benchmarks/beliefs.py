"""What caution costs where the belief is right, and saves where it is wrong.

Plans for the grid's belief alone and with a tenth of a widened one, against truths that not even
the widened one holds. Several seeds; differences are paired by seed, as both meet the same targets.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.figures import Figure
from benchmarks.grid import fresh, opened_at
from benchmarks.misses import planned
from planner import Futures, evaluate, problem_of
from planner.futures.truncate import parked
from planner.intervals import ratio_of_means

CAUTION, COSTS = 0.1, 2.0  # percent where the belief is right, at most
ELSEWHERE = ("r1c1-r1c2", "r1c1-r2c1")  # another start road, with equal odds
FASTER = "[19.5, 32.5]"  # m/s: by 30 %
RIGHT = "as believed"


def caution_rows(u0_km: int, seeds: int, targets: int) -> Iterator[Figure]:
    """Yield the expected times of both kinds of plans, and what caution costs, by truth."""
    sure, wary = (
        [
            planned(opened_at(u0_km, f"target.caution={share}", seed=k + 1)).plan
            for k in range(seeds)
        ]
        for share in (0.0, CAUTION)
    )
    problem = problem_of(opened_at(u0_km), judges := fresh(opened_at(u0_km), targets))
    for truth, true in truths(u0_km, judges).items():
        sure_s, wary_s = (
            np.array(
                [
                    evaluate(
                        plan.tracks, true, problem.sensor, problem.objective
                    ).expected_detection_time_s
                    for plan in plans
                ]
            )
            for plans in (sure, wary)
        )
        ratio, half = ratio_of_means(wary_s, sure_s)
        yield Figure(f"{truth}: E without caution", "s", tuple(sure_s.tolist()))
        yield Figure(f"{truth}: E with caution {CAUTION:g}", "s", tuple(wary_s.tolist()))
        at_most = COSTS if truth == RIGHT else None
        yield Figure(f"{truth}: caution costs", "%", (100.0 * (ratio - 1.0),), at_most)
        yield Figure(f"{truth}: the same, +-", "%", (100.0 * half,))


def truths(u0_km: int, believed: Futures) -> dict[str, Futures]:
    """Return what may be true, by name."""
    rng, many = np.random.default_rng(7), len(believed)
    start = ", ".join(f'"{road}" = {1.0 / len(ELSEWHERE)}' for road in ELSEWHERE)
    faster = opened_at(u0_km, f"truth.speed_mps={{ uniform = {FASTER} }}")
    elsewhere = opened_at(u0_km, f"truth.start={{ {start} }}")
    return {
        RIGHT: believed,
        "parks for good": parked(believed, rng),
        "turns back": turned_back(believed, rng),
        "30 % faster": fresh(faster, many),
        "another start road": fresh(elsewhere, many),
    }


def turned_back(futures: Futures, rng: np.random.Generator) -> Futures:
    """Return the same targets, each of which turns somewhere on its way, and drives back to rest.

    The times at which they turn are those at which `parked` has them stop.
    """
    out = parked(futures, rng)
    count = np.diff(out.first_knot)
    last = np.repeat(out.first_knot[1:] - 1, 2 * count - 1)  # where each of the new knots turns
    first = np.concatenate(([0], np.cumsum(2 * count - 1)))
    step = np.arange(first[-1]) - np.repeat(first[:-1] + count - 1, 2 * count - 1)
    knot, turned_s = last - np.abs(step), out.time_s[last]
    return Futures(
        time_s=np.where(step > 0, 2.0 * turned_s - out.time_s[knot], out.time_s[knot]),
        x_m=out.x_m[knot],
        y_m=out.y_m[knot],
        first_knot=first,
        weight=out.weight,
        gone=np.zeros(len(out), dtype=bool),
    )
