"""Tables of experiments for a terminal."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from planner.detection.evaluation import Evaluation
from planner.experiments.condition import Condition
from planner.experiments.instances import Instance
from planner.experiments.portable import Exported
from planner.experiments.results import Row
from planner.intervals import student_interval
from planner.messages import counted, percent
from planner.report.formats import Column, FittingTable, titled_table
from planner.search.methods import is_pattern

if TYPE_CHECKING:
    from rich.table import Table

INSTANCES_HEAD = """\
# The frozen instances, and what each method reaches

`planner compare --instances -o DIR` made this page. *Best known* is E[min(tau, horizon)] of the
best plan known, over roads but in towns, on 4,000 fresh targets (in towns 2,100) that no planner
sees, with its 95 % interval. *Bound* is how far that plan is above a lower bound on all plans over
roads, as a share of the bound, both on the particles planned with; in brackets, where such a bound
takes too large a table or the drone has to come home, above one on any flight whatever. Each method
has the scenario's own budget; its column tells how far its plan is above the best known, on the
same fresh targets. `orienteering` plans with OR-Tools; `cells` and `anneal-waypoints` may leave the
roads and so be better than the best known; *best pattern* is the best, on these targets, of what
pilots fly without a planner; - where a method cannot work on the instance. The best known was
chosen on other targets than these, so that another plan may be a little better.

"""
MOST_LINES = 60  # further ones are left out of a terminal
BEST_PATTERN = "best pattern"  # a column for all of them
COLUMNS, OTHERS = 3, "other levels"  # more factors than that share a column of this name


FIGURES = (
    Column("expected\ndetection"),
    Column("95 %\ninterval", rank=1),
    Column("found"),
    Column("before\ngoal", rank=3),
    Column("seeds", rank=2),
)


def results_table(
    rows: Sequence[Row],
    factors: Sequence[str],
    title: str,
    horizon_s: Mapping[str, float] = MappingProxyType({}),
) -> FittingTable:
    """Return the figures of each combination of method and factors, averaged over its seeds.

    Intervals are Student's, over seeds, each with particles and targets of its own, and lie
    between 0 s and the horizon; where there is one seed, that of its targets.

    Parameters
    ----------
    horizon_s
        By the condition's id: no expected detection time is later.
    """
    header, levels, usual = _levels(rows, factors)
    named = [_column(name) for name in (*header, "method")]
    groups: dict[tuple[str, ...], list[Row]] = {}
    for row, cells in zip(rows, levels, strict=True):
        groups.setdefault((*cells, row["method"]), []).append(row)
    caption = " ".join(filter(None, (usual, _left_out(len(groups)))))
    table = FittingTable(title, [*named, *FIGURES], caption=caption)
    for key, group in list(groups.items())[:MOST_LINES]:
        known = [row for row in group if row["reason"] is None]
        most_s = max((horizon_s.get(row.get("id", ""), math.inf) for row in known), default=0.0)
        table.add_row(*key, *_figures(known, most_s))
    return table


def study_table(rows: Sequence[Row], title: str) -> "Table":
    """Return the rows of a study as they are."""
    table = titled_table(title)
    names = [name for name in rows[0] if name not in ("id", "method", "seed", "reason")]
    for name in names:
        right = not isinstance(rows[0][name], str)
        table.add_column(name, justify="right" if right else "left")
    for row in rows[:MOST_LINES]:
        table.add_row(*(_cell(row.get(name)) for name in names))
    table.caption = _left_out(len(rows))
    return table


def _left_out(lines: int) -> str | None:
    more = lines - MOST_LINES
    return f"{more:,} more lines are left out here; results.csv has all" if more > 0 else None


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:,.4g}" if isinstance(value, float) and value < 1 else _number(value)


def _number(value: Any) -> str:
    return f"{value:,.0f}" if isinstance(value, float | int) else str(value)


def instances_table(
    instances: Sequence[Instance],
    known: Mapping[str, Evaluation],
    values: Mapping[tuple[str, str], float | None],
) -> "Table":
    """Return the best value known of each instance, and by how much each method is above it."""
    values = _with_best_pattern(values)
    methods = list(dict.fromkeys(method for _, method in values))
    table = titled_table(
        "instances: expected detection time of the best plan known, methods above it"
    )
    table.add_column("instance", no_wrap=True)
    table.add_column("best known", justify="right", no_wrap=True)
    for name in ("bound", *methods):
        table.add_column(name, justify="right")
    for one in instances:
        best_s = known[one.name].expected_detection_time_s
        half_s = known[one.name].ci95_s[1] - best_s
        cells = [_above(values[one.name, method], best_s) for method in methods]
        table.add_row(one.name, f"{best_s:,.0f} ± {half_s:.0f} s", _above_bound(one), *cells)
    return table


def _with_best_pattern(
    values: Mapping[tuple[str, str], float | None],
) -> dict[tuple[str, str], float | None]:
    """Return values by instance and method, with the best of all patterns in place of each."""
    found: dict[tuple[str, str], float | None] = {}
    for (instance, method), value in values.items():
        key = (instance, BEST_PATTERN if is_pattern(method) else method)
        known = [one for one in (found.get(key), value) if one is not None]
        found[key] = min(known, default=None)
    return found


def _above_bound(instance: Instance) -> str:
    """Return how far the best plan known is above a bound, in brackets if not for roads alone."""
    if instance.bound is None:
        return "-"
    above = percent(instance.bound.gap, sign=True)
    return above if instance.bound.plan_class == "roads" else f"({above})"


def instances_page(
    instances: Sequence[Instance],
    known: Mapping[str, Evaluation],
    values: Mapping[tuple[str, str], float | None],
) -> str:
    """Return the same table as a page of Markdown."""
    table = instances_table(instances, known, values)
    cells = [[str(cell) for cell in column.cells] for column in table.columns]
    header = [str(column.header) for column in table.columns]
    lines = ["| " + " | ".join(row) + " |" for row in (header, *zip(*cells, strict=True))]
    lines.insert(1, "|---|" + "--:|" * (len(header) - 1))
    return INSTANCES_HEAD + "\n".join(lines) + "\n"


def _above(value_s: float | None, best_s: float) -> str:
    return "-" if value_s is None else percent(value_s / best_s - 1, sign=True)


def failures(rows: Sequence[Row]) -> list[str]:
    """Return a line for each reason for which conditions failed."""
    count: dict[str, int] = {}
    for row in rows:
        if row["reason"] is not None:
            count[row["reason"]] = count.get(row["reason"], 0) + 1
    return [f"{many} failed: {reason}" for reason, many in count.items()]


def exported_table(exported: Sequence[Exported]) -> "Table":
    """Return what was written for each instance."""
    megabytes = sum(one.megabytes for one in exported)
    table = titled_table(f"{counted(len(exported), 'instance')}, {megabytes:.1f} MB")
    for name in ("instance", "futures", "best known", "MB"):
        table.add_column(name, justify="left" if name == "instance" else "right")
    for one in exported:
        cells = (f"{one.futures:,}", f"{one.best_s:,.1f} s", f"{one.megabytes:.1f}")
        table.add_row(one.name, *cells)
    return table


def conditions_table(conditions: Sequence[Condition], finished: Sequence[bool]) -> FittingTable:
    """Return the conditions of an experiment, and which of them are finished."""
    rows = [one.levels for one in conditions]
    header, levels, usual = _levels(rows, list(conditions[0].levels))
    table = FittingTable(
        f"{len(conditions):,} conditions, {sum(finished):,} of them finished",
        [
            Column("id", rank=3, left=True),
            *map(_column, (*header, "method")),
            Column("seed", rank=1),
            Column("finished", rank=2),
        ],
        caption=usual or "",
    )
    for condition, cells, done in zip(conditions, levels, finished, strict=True):
        mark = "yes" if done else "-"
        table.add_row(condition.id, *cells, condition.method, str(condition.seed), mark)
    return table


def _column(name: str) -> Column:
    """Return a column of the levels of a factor; the last part of its key has a line of its own."""
    return Column(".\n".join(name.rsplit(".", 1)), left=name in ("method", OTHERS), wraps=True)


def _levels(
    rows: Sequence[Mapping[str, Any]], factors: Sequence[str]
) -> tuple[list[str], list[list[str]], str | None]:
    """Return column names for factors, the cells of each row, and what these leave out.

    Where factors are many, those that mostly have one level share a column, which names the others.
    """
    usual: dict[str, str] = {}
    for key in factors if rows and len(factors) > COLUMNS else ():
        (level, count), *_ = Counter(_text(row[key]) for row in rows).most_common(1)
        if 2 * count > len(rows):
            usual[key] = level
    alone = [key for key in factors if key not in usual]
    cells = [[_text(row[key]) for key in alone] for row in rows]
    if not usual:
        return alone, cells, None
    for row, line in zip(rows, cells, strict=True):
        others = (f"{key}={_text(row[key])}" for key in usual if _text(row[key]) != usual[key])
        line.append("\n".join(others))
    left_out = ", ".join(f"{key}={level}" for key, level in usual.items())
    return [*alone, OTHERS], cells, f"{OTHERS} than {left_out}"


def _figures(group: Sequence[Row], most_s: float) -> list[str]:
    if not group:
        return ["-"] * 4 + ["0"]
    expected_s = [row["expected_detection_time_s"] for row in group]
    low_s, high_s = group[0]["ci95_low_s"], group[0]["ci95_high_s"]
    if len(group) > 1:
        low_s, high_s = student_interval(expected_s)
        low_s, high_s = max(0.0, low_s), min(most_s, high_s)
    shares = ("detection_probability", "found_before_goal_probability")
    return [
        f"{_mean(expected_s):,.0f} s",
        "-" if low_s is None else f"{low_s:,.0f} .. {high_s:,.0f}",
        *(percent(_mean([row[name] for row in group])) for name in shares),
        str(len(group)),
    ]


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _text(level: Any) -> str:
    return f"{level:g}" if isinstance(level, float) else str(level)
