"""Interpretations of the pseudo-code, the number of particles, and what knowledge is worth."""

from collections.abc import Iterator, Sequence
from typing import Any

from planner.experiments.results import Row
from planner.messages import percent
from planner.paper.claims import Claim, ResultsByName, markdown_table
from planner.paper.figures import ALL, U0
from planner.report.estimates import (
    BEFORE_GOAL,
    EXPECTED,
    FOUND,
    chosen,
    difference,
    estimate,
    levels,
)
from planner.report.formats import km

REFERENCE = "as in the preset"
BASE, KNOWN = "all that is known", "as believed"
TURNS, EQUAL = "four in five turn east", "turns taken for equal"
NUMBERS = ("radius", "roads", "planning", "tick")  # blocks that change a mere number
SMALL = 0.02  # share of the value that is called little


def claims(found: ResultsByName) -> Iterator[Claim]:
    """Yield what the studies of interpretations, particles and beliefs say."""
    if "readings" in found:
        yield _readings(found["readings"].rows)
        yield _sixteen(found["readings"].rows)
    if "particles" in found:
        yield _thousand(with_bias(found["particles"].rows))
    if "beliefs" in found:
        yield _worth(found["beliefs"].rows)
        yield _wrong(found["beliefs"].rows)
        yield _sensor(found["beliefs"].rows)


def _variants(rows: Sequence[Row]) -> list[tuple[str, dict[str, Any]]]:
    """Return the name of each variant, and what its rows have."""
    ignored = {"id", "seed", "targets", "method", "block", U0, "reason", "work", "roads"}
    reference = chosen(rows, {"block": REFERENCE})[0]
    factors = [key for key in reference if "." in key and key not in ignored]
    found: dict[str, dict[str, Any]] = {}
    for row in rows:
        if row["block"] == REFERENCE:
            continue
        other = {key: row[key] for key in factors if row[key] != reference[key]}
        name = ", ".join(f"{key} = {value}" for key, value in other.items())
        found[name] = {"block": row["block"], **{key: row[key] for key in factors}}
    return list(found.items())


def _readings(rows: Sequence[Row]) -> Claim:
    distances = sorted(levels(rows, U0))
    base = {"block": REFERENCE, "targets": ALL}
    values = [estimate(rows, {**base, U0: u0}) for u0 in distances]
    lines = [["the preset", *(one.seconds if one else "-" for one in values)]]
    largest: tuple[float, str] = (0.0, "none is more than chance")
    for name, where in _variants(rows):
        cells = [f"`{name}`"]
        for u0, value in zip(distances, values, strict=True):
            here = {"targets": ALL, U0: u0}
            apart = difference(chosen(rows, {**where, **here}), chosen(rows, {**base, **here}))
            cells.append(apart.change if apart else "-")
            if apart and value and not where["block"].startswith(NUMBERS):
                change = f"`{name}` at {km(u0)}, {apart.change} beside {value.seconds}"
                if apart.low > 0 or apart.high < 0:
                    largest = max(largest, (abs(apart.mean) / value.mean, change))
        lines.append(cells)
    return Claim(
        "Which reading of the pseudo-code matters?",
        "Figures 4 to 6",
        "greedy with one option changed at a time, all else as in the preset; all paths from "
        "the origin; change of the mean detection time, paired by seed",
        "beyond the paper",
        f"The largest change that an interpretation makes and that chance does not explain is "
        f"{percent(largest[0], 0)}: {largest[1]}. Changes of a mere number, such as the "
        "radius, stand in the last rows.",
        markdown_table(["", *map(km, distances)], lines),
    )


def _sixteen(rows: Sequence[Row]) -> Claim:
    lines, gains = [], []
    depths = [n for n in levels(rows, "search.depth") if n > 16]
    for u0 in sorted(levels(rows, U0)):
        base = {"targets": ALL, U0: u0, "block": REFERENCE}
        value, found = estimate(rows, base), estimate(rows, base, FOUND)
        cells = [km(u0), value.seconds if value else "-", found.percent if found else "-"]
        for depth in sorted(depths):
            more = chosen(rows, {"targets": ALL, U0: u0, "search.depth": depth})
            apart = difference(more, chosen(rows, base))
            cells.append(apart.change if apart else "-")
            if apart and value:
                gains.append(-apart.mean / value.mean)
        lines.append(cells)
    most = max(gains, default=0.0)
    return Claim(
        "A path of 16 road segments is long enough",
        "Section 5",
        "greedy with more roads, all else as in the preset",
        "reproduced" if most < SMALL else "not reproduced",
        f"More roads shorten the mean detection time by at most {percent(most)}.",
        markdown_table(
            ["u0", "16 roads", "found", *(f"{depth} roads" for depth in sorted(depths))], lines
        ),
    )


def with_bias(rows: Sequence[Row]) -> list[Row]:
    """Return rows with what a plan's own figure promises too much, seconds."""
    return [
        {**row, "bias": row[EXPECTED] - row["planned_s"]}
        for row in rows
        if row.get("reason") is None
    ]


def _thousand(rows: Sequence[Row]) -> Claim:
    lines = []
    at_1000 = ""
    for method in levels(rows, "method"):
        for sampling in levels(rows, "search.sampling"):
            for count in sorted(levels(chosen(rows, {"method": method}), "search.particles")):
                where = {
                    "method": method,
                    "search.sampling": sampling,
                    "search.particles": count,
                }
                value, bias = estimate(rows, where), estimate(rows, where, "bias")
                if value is None or bias is None:
                    continue
                drawn = [row[EXPECTED] for row in chosen(rows, where)]
                spread = max(drawn) - min(drawn)
                lines.append(
                    (
                        f"{method}, {sampling}",
                        f"{count:,}",
                        value.seconds,
                        bias.change,
                        f"{spread:,.0f} s",
                        str(value.seeds),
                    )
                )
                if (method, sampling, count) == ("greedy", "iid", 1000):
                    at_1000 = (
                        f"At 1,000 independent particles greedy's own figure is {bias.change} "
                    )
    return Claim(
        "The number of samples: as many as we can computationally afford, 1,000",
        "Section 4.2",
        "u0 = 120 km, targets as believed; bias: value on all targets minus the plan's own figure "
        "on its particles; range: largest minus smallest value over seeds",
        "beyond the paper",
        f"{at_1000}off; the table shows what more particles, and Sobol points, do."
        if at_1000
        else "The table shows what more particles, and Sobol points, do.",
        markdown_table(["method", "particles", "value", "bias", "range", "seeds"], lines),
    )


def _worth(rows: Sequence[Row]) -> Claim:
    lines: list[tuple[str, ...]] = []
    losses: list[tuple[float, float]] = []
    for block in levels(rows, "block"):
        if block in (BASE, "no planning", TURNS):
            continue
        lines += list(_losses(rows, block, KNOWN, losses))
    # Here it is the base that lacks a piece of knowledge: that the targets prefer the east.
    lines += list(_losses(rows, BASE, TURNS, losses, against=TURNS))
    worse = sum(low > 0 for low, _ in losses)
    better = sum(high < 0 for _, high in losses)
    return Claim(
        "A system that uses all pieces of information performs better compared with systems not "
        "considering this information",
        "Section 1",
        "plans made with less knowledge than there is, minus plans made with all of it, on the "
        "same targets; in the last rows the targets do prefer the east, and the plan that takes "
        "their turns for equal is compared with the one that knows",
        "reproduced" if worse and not better else "in part" if worse else "not reproduced",
        f"Knowing less costs time, by more than chance, in {worse} of {len(losses)} cases, and "
        f"saves some in {better}.",
        markdown_table(["planned with", "method", "u0", "on targets", "change"], lines),
    )


def _losses(
    rows: Sequence[Row],
    block: str,
    targets: str,
    losses: list[tuple[float, float]],
    *,
    against: str = BASE,
) -> Iterator[tuple[str, ...]]:
    planned_with = EQUAL if block == BASE else block
    for method in ("greedy", "best"):
        for u0 in sorted(levels(rows, U0)):
            where = {"method": method, U0: u0, "targets": targets}
            apart = difference(
                chosen(rows, {**where, "block": block}), chosen(rows, {**where, "block": against})
            )
            if apart is not None:
                losses.append((apart.low, apart.high))
                yield planned_with, method, km(u0), targets, apart.change


def _wrong(rows: Sequence[Row]) -> Claim:
    lines, most = [], (0.0, "")
    for targets in levels(rows, "targets"):
        if targets == KNOWN or "look" in targets:
            continue
        for method in ("greedy", "best"):
            for u0 in sorted(levels(rows, U0)):
                where = {"block": BASE, "method": method, U0: u0, "targets": targets}
                value, found, before = (
                    estimate(rows, where, figure) for figure in (EXPECTED, FOUND, BEFORE_GOAL)
                )
                apart = difference(chosen(rows, where), chosen(rows, {**where, "targets": KNOWN}))
                if value and found and before and apart:
                    cells = (value.seconds, apart.change, found.percent, before.percent)
                    lines.append((targets, method, km(u0), *cells))
                    case = f"{method} at {km(u0)} most, {apart.change}: {targets}"
                    most = max(most, (apart.mean, case))
    return Claim(
        "What does a wrong belief cost?",
        "not in the paper",
        "plans made for the belief, flown against targets that differ from it; minus the same "
        "plans on targets as believed; a target never found counts as 10,000 s",
        "beyond the paper",
        f"It costs {most[1]}." if most[1] else "It costs nothing.",
        markdown_table(
            ["the targets", "method", "u0", "value", "change", "found", "before goal"], lines
        ),
    )


def _sensor(rows: Sequence[Row]) -> Claim:
    methods = (
        ("no planning", "exhaustive-shortest"),
        ("no planning", "wait"),
        (BASE, "greedy"),
        (BASE, "best"),
    )
    lines, same = [], True
    for u0 in sorted(levels(rows, U0)):
        rankings = []
        for targets in (KNOWN, "one pass in ten misses", "every other pass misses"):
            values = {
                method: one
                for block, method in methods
                for one in [
                    estimate(rows, {"block": block, "method": method, U0: u0, "targets": targets})
                ]
                if one
            }
            rankings.append(sorted(values, key=lambda name: values[name].mean))
            lines.append(
                (km(u0), targets, *(values[name].seconds for _, name in methods if name in values))
            )
        same = same and rankings[0] == rankings[1]
    return Claim(
        "Having a more realistic sensor model, most conclusions remain nearly the same; the "
        "results would be poorer",
        "Section 2",
        "a target within the radius is detected at a constant rate, so that one pass straight "
        "over one at rest misses it with the probability given; plans are made for the perfect "
        "sensor; the expectation over all hits and misses is exact",
        "reproduced" if same else "in part",
        "With one pass in ten missing, the order of the methods "
        f"{'is the same at every distance' if same else 'changes at some distance'}.",
        markdown_table(["u0", "sensor", *(name for _, name in methods)], lines),
    )
