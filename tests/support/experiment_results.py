"""Results of experiments made up of simple rules, for what reports on them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from planner.experiments.condition import Condition
from planner.experiments.run import Results, run
from planner.paper import claims_crossing
from planner.paper.figures import ALL, ALL_20, PATHS, SPEEDS, U0
from planner.report.estimates import BEFORE_GOAL, EXPECTED, FOUND

BELIEVED = claims_crossing.BELIEVED
SETS = (ALL, ALL_20, BELIEVED, *PATHS, *(f"{path}, 20 m/s" for path in PATHS))
DISTANCES = (0.0, 60e3, 120e3, 150e3, 700e3)
WHO = (
    ("no planning", "exhaustive"),
    ("no planning", "exhaustive-shortest"),
    ("300 s", "greedy"),
    ("300 s", "best"),
    ("1 s", "greedy"),
    ("1 s", "best"),
)

Time = Callable[[str, float], float]


def exhaustive_until(km: float) -> Time:
    """Exhaustive search finds at once up to a distance and never beyond; the others in between."""

    def time_s(method: str, u0_m: float) -> float:
        if method.startswith("exhaustive"):
            return 500.0 if u0_m <= km * 1000 else 10_000.0
        return {"greedy": 3000.0, "best": 2000.0}[method] + u0_m / 200

    return time_s


def figure8(time_s: Time, *, before: float = 0.9, sets: tuple[str, ...] = SETS) -> Results:
    rows: list[dict[str, Any]] = []
    figures: dict[str, Any] = {}
    for block, method in WHO:
        for u0 in DISTANCES:
            for seed in (1,) if block == "no planning" else (1, 2):
                name = f"{block} {method} {u0} {seed}"
                value = time_s(method, u0) + (seed if block != "no planning" else 0)
                figures[name] = {"sets": {one: {"routes": {"A": [1.0, value]}} for one in sets}}
                rows += [
                    {
                        "id": name,
                        "block": block,
                        "method": method,
                        "seed": seed,
                        U0: u0,
                        "targets": one,
                        EXPECTED: value,
                        FOUND: float(value < 10_000),
                        BEFORE_GOAL: before,
                        "reason": None,
                    }
                    for one in sets
                ]
    return Results(tuple(rows), len(rows), figures)


def figure9(slope: float) -> Results:
    """Times that rise, or fall, with the target's speed."""
    rows = []
    for block, method in (("no planning", "exhaustive-shortest"), ("300 s", "greedy")):
        for path in (ALL, PATHS[3]):
            for speed in SPEEDS:
                for u0 in DISTANCES:
                    value = 5000.0 + slope * speed
                    name = f"{path}, {speed} m/s"
                    row = {"id": "one", "block": block, "method": method, "seed": 1, U0: u0}
                    found = float(u0 <= (30 - speed) * 10e3)
                    rows.append(row | {"targets": name, EXPECTED: value, FOUND: found})
    goals = {f"{ALL}, {speed} m/s": {"goal_s": [150e3 / speed] * 2} for speed in SPEEDS}
    return Results(tuple(rows), len(rows), {"one": {"sets": goals}})


def run_alone(conditions: Sequence[Condition], out: Path, **how: Any) -> Results:
    """Run one experiment with nothing beside it."""
    return run({out: conditions}, **how)[out]
