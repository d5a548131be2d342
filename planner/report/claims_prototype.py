"""Figures of an earlier program that shares no line with this one, beside this one's."""

import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from planner.report.claims import Claim, Found, markdown_table
from planner.report.claims_crossing import exhaustive_wins
from planner.report.claims_shared import EXHAUSTIVE, GREEDY
from planner.report.estimates import (
    BEFORE_GOAL,
    EXPECTED,
    U0,
    Estimate,
    Row,
    chosen,
    estimate,
    levels,
)
from planner.report.experiment_figures import ALL, ALL_20
from planner.report.units import km

THEIR_SEEDS = 10
THEIR_ERROR = {EXPECTED: 12.0, BEFORE_GOAL: 0.005}  # standard error of its 20,000 targets, at most
Z95 = 1.96
ODD_M = 60e3  # where ten seeds say least


@dataclass(frozen=True)
class Told:
    """What the earlier program told of a method, by u0 in kilometres."""

    name: str
    where: Mapping[str, Any]  # which of our rows say the same
    values: Mapping[int, float]  # E[min(tau, 10,000 s)] in seconds, or a probability
    figure: str = EXPECTED
    why: str = ""  # ours is another where it is


U0S_KM = (0, 60, 120, 180, 300, 500, 700)
GREEDY_0 = {"block": "greedy", "method": "greedy"}


def _by_u0(*values: float) -> dict[int, float]:
    return dict(zip(U0S_KM, values, strict=True))


THEIRS_AT_300 = {0: 785, 60: 2583, 120: 3548}
OWN = {**GREEDY_0, "greedy.direction": "own"}
TOLD = (
    Told(
        "exhaustive, FIFO",
        {"method": "exhaustive"},
        _by_u0(840, 8563, 10000, 10000, 10000, 10000, 10000),
    ),
    Told("wait at the goal", {"method": "wait"}, _by_u0(6815, 7448, 7160, 7416, 7350, 7429, 8297)),
    Told("greedy, own direction", OWN, _by_u0(230, 1570, 3073, 4265, 5534, 6956, 8183)),
    Told(
        "greedy, both directions",
        {**GREEDY_0, "greedy.direction": "both"},
        _by_u0(207, 1554, 2975, 4255, 5906, 7278, 8220),
    ),
    Told(
        "greedy, nearest end",
        {**GREEDY_0, "greedy.direction": "nearest end"},
        _by_u0(230, 1436, 2817, 3999, 5498, 6894, 8179),
        why="it breaks ties another way, as the next row shows",
    ),
    Told(
        "the same, ties to the earliest end",
        {"block": "ties"},
        _by_u0(230, 1436, 2817, 3999, 5498, 6894, 8179),
    ),
    Told("best", {"method": "best"}, _by_u0(208, 1206, 2305, 3448, 5071, 6600, 8164)),
    Told(
        "greedy, both directions, take-off at 300 s",
        {"block": "300 s"},
        THEIRS_AT_300,
    ),
    Told("greedy, own: found before the goal", OWN, {500: 0.72, 700: 0.29}, BEFORE_GOAL),
)

UNTRACED = "not traced; perhaps another of the tours that are equally short"
FROM_THE_ORIGIN = (  # of Figure 8: targets that start at the origin
    ("exhaustive", {**EXHAUSTIVE, "targets": ALL, U0: 30e3}, 597.0, UNTRACED),
    ("greedy at 300 s", {**GREEDY, "targets": ALL, U0: 30e3}, 1533.0, ""),
    ("exhaustive, 20 m/s", {**EXHAUSTIVE, "targets": ALL_20, U0: 60e3}, 1023.0, UNTRACED),
    ("greedy at 300 s, 20 m/s", {**GREEDY, "targets": ALL_20, U0: 60e3}, 1666.0, ""),
)
WINS = {30e3: 252, 60e3: 71}  # paths on which exhaustive search is the quicker one


def claims(found: Found) -> Iterator[Claim]:
    """Yield how the figures of an earlier program stand beside this one's."""
    if "prototype" not in found:
        return
    rows = found["prototype"].rows
    lines, apart, same, compared = [], [], 0, 0
    for told in TOLD:
        beside = {
            km: _beside(
                estimate(rows, {**told.where, U0: km * 1e3}, told.figure), value, told.figure
            )
            for km, value in told.values.items()
        }
        lines.append([told.name, *(beside[km][0] if km in beside else "" for km in U0S_KM)])
        far = [km for km, (_, is_apart) in beside.items() if is_apart]
        known = sum(cell != "-" for cell, _ in beside.values())
        same, compared = same + known - len(far), compared + known
        if far:
            at = ", ".join(f"{km} km" for km in far)
            apart.append(f"{told.name}, at {at}" + f" ({told.why})" * bool(told.why))
    table = markdown_table(["ours / theirs", *(f"{km} km" for km in U0S_KM)], lines)
    yield Claim(
        "Does a program without SUMO that shares no line with this one find the same?",
        "not in the paper",
        "a prototype's means of ten seeds on 20,000 targets drawn from the belief, take-off at 0 "
        "if nothing else is said; ours on all targets of the belief; in bold what differs by more "
        "than the 95 % interval of the difference, if the prototype's seeds scatter as ours do: "
        "one in twenty does by chance",
        "beyond the paper",
        f"{same} of {compared} figures do, but for chance. Apart are: "
        f"{'; '.join(apart) or 'none'}.",
        "\n\n".join(part for part in (table, _few_seeds(rows), _from_the_origin(found)) if part),
    )


def _beside(ours: Estimate | None, theirs: float, figure: str) -> tuple[str, bool]:
    """Return both as text, and whether they are apart by more than chance."""
    if ours is None:
        return "-", False
    drawn = (ours.high - ours.low) / 2 * math.sqrt(1 + ours.seeds / THEIR_SEEDS)
    far = abs(ours.mean - theirs) > math.hypot(drawn, Z95 * THEIR_ERROR[figure])
    text = (
        (ours.percent, f"{100 * theirs:.0f} %")
        if figure != EXPECTED
        else (ours.seconds, f"{theirs:,.0f} s")
    )
    return f"{'**' * far}{text[0]}{'**' * far} / {text[1]}", far


def _few_seeds(rows: Sequence[Row]) -> str:
    """Tell what means of ten seeds scatter by, where the prototype's and ours differ most."""
    here = chosen(rows, {"block": "300 s", U0: ODD_M})
    values = [row[EXPECTED] for row in sorted(here, key=lambda row: row["seed"])]
    tens = [values[at : at + THEIR_SEEDS] for at in range(0, len(values), THEIR_SEEDS)]
    means = [statistics.fmean(ten) for ten in tens if len(ten) == THEIR_SEEDS]
    if len(means) < 2:
        return ""
    return (
        f"With take-off at 300 s and both directions, one seed at {km(ODD_M)} deviates by "
        f"{statistics.stdev(values):,.0f} s from the next, and ten of them may mean much or "
        f"little: groups of ten have means of {', '.join(f'{mean:,.0f}' for mean in means)} s, "
        f"and the prototype's ten one of {THEIRS_AT_300[60]:,.0f} s. All {len(values)} together: "
        f"{Estimate.of(values).seconds}."
    )


def _from_the_origin(found: Found) -> str:
    """Return the prototype's figures on targets from the origin, as Figure 8 has them."""
    if "figure8" not in found:
        return ""
    results, lines = found["figure8"], []
    for name, where, theirs, why in FROM_THE_ORIGIN:
        cell, far = _beside(estimate(results.rows, where), theirs, EXPECTED)
        lines.append((f"{name}, {km(where[U0])}", cell, why if far else ""))
    for u0, theirs in WINS.items():
        greedy = {**GREEDY, "targets": ALL}
        if u0 in levels(results.rows, U0):
            wins, _, paths = exhaustive_wins(results, greedy, {"targets": ALL, U0: u0})
            name = f"paths on which exhaustive is better, {km(u0)}"
            lines.append((name, f"{wins} / {theirs} of {paths}", ""))
    return markdown_table(["targets from the origin", "ours / theirs", "why apart"], lines)
