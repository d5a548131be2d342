"""The files of a run, each written whole."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.clock import clock
from planner.export.gui_settings import write_for_gui
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.futures.store import Recording
from planner.messages import percent
from planner.mission.fly import MissionRecord
from planner.mission.plan_file import figures, write_plan
from planner.mission.run_folder import EVALUATION, PICTURE, PLAN
from planner.parquet import write_table
from planner.report.csv_file import write_csv
from planner.report.finds import targets_table
from planner.report.picture import plan_picture
from planner.report.tables import MethodRow
from planner.search.problem import Problem


def write_run(
    folder: Path,
    problem: Problem,
    plan: Plan,
    content: Mapping[str, Any],
    row: MethodRow,
    *,
    title: str,
) -> None:
    """Write ``plan.json``, ``evaluation.parquet``, ``plan.png`` and what sumo-gui opens."""
    assert row.planned is not None
    assert row.evaluated is not None
    write_plan(folder / PLAN, content)
    _write_evaluation(folder / EVALUATION, row, problem.network.credit)
    write_for_gui(folder, plan, problem.network, problem.airspace)
    curves = {
        f"{len(row.planned.weight):,} futures planned with": row.planned,
        f"{len(row.evaluated.weight):,} {row.fresh.name}": row.evaluated,
    }
    plan_picture(folder / PICTURE, problem, plan, evaluations=curves, title=title)


def _write_evaluation(path: Path, row: MethodRow, credit: Mapping[str, str]) -> None:
    evaluated = row.evaluated
    assert evaluated is not None
    columns = {
        "target": np.arange(len(evaluated.weight), dtype=np.int32),
        "weight": evaluated.weight,
        "seen_at_s": evaluated.seen_at,  # infinity: never
        "reached_goal_s": evaluated.end_s,
    }
    horizon = repr(evaluated.objective.horizon_s)
    write_table(path, columns, {"method": row.method, "horizon_s": horizon, **credit})


def write_flights(
    path: Path, recording: Recording, record: MissionRecord, names: Sequence[str] = ()
) -> None:
    """Write one row per true target: found or not, when, where and on which leg.

    Parameters
    ----------
    names
        What each target is called, if there are several.
    """
    evaluation = record.evaluation
    by_the_end, before_goal = (
        evaluation.found_by(evaluation.objective.horizon_s),
        evaluation.before_goal,
    )
    rows = []
    for k, found in enumerate(evaluation.found.tolist()):
        x_m, y_m = record.xy_m[k]
        rows.append(
            {
                **_whose(recording.futures, k, names),
                "speed": recording.speed_mps[k],
                "route": recording.route[k],
                "found": _share(by_the_end[k]),
                "before_goal": _share(before_goal[k]),
                "detection_time_s": float(evaluation.time_s[k]),
                "x_m": float(x_m) if found else None,
                "y_m": float(y_m) if found else None,
                "leg": str(record.leg[k] or ""),
                **_finder(record, k),
            }
        )
    write_csv(path, rows)


def _share(probability: float) -> float:
    """Return 0 or 1 as a whole number, and a probability in between with some digits."""
    return int(probability) if probability in (0.0, 1.0) else round(float(probability), 6)


def _whose(truth: Futures, k: int, names: Sequence[str]) -> dict[str, Any]:
    """Return which target a row is of; of several sought at once, in which flight too."""
    if len(names) < 2:
        return {"target": k}
    mine = int(truth.target[k])
    earlier = int((truth.target[:k] == mine).sum())
    return {"flight": earlier, "target": names[mine]}


def _finder(record: MissionRecord, k: int) -> dict[str, str]:
    """Return whose flight finds a target, where there are several."""
    if len(record.names) == 1:
        return {}
    return {"uav": record.names[record.finder[k]] if record.evaluation.found[k] else ""}


def flight_figures(record: MissionRecord) -> dict[str, Any]:
    """Return what flights achieved, with 95 % intervals, as plain data."""
    found = record.evaluation.found_interval
    before = record.evaluation.found_before_goal_interval
    by_s = record.evaluation.objective.by_s
    deadline = (
        {}
        if by_s is None
        else {"found_by_probability_ci95": list(record.evaluation.found_by_interval(by_s))}
    )
    return (
        figures(record.evaluation)
        | deadline
        | {
            "detection_probability_ci95": list(found),
            "found_before_goal_probability_ci95": list(before),
            "targets": len(record.evaluation.weight),
        }
    )


def mission_line(record: MissionRecord, k: int = 0, *, in_town: bool = False) -> str:
    """Return what happened in the mission against a target, in words.

    Parameters
    ----------
    k
        Its row.
    in_town
        As `planner.report.tables.plan_table` takes it.
    """
    evaluation = record.evaluation
    share = float(evaluation.found_by(evaluation.objective.horizon_s)[k])
    if evaluation.survival is not None and not evaluation.found[k]:
        return f"found with probability {percent(share, 0)}: more likely missed than not"
    if not evaluation.found[k]:
        return f"not found; the search stopped at {clock(evaluation.objective.horizon_s)}"
    before = evaluation.seen_at[k] < evaluation.end_s[k]
    x_m, y_m = record.xy_m[k]
    where = f"at ({x_m:,.0f}, {y_m:,.0f}) m"
    leg = f" on leg {record.leg[k]}" if record.leg[k] else ""
    leg += f" by {who}" if (who := _finder(record, k).get("uav")) else ""
    found = f"found after {evaluation.seen_at[k]:,.0f} s {where}{leg}"
    if evaluation.survival is not None:
        likely = f"more likely than not after {evaluation.seen_at[k]:,.0f} s {where}{leg}"
        return f"found with probability {percent(share, 0)}, {likely}"
    return found if in_town else f"{found}, {'before' if before else 'after'} it reached its goal"


def several_blocks(
    record: MissionRecord, truth: Futures, names: Sequence[str], *, in_town: bool = False
) -> Iterator[Any]:
    """Yield what is told of several targets: of one mission who is found when, else a table.

    Parameters
    ----------
    truth
        Their motion.
    names
        What each is called.
    in_town
        As `planner.report.tables.plan_table` takes it.
    """
    if len(truth) > len(names):
        yield targets_table(record.evaluation, names)
        return
    for k in np.argsort(record.evaluation.seen_at, kind="stable").tolist():
        yield f"{names[truth.target[k]]}: {mission_line(record, k, in_town=in_town)}"


def write_compare(path: Path, rows: Iterable[MethodRow]) -> None:
    """Write the table of methods as CSV."""
    write_csv(path, [compare_cells(row) for row in rows])


def compare_cells(row: MethodRow) -> dict[str, Any]:
    """Return a method's row as plain data; None where the method cannot be used."""
    if row.evaluated is None or row.planned is None:
        return {"method": row.method, "why_not": row.why_not}
    summary = figures(row.evaluated)
    low_s, high_s = summary.pop("ci95_s")
    by_s = row.evaluated.objective.by_s
    low, high = (None, None) if by_s is None else row.evaluated.found_by_interval(by_s)
    deadline = {} if by_s is None else {"found_by_ci95_low": low, "found_by_ci95_high": high}
    return {
        "method": row.method,
        **summary,
        **deadline,
        "ci95_low_s": low_s,
        "ci95_high_s": high_s,
        "planned_expected_detection_time_s": row.planned.expected_detection_time_s,
        "bound": row.bound,
        "gap": row.gap,
        "roads": row.roads,
        "planning_s": row.took_s,
        "why_not": row.why_not,
    }
