"""Claims of Section 5 on the target's speed: Figure 9."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from planner.experiments.results import Row
from planner.messages import percent
from planner.paper.claims import Claim, ResultsByName, Verdict, markdown_table
from planner.paper.claims_shared import EXHAUSTIVE, GREEDY, UNDER_READING, well_under
from planner.paper.figures import ALL, HORIZON_S, PATHS, SPEEDS, U0
from planner.report.estimates import FOUND, Estimate, chosen, difference, estimate, levels
from planner.report.formats import km

READING = (
    "preset `paper`, targets at 15, 20 and 25 m/s, over all paths and on EESSSEESSE; paired by seed"
)


def claims(found: ResultsByName) -> Iterator[Claim]:
    """Yield what Figure 9 says of the paper's claims."""
    if "figure9" not in found:
        return
    rows = found["figure9"].rows
    yield _grows_with_speed(rows)
    yield _earlier_failure(rows)
    yield _stays_under(rows)
    yield _arrives(found)


def _longer(
    rows: Sequence[Row], who: Mapping[str, Any], path: str, u0: float, slower: int = SPEEDS[0]
) -> Estimate | None:
    """Return by how much longer the fastest targets take to be found than slower ones."""
    fast, slow = (
        chosen(rows, {**who, U0: u0, "targets": f"{path}, {speed} m/s"})
        for speed in (SPEEDS[-1], slower)
    )
    return difference(fast, slow)


def _grows_with_speed(rows: Sequence[Row]) -> Claim:
    lines, signs = [], {"greedy": [0, 0], "exhaustive": [0, 0]}
    middle = [0, 0]
    for u0 in sorted(levels(rows, U0)):
        cells = [km(u0)]
        for name, who in (("greedy", GREEDY), ("exhaustive", EXHAUSTIVE)):
            for path in (ALL, PATHS[3]):
                one = _longer(rows, who, path, u0)
                cells.append(one.change if one else "-")
                if path == ALL:
                    _count(signs[name], one)
        from_20 = _longer(rows, GREEDY, ALL, u0, SPEEDS[1])
        cells.append(from_20.change if from_20 else "-")
        _count(middle, from_20)
        lines.append(cells)
    counts = "; ".join(
        f"{name}: longer at {up} distances, shorter at {down}, of {len(lines)}"
        for name, (up, down) in signs.items()
    )
    falls = sum(down for _, down in signs.values())
    header = ["u0", "greedy, all paths", "greedy, one path", "exhaustive, all", "exhaustive, one"]
    return Claim(
        "In both search methods, by increasing the velocity of the target, the detection time "
        "increases",
        "Section 5",
        READING,
        "in part" if falls else "reproduced",
        f"From 15 to 25 m/s the mean detection time over all paths gets, {counts}. Where neither, "
        f"no target of either speed is found in time, or chance explains it. {_edge(rows)} From "
        f"20 to 25 m/s greedy's gets longer at {middle[0]} distances and shorter at {middle[1]}.",
        markdown_table([*header, "greedy, all, from 20 to 25 m/s"], lines),
    )


def _count(signs: list[int], one: Estimate | None) -> None:
    """Count an increase or a decrease that chance does not explain."""
    if one:
        signs[0] += one.low > 0
        signs[1] += one.high < 0


def _earlier_failure(rows: Sequence[Row]) -> Claim:
    last = {}
    for speed in SPEEDS:
        where = {**EXHAUSTIVE, "targets": f"{ALL}, {speed} m/s"}
        found = {u0: estimate(rows, {**where, U0: u0}, FOUND) for u0 in levels(rows, U0)}
        half = [u0 for u0, one in found.items() if one and one.mean >= 0.5]
        some = [u0 for u0, one in found.items() if one and one.mean > 0.001]
        last[speed] = (max(half, default=0.0), max(some, default=0.0))
    falling = all(last[slow][0] >= last[fast][0] for slow, fast in pairwise(SPEEDS))
    return Claim(
        "In exhaustive search a higher velocity results in earlier failure (for shorter distance "
        "between the UAV and origin)",
        "Section 5",
        READING,
        "reproduced" if falling and last[15][0] > last[25][0] else "in part",
        "The shortest exhaustive search finds at least half, and any, of the targets up to: "
        + "; ".join(f"{speed} m/s: {km(half)}, {km(some)}" for speed, (half, some) in last.items())
        + ".",
    )


def _stays_under(rows: Sequence[Row]) -> Claim:
    means = [
        (one.within(0.0, HORIZON_S), path, speed, u0)
        for path in (ALL, PATHS[3])
        for speed in SPEEDS
        for u0 in levels(rows, U0)
        for one in [estimate(rows, {**GREEDY, U0: u0, "targets": f"{path}, {speed} m/s"})]
        if one
    ]
    worst, path, speed, u0 = max(means, key=lambda item: item[0].mean)
    above = {one_path for one, one_path, _, _ in means if not well_under(one)}
    verdict: Verdict = "not reproduced" if ALL in above else "in part" if above else "reproduced"
    return Claim(
        "In simulation-aided search the detection time stays considerably under 10,000 s for all "
        "three velocities",
        "Section 5",
        f"{READING}; {UNDER_READING}",
        verdict,
        f"The largest mean is {worst.seconds}: {path}, {speed} m/s, {km(u0)}. {_edge(rows)} "
        "The table has how many targets greedy finds at all.",
        _found_table(rows),
    )


def _edge(rows: Sequence[Row]) -> str:
    """Tell how often greedy misses slow targets for good, beside fast ones."""
    missed = {}
    for speed in (SPEEDS[0], SPEEDS[-1]):
        where = {**GREEDY, "targets": f"{ALL}, {speed} m/s"}
        found = {u0: estimate(rows, {**where, U0: u0}, FOUND) for u0 in levels(rows, U0)}
        missed[speed] = max((1.0 - one.mean, u0) for u0, one in found.items() if one)
    (slow, at_m), (fast, fast_at_m) = missed[SPEEDS[0]], missed[SPEEDS[-1]]
    missing = (
        f"Greedy never finds up to {percent(slow)} of the targets at {SPEEDS[0]} m/s (at "
        f"{km(at_m)}) and up to {percent(fast)} of those at {SPEEDS[-1]} m/s (at "
        f"{km(fast_at_m)})"
    )
    if slow <= fast:
        return f"{missing}."
    return (
        f"{missing}: slow ones from the origin are the edge of what the UAV believes, so that a "
        "plan which has met all its particles can miss one that lags behind."
    )


def _found_table(rows: Sequence[Row]) -> str:
    lines = []
    for u0 in sorted(levels(rows, U0)):
        found = [
            estimate(rows, {**GREEDY, U0: u0, "targets": f"{ALL}, {speed} m/s"}, FOUND)
            for speed in SPEEDS
        ]
        cells = [one.percent if one else "-" for one in found]
        lines.append([km(u0), *cells])
    return markdown_table(["u0", *(f"found, {speed} m/s" for speed in SPEEDS)], lines)


def _arrives(found: ResultsByName) -> Claim:
    results = found["figure9"]
    first = chosen(results.rows, {"targets": f"{ALL}, 15 m/s"})[0]["id"]
    sets = results.figures[first]["sets"]
    fast, slow = (sets[f"{ALL}, {speed} m/s"]["goal_s"] for speed in (SPEEDS[-1], SPEEDS[0]))
    same = abs(fast[0] - 6000) < 1 and abs(slow[1] - 10_000) < 1
    return Claim(
        "The target reaches its goal after a time between 6,000 and 10,000 seconds",
        "Section 5",
        "as SUMO drives it, from the origin, at 25 and at 15 m/s, on all paths",
        "reproduced" if same else "not reproduced",
        f"Between {fast[0]:,.1f} and {slow[1]:,.1f} s.",
    )
