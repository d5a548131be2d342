"""The table of an experiment: a row for each condition, the same bytes for the same seeds."""

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from planner.experiments.condition import Condition
from planner.files import written_whole
from planner.parquet import nullable, write_table
from planner.provenance import versions

RESULTS_CSV, RESULTS, TIMINGS = "results.csv", "results.parquet", "timings.parquet"
SCHEMA = "planner.experiment/1"
UNITS = "time in s on the target's clock, probability from 0 to 1"

Kind = Literal["float64", "int64", "string"]

FIGURES: dict[str, Kind] = {
    "expected_detection_time_s": "float64",  # E[min(tau, horizon)] on fresh targets
    "ci95_low_s": "float64",
    "ci95_high_s": "float64",
    "detection_probability": "float64",
    "found_before_goal_probability": "float64",
    "planned_s": "float64",  # the same expectation on the futures planned with
    "roads": "int64",
    "work": "int64",  # units that the search counts; null for methods that count none
    "reason": "string",  # why there are no figures
}
TIMING: dict[str, Kind] = {"planning_s": "float64", "whole_s": "float64", "host": "string"}

Row = dict[str, Any]


def row_of(condition: Condition, figures: Mapping[str, Any]) -> Row:
    """Return the row of a condition."""
    row: Row = {"id": condition.id, "method": condition.method}
    row |= {key: _cell(level) for key, level in condition.levels.items()}
    row["seed"] = condition.seed
    return row | {name: figures.get(name) for name in FIGURES}


def write_results(out: Path, rows: Sequence[Row]) -> None:
    """Write ``results.csv`` and ``results.parquet``."""
    names = list(rows[0])
    with written_whole(out / RESULTS_CSV) as new, new.open("w", newline="", encoding="utf-8") as to:
        table = csv.DictWriter(to, names, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    columns = {name: [row[name] for row in rows] for name in names}
    made_by = json.dumps(versions(), sort_keys=True)
    described = {"schema": SCHEMA, "units": UNITS, "versions": made_by}
    write_table(out / RESULTS, {name: _column(name, columns[name]) for name in names}, described)


def write_timings(out: Path, ids: Sequence[str], timings: Sequence[Mapping[str, Any]]) -> None:
    """Write ``timings.parquet``: wall-clock times, which no two runs share."""
    columns = {
        name: nullable([timing.get(name) for timing in timings], kind)
        for name, kind in TIMING.items()
    }
    write_table(out / TIMINGS, {"id": nullable(ids, "string"), **columns}, {"schema": SCHEMA})


def _column(name: str, values: list[Any]) -> Any:
    kind = FIGURES.get(name) or ("int64" if name == "seed" else _kind(values))
    return nullable(values if kind != "string" else _texts(values), kind)


def _kind(values: Sequence[Any]) -> Kind:
    return "float64" if all(isinstance(value, int | float) for value in values) else "string"


def _texts(values: Sequence[Any]) -> list[str | None]:
    return [value if value is None else str(value) for value in values]


def _cell(level: Any) -> Any:
    """Return a level as a number, or as text where it is none."""
    if isinstance(level, str) or (isinstance(level, int | float) and not isinstance(level, bool)):
        return level
    return json.dumps(level)
