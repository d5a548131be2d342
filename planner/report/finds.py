"""How finds are told: of one target as a share, of several as a number, and one by one."""

from collections.abc import Callable, Sequence

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.detection.several import find_of, first_and_last
from planner.messages import percent
from planner.report.formats import Column, FittingTable


def targets_table(
    evaluation: Evaluation, names: Sequence[str], title: str = "each target, and all together"
) -> FittingTable:
    """Return when and how probably several targets are found: each, the first, and the last.

    Parameters
    ----------
    names
        What each is called, by its number.
    """
    by_s = evaluation.objective.by_s
    columns = (Column("expected\ntime"), Column("95 %\ninterval", rank=1))
    found = (
        Column("found" if by_s is None else f"found by {clock(by_s)}"),
        Column("95 %\ninterval", rank=2),
    )
    table = FittingTable(title, (Column("", left=True, wraps=True), *columns, *found))
    first, last = first_and_last(evaluation)
    each = [(names[number], find_of(one)) for number, one in evaluation.each.items()]
    for name, find in (*each, ("the first find", first), ("all found", last)):
        times_s = span_of(seconds_text, find.ci95_s)
        cells = (seconds_text(find.expected_s), times_s, percent(find.probability))
        table.add_row(name, *cells, span_of(percent, find.interval))
    return table


def first_and_last_cells(evaluated: Evaluation) -> list[str]:
    """Return when the first and the last of several targets are found; of one nothing."""
    if evaluated.objective.sought == 1:
        return []
    return [seconds_text(find.expected_s) for find in first_and_last(evaluated)]


def headline(evaluated: Evaluation) -> str:
    """Return in a few words what a plan finds, by when, and after which time on average."""
    objective = evaluated.objective
    end_s = objective.horizon_s if objective.by_s is None else objective.by_s
    found = objective.number_found(evaluated.found_by_probability(end_s))
    of_all = "" if objective.sought == 1 else f" of {objective.sought} targets"
    mean_s = evaluated.expected_detection_time_s / objective.sought
    return (
        f"finds {found}{of_all} by {clock(end_s)}, on average after {clock(mean_s)} "
        f"(never counts as {clock(objective.horizon_s)})"
    )


def timed(sought: int) -> str:
    """Return what the expected time is called."""
    return "expected detection time" if sought == 1 else f"sum of {sought} detection times"


def counted_of(what: str, sought: int) -> str:
    """Return what a number of targets is called."""
    return what if sought == 1 else f"{what}, of {sought}"


def seconds_text(seconds: float) -> str:
    """Return whole seconds."""
    return f"{seconds:,.0f} s"


def span_of(written: Callable[[float], str], interval: tuple[float, float]) -> str:
    """Return an interval, each of its ends as written by a function."""
    return f"{written(interval[0])} .. {written(interval[1])}"
