"""Columns kept in NumPy's own files: written whole, and not believed where they are damaged."""

import json
from collections.abc import Iterable, Mapping, Sequence
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


def save_fields(path: Path, fields: Mapping[str, Any], texts: Sequence[str]) -> None:
    """Write fields by their names, of which some are texts and the others arrays.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    said = json.dumps({name: fields[name] for name in texts})
    arrays = {name: column for name, column in fields.items() if name not in texts}
    write_columns(path, {"texts": np.array(said), **arrays})


def load_fields(path: Path, texts: Sequence[str], arrays: Sequence[str]) -> dict[str, Any] | None:
    """Return fields by their names, lists as tuples; None where not all are there, or damaged."""
    kept = read_columns(path, ("texts", *arrays))
    if kept is None:
        return None
    try:
        said = json.loads(str(kept.pop("texts")))
        found = {name: said[name] for name in texts}
    except (ValueError, KeyError, TypeError):
        return None
    return {**{k: tuple(v) if isinstance(v, list) else v for k, v in found.items()}, **kept}
