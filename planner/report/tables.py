"""Tables for a terminal; plain text where there is none."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from planner.bounds.certificate import gap_of
from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.flight.legs import leg_ends
from planner.flight.plan import Plan
from planner.mission.trial import Trial
from planner.network.road_network import RoadNetwork
from planner.report.formats import percent, titled_table

if TYPE_CHECKING:
    from rich.table import Table


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

    @property
    def gap(self) -> float | None:
        """How far its plan is from the bound, as a share of the bound; None if that is unknown."""
        if self.planned is None or not self.bound:
            return None
        return gap_of(self.planned.figure, self.bound)


def row_of(trial: Trial) -> MethodRow:
    """Return the row of a method that could be used."""
    return MethodRow(trial.method, trial.planned, trial.evaluated, trial.roads, trial.took_s)


def plan_table(row: MethodRow) -> "Table":
    """Return what a plan achieves on its own futures and on fresh targets."""
    assert row.planned is not None
    assert row.evaluated is not None
    both = (row.planned, row.evaluated)
    table = titled_table(f"{row.method}: {row.roads} roads" if row.roads else row.method)
    table.add_column("")
    table.add_column(f"{len(row.planned.weight):,} futures planned with", justify="right")
    table.add_column(f"{len(row.evaluated.weight):,} fresh targets", justify="right")
    table.add_column("95 % interval", justify="right")
    time_s, found = row.evaluated.ci95_s, row.evaluated.found_interval
    before = row.evaluated.found_before_goal_interval
    by_s = row.evaluated.objective.by_s
    if by_s is not None:
        shares = [percent(e.found_by_probability(by_s)) for e in both]
        table.add_row(_by(by_s), *shares, _shares(row.evaluated.found_by_interval(by_s)))
    lines = (
        ("expected detection time", [_seconds(e.expected_detection_time_s) for e in both], time_s),
        ("found", [percent(e.detection_probability) for e in both], found),
        ("found before its goal", [percent(e.found_before_goal_probability) for e in both], before),
    )
    for name, cells, interval in lines:
        kind = _seconds if interval is time_s else percent
        table.add_row(name, *cells, f"{kind(interval[0])} .. {kind(interval[1])}")
    gain_s = row.planned.expected_detection_time_s - row.evaluated.expected_detection_time_s
    table.add_row("planned minus fresh", f"{gain_s:+,.0f} s", "", "")
    return table


def legs_table(plan: Plan, network: RoadNetwork) -> "Table":
    """Return the roads of a plan in the order flown, with times on the target's clock."""
    table = titled_table("roads in the order flown")
    for name, right in (("#", 1), ("road", 0), ("from", 0), ("to", 0), ("start", 1), ("end", 1)):
        table.add_column(name, justify="right" if right else "left")
    for legs in plan.legs:
        for order, leg in enumerate(legs, 1):
            ends = leg_ends(network, leg.leg)
            times = (clock(leg.start_s), clock(leg.end_s))
            table.add_row(str(order), network.road_ids[leg.road], *ends, *times)
    return table


def compare_table(rows: Iterable[MethodRow], title: str = "") -> "Table":
    """Return methods side by side, on the same futures and the same fresh targets.

    A method that cannot be used keeps its row and says why. Where bounds are known, a column says
    how far each plan may be from the best of its class, on the futures that it was planned with.
    """
    table = titled_table(title)
    table.add_column("method", no_wrap=True, overflow="ignore")
    rows = list(rows)
    deadlines = {row.evaluated.objective.by_s for row in rows if row.evaluated} - {None}
    first = [_by(by_s) for by_s in deadlines if by_s is not None]
    with_gap = any(row.bound is not None for row in rows)
    for name in (
        *first,
        "expected detection",
        "95 % interval",
        "found",
        "before goal",
        "in sample",
        *(["gap"] if with_gap else []),
        "roads",
    ):
        table.add_column(name, justify="right")
    table.add_column("planning took", justify="right")
    for row in rows:
        if row.evaluated is None:
            table.add_row(row.method, *["-"] * (len(table.columns) - 1))
        else:
            table.add_row(row.method, *_cells(row, row.evaluated, with_gap=with_gap))
    return table


def flights_table(evaluation: Evaluation) -> "Table":
    """Return what flights against true targets achieved, with 95 % intervals."""
    table = titled_table(f"{len(evaluation.weight):,} flights")
    for name in ("", "value", "95 % interval"):
        table.add_column(name, justify="right" if name else "left")
    found, before = evaluation.found_interval, evaluation.found_before_goal_interval
    if evaluation.objective.by_s is not None:
        by_deadline = evaluation.found_by_probability(evaluation.objective.by_s)
        within = evaluation.found_by_interval(evaluation.objective.by_s)
        table.add_row(_by(evaluation.objective.by_s), percent(by_deadline), _shares(within))
    seconds = tuple(_seconds(s) for s in evaluation.ci95_s)
    expected = _seconds(evaluation.expected_detection_time_s)
    table.add_row("expected detection time", expected, " .. ".join(seconds))
    for name, share, interval in (
        ("found", evaluation.detection_probability, found),
        ("found before its goal", evaluation.found_before_goal_probability, before),
    ):
        table.add_row(name, percent(share), _shares(interval))
    return table


def _cells(row: MethodRow, evaluated: Evaluation, *, with_gap: bool) -> list[str]:
    low_s, high_s = evaluated.ci95_s
    by_s = evaluated.objective.by_s
    return [
        *([] if by_s is None else [percent(evaluated.found_by_probability(by_s))]),
        _seconds(evaluated.expected_detection_time_s),
        f"{low_s:,.0f} .. {high_s:,.0f}",
        percent(evaluated.detection_probability),
        percent(evaluated.found_before_goal_probability),
        "-" if row.planned is None else _seconds(row.planned.expected_detection_time_s),
        *([_gap(row)] if with_gap else []),
        str(row.roads) if row.roads else "-",
        "-" if row.took_s is None else _short(row.took_s),
    ]


def _seconds(seconds: float) -> str:
    return f"{seconds:,.0f} s"


def _short(seconds: float) -> str:
    return f"{seconds * 1000:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"


def _gap(row: MethodRow) -> str:
    return "-" if row.gap is None else percent(row.gap)


def _by(time_s: float) -> str:
    return f"found by {clock(time_s)}"


def _shares(interval: tuple[float, float]) -> str:
    return f"{percent(interval[0])} .. {percent(interval[1])}"
