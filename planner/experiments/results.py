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
    "found_by_probability": "float64",  # by search.by_s; null where that is not the objective
    "planned_s": "float64",  # the same expectation on the futures planned with
    "roads": "int64",
    "work": "int64",  # units that the search counts; null for methods that count none
    "reason": "string",  # why there are no figures
    "versions": "string",  # that the condition was run with
}
ALWAYS = ("reason", "versions")  # stand in every table
METRICS = tuple(name for name in FIGURES if name not in ALWAYS)  # that a file can choose from
FRESH = "fresh"  # the name of targets drawn for the seed
FRESH_ONLY = (  # figures that each set of targets has its own of, or none
    "expected_detection_time_s",
    "ci95_low_s",
    "ci95_high_s",
    "detection_probability",
    "found_before_goal_probability",
    "found_by_probability",
)
TIMING: dict[str, Kind] = {
    "planning_s": "float64",
    "whole_s": "float64",
    "host": "string",
    "retries": "int64",  # times that its process was killed before
}

Row = dict[str, Any]


def rows_of(condition: Condition, figures: Mapping[str, Any]) -> list[Row]:
    """Return the rows of a condition: one for each set of targets that it meets, if it has sets.

    Fresh targets, drawn anew for each seed, are a set then too.
    """
    row: Row = {"id": condition.id, "method": condition.method}
    row |= {key: _cell(level) for key, level in condition.levels.items()}
    row["seed"] = condition.seed
    if condition.study:
        made_by = {"versions": figures.get("versions")}
        return [row | found | {"reason": None} | made_by for found in figures.get("rows", ())] or [
            row | {"reason": figures.get("reason")} | made_by
        ]
    measured = {name: figures.get(name) for name in FIGURES}
    if not condition.sets:
        return [row | measured]
    rows = [row | {"targets": FRESH} | measured] if condition.targets else []
    for one in condition.sets:
        on_it = figures.get("sets", {}).get(one.name, {})
        none = dict.fromkeys(FRESH_ONLY)
        rows.append(row | {"targets": one.name} | measured | none | _known(on_it))
    return rows


def _known(figures: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in figures.items() if name in FIGURES}


def write_results(
    out: Path, rows: Sequence[Row], metrics: Sequence[str] = (), credit: Mapping[str, str] = {}
) -> None:
    """Write ``results.csv`` and ``results.parquet``, of the figures these metrics, all if none.

    Parameters
    ----------
    credit
        Whose data the networks are, for the table's metadata.
    """
    left_out = {name for name in METRICS if metrics and name not in metrics}
    rows = [{name: row[name] for name in row if name not in left_out} for row in rows]
    names = list(dict.fromkeys(name for row in rows for name in row))
    with written_whole(out / RESULTS_CSV) as new, new.open("w", newline="", encoding="utf-8") as to:
        table = csv.DictWriter(to, names, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    columns = {name: [row.get(name) for row in rows] for name in names}
    made_by = json.dumps(versions(), sort_keys=True)
    described = {"schema": SCHEMA, "units": UNITS, "versions": made_by, **credit}
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
    numbers = all(isinstance(value, int | float) for value in values if value is not None)
    return "float64" if numbers and any(value is not None for value in values) else "string"


def _texts(values: Sequence[Any]) -> list[str | None]:
    return [value if value is None else str(value) for value in values]


def _cell(level: Any) -> Any:
    """Return a level as a number, or as text where it is none."""
    if isinstance(level, str) or (isinstance(level, int | float) and not isinstance(level, bool)):
        return level
    return json.dumps(level)
