"""Tables as CSV, whole or not there."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from planner.files import written_whole


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as CSV; a cell is empty where a row has nothing, or NaN."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = [_cells([row.get(name) for row in rows]) for name in names]
    with written_whole(path) as new, new.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(names)
        table.writerows(zip(*columns, strict=True))


def _cells(values: Sequence[Any]) -> Sequence[Any]:
    """Return a column of one type: whole numbers are floats where some are missing."""
    known = [value is not None and value == value for value in values]  # NaN is not itself
    if not all(known) and all(isinstance(value, int | float | None) for value in values):
        return [float(value) if there else "" for value, there in zip(values, known, strict=True)]
    return [value if there else "" for value, there in zip(values, known, strict=True)]
