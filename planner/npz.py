"""Columns kept in NumPy's own files: written whole, and not believed where they are damaged."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from planner.files import written_whole


def write_columns(path: Path, columns: Mapping[str, Any]) -> None:
    """Write arrays by their names.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with written_whole(path) as new, new.open("wb") as file:
        np.savez(file, **columns)


def read_columns(path: Path, names: Iterable[str]) -> dict[str, Any] | None:
    """Return arrays by their names; None where they are not there, or damaged."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            return {name: kept[name] for name in names}
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return None
