"""The files of a run, each written whole."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from planner.clock import clock
from planner.export.gui_settings import write_for_gui
from planner.flight.plan import Plan
from planner.futures.store import Recording
from planner.messages import percent
from planner.mission.fly import MissionRecord
from planner.mission.plan_file import figures, write_plan
from planner.mission.run_folder import EVALUATION, PICTURE, PLAN
from planner.parquet import write_table
from planner.report.csv_file import write_csv
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


def write_flights(path: Path, recording: Recording, record: MissionRecord) -> None:
    """Write one row per true target: found or not, when, where and on which leg."""
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
                "target": k,
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


def mission_line(record: MissionRecord, *, in_town: bool = False) -> str:
    """Return what happened in the mission against the first target, in words.

    Parameters
    ----------
    in_town
        As `planner.report.tables.plan_table` takes it.
    """
    evaluation = record.evaluation
    share = float(evaluation.found_by(evaluation.objective.horizon_s)[0])
    if evaluation.survival is not None and not evaluation.found[0]:
        return f"found with probability {percent(share, 0)}: more likely missed than not"
    if not evaluation.found[0]:
        return f"not found; the search stopped at {clock(evaluation.objective.horizon_s)}"
    before = evaluation.seen_at[0] < evaluation.end_s[0]
    x_m, y_m = record.xy_m[0]
    where = f"at ({x_m:,.0f}, {y_m:,.0f}) m"
    leg = f" on leg {record.leg[0]}" if record.leg[0] else ""
    leg += f" by {who}" if (who := _finder(record, 0).get("uav")) else ""
    found = f"found after {evaluation.seen_at[0]:,.0f} s {where}{leg}"
    if evaluation.survival is not None:
        likely = f"more likely than not after {evaluation.seen_at[0]:,.0f} s {where}{leg}"
        return f"found with probability {percent(share, 0)}, {likely}"
    return found if in_town else f"{found}, {'before' if before else 'after'} it reached its goal"


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
