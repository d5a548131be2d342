"""What plans and flights achieve, as tables for a terminal; plain text where there is none."""

from collections.abc import Iterable
from dataclasses import dataclass

from planner.bounds.certificate import gap_of
from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.messages import counted, percent
from planner.mission.trial import Trial
from planner.report.finds import (
    counted_of,
    first_and_last_cells,
    headline,
    seconds_text,
    span_of,
    timed,
)
from planner.report.formats import Column, FittingTable
from planner.search.methods import is_pattern

BEFORE_GOAL = "found before its goal"
ENOUGH_TARGETS = 100  # for the approximations behind intervals of 95 %


@dataclass(frozen=True)
class Fresh:
    """What the targets are that a plan is evaluated on."""

    name: str
    alike: bool = True  # drawn from what the plan was made from; else figures do not compare


FRESH = Fresh("fresh targets")
KEPT_OUT = Fresh("kept out")
OTHERS = Fresh("of the belief", alike=False)


@dataclass(frozen=True)
class MethodRow:
    """What one method achieves; or, with ``why_not``, why it cannot be used."""

    method: str
    planned: Evaluation | None = None  # on the futures that it planned with
    evaluated: Evaluation | None = None  # on fresh targets
    roads: int = 0
    took_s: float | None = None  # wall-clock time of planning
    why_not: str = ""
    bound: float | None = None  # that no plan of its class can pass on the futures planned with
    fresh: Fresh = FRESH  # what the targets are that it is evaluated on

    @property
    def gap(self) -> float | None:
        """How far its plan is from the bound, as a share of the bound; None if that is unknown."""
        if self.planned is None or not self.bound:
            return None
        return gap_of(self.planned.figure, self.bound)


def row_of(trial: Trial) -> MethodRow:
    """Return the row of a method that could be used."""
    return MethodRow(trial.method, trial.planned, trial.evaluated, trial.roads, trial.took_s)


def plan_table(row: MethodRow, *, in_town: bool = False) -> FittingTable:
    """Return what a plan achieves on its own futures and on targets that it was not made from.

    Parameters
    ----------
    in_town
        There the end of a drive ends nothing: who has parked is still looked for, and who has left
        cannot be found. So nothing is said of what is found before it.
    """
    assert row.planned is not None
    assert row.evaluated is not None
    both = (row.planned, row.evaluated)
    table = FittingTable(
        f"{row.method}: {headline(row.evaluated)}{f', {row.roads} roads' if row.roads else ''}",
        (
            Column("", left=True, wraps=True),
            Column(f"{len(row.planned.weight):,} futures\nplanned with", rank=2),
            Column(f"{len(row.evaluated.weight):,}\n{row.fresh.name}"),
            Column("95 %\ninterval", rank=1),
        ),
        caption=_few(len(row.evaluated.weight)),
    )
    time_s, found = row.evaluated.ci95_s, row.evaluated.found_interval
    objective = row.evaluated.objective
    sought, by_s, many = objective.sought, objective.by_s, objective.number_found
    if by_s is not None:
        shares = [many(e.found_by_probability(by_s)) for e in both]
        table.add_row(_by(by_s), *shares, span_of(many, row.evaluated.found_by_interval(by_s)))
    lines = [
        (timed(sought), [seconds_text(e.expected_detection_time_s) for e in both], time_s),
        (counted_of("found", sought), [many(e.detection_probability) for e in both], found),
    ]
    if not in_town:
        before = [many(e.found_before_goal_probability) for e in both]
        interval = row.evaluated.found_before_goal_interval
        lines.append((counted_of(BEFORE_GOAL, sought), before, interval))
    for name, cells, interval in lines:
        table.add_row(name, *cells, span_of(seconds_text if interval is time_s else many, interval))
    if row.fresh.alike and by_s is None:
        gain_s = row.planned.expected_detection_time_s - row.evaluated.expected_detection_time_s
        sooner = "sooner" if round(gain_s) >= 0 else "later"
        table.add_row("difference", "", f"{seconds_text(abs(gain_s))} {sooner}", "")
    return table


def _few(targets: int) -> str:
    """Return what has to be said of intervals from so many targets; "" where they are enough."""
    if targets >= ENOUGH_TARGETS:
        return ""
    return (
        f"intervals from {counted(targets, 'target')} are rough: trust them from "
        f"{ENOUGH_TARGETS} on"
    )


def compare_table(
    rows: Iterable[MethodRow], title: str = "", *, in_town: bool = False
) -> FittingTable:
    """Return methods side by side, on the same futures and the same fresh targets.

    A pilot's patterns stand apart from the planners. A method that cannot be used keeps its row and
    says why. Where bounds are known, a column says
    how far each plan may be from the best of its class, on the futures that it was planned with.

    Parameters
    ----------
    in_town
        As ``plan_table`` takes it.
    """
    rows = list(rows)
    deadlines = {row.evaluated.objective.by_s for row in rows if row.evaluated} - {None}
    targets = [len(row.evaluated.weight) for row in rows if row.evaluated]
    with_gap = any(row.bound is not None for row in rows)
    sought = max((row.evaluated.objective.sought for row in rows if row.evaluated), default=1)
    finds = [Column("first\nfind", rank=2), Column("all\nfound", rank=2)] * (sought > 1)
    table = FittingTable(
        title,
        (
            Column("method", left=True),
            *(
                column
                for by_s in deadlines
                if by_s is not None
                for column in (Column(_by(by_s)), Column("95 %\ninterval", rank=1))
            ),
            Column(
                "expected\ndetection" if sought == 1 else f"sum of\n{sought} times",
                rank=2 if deadlines else 0,
            ),
            Column("95 %\ninterval", rank=3),
            *finds,
            Column("found" if sought == 1 else f"found,\nof {sought}", rank=4),
            *([] if in_town else [Column("before\ngoal", rank=8)]),
            Column("in\nsample", rank=5),
            *([Column("gap", rank=1)] if with_gap else []),
            Column("roads", rank=7),
            Column("planning\ntook", rank=6),
        ),
        caption=_few(min(targets, default=ENOUGH_TARGETS)),
    )
    for before, row in zip([rows[0], *rows] if rows else [], rows, strict=False):
        if is_pattern(row.method) != is_pattern(before.method):
            table.end_section()
        if row.evaluated is None:
            table.add_row(row.method, *["-"] * (len(table.columns) - 1))
        else:
            cells = _cells(row, row.evaluated, with_gap=with_gap, in_town=in_town)
            table.add_row(row.method, *cells)
    return table


def flights_table(evaluation: Evaluation, *, in_town: bool = False) -> FittingTable:
    """Return what flights against true targets achieved, with 95 % intervals.

    Parameters
    ----------
    in_town
        As ``plan_table`` takes it.
    """
    columns = (Column("", left=True, wraps=True), Column("value"), Column("95 % interval"))
    sought, many = evaluation.objective.sought, evaluation.objective.number_found
    flights = len(evaluation.weight) // sought
    table = FittingTable(f"{flights:,} flights", columns, caption=_few(flights))
    if evaluation.objective.by_s is not None:
        by_deadline = evaluation.found_by_probability(evaluation.objective.by_s)
        within = evaluation.found_by_interval(evaluation.objective.by_s)
        table.add_row(_by(evaluation.objective.by_s), many(by_deadline), span_of(many, within))
    expected = seconds_text(evaluation.expected_detection_time_s)
    table.add_row(timed(sought), expected, span_of(seconds_text, evaluation.ci95_s))
    found = many(evaluation.detection_probability)
    table.add_row(counted_of("found", sought), found, span_of(many, evaluation.found_interval))
    if not in_town:
        before = many(evaluation.found_before_goal_probability)
        within = evaluation.found_before_goal_interval
        table.add_row(counted_of(BEFORE_GOAL, sought), before, span_of(many, within))
    return table


def _cells(row: MethodRow, evaluated: Evaluation, *, with_gap: bool, in_town: bool) -> list[str]:
    low_s, high_s = evaluated.ci95_s
    many = evaluated.objective.number_found
    return [
        *_by_cells(evaluated),
        seconds_text(evaluated.expected_detection_time_s),
        f"{low_s:,.0f} .. {high_s:,.0f}",
        *first_and_last_cells(evaluated),
        many(evaluated.detection_probability),
        *([] if in_town else [many(evaluated.found_before_goal_probability)]),
        "-" if row.planned is None else seconds_text(row.planned.expected_detection_time_s),
        *([_gap(row)] if with_gap else []),
        str(row.roads) if row.roads else "-",
        "-" if row.took_s is None else _short(row.took_s),
    ]


def _by_cells(evaluated: Evaluation) -> list[str]:
    by_s = evaluated.objective.by_s
    if by_s is None:
        return []
    many = evaluated.objective.number_found
    return [
        many(evaluated.found_by_probability(by_s)),
        span_of(many, evaluated.found_by_interval(by_s)),
    ]


def _short(seconds: float) -> str:
    return f"{seconds * 1000:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"


def _gap(row: MethodRow) -> str:
    return "-" if row.gap is None else percent(row.gap)


def _by(time_s: float) -> str:
    return f"found by {clock(time_s)}"
