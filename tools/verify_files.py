"""JSON and Parquet files of which nothing is believed: each field is asked for by name and type.

A file is read only if it is a plain one of a sensible size, and a number counts only if it is
finite and no other type in disguise.
"""

import json
import math
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pyarrow
import pyarrow.parquet

Array: TypeAlias = Any  # of NumPy; its shape is said in words

MOST_BYTES = 2**28  # of a file
MOST_ROWS = 10_000_000  # of a table
MOST_VALUES = 50_000_000  # of all lists in a column
MOST_DIGITS = 18  # of a whole number
LARGEST = 1e15  # of a number of metres, seconds or anything else


class RefusedError(ValueError):
    """A file is not what a certified run leaves; the text says which one and why."""


class Fields:
    """An object of a JSON file, whose fields are asked for by name and type.

    Parameters
    ----------
    source
        The file that it was read from, if it is all of it.
    """

    def __init__(self, where: str, content: Any, source: bytes = b"") -> None:
        self.where, self.content, self.source = where, content, source
        if not isinstance(content, dict):
            raise RefusedError(f"{where}: should be an object")

    def __contains__(self, key: str) -> bool:
        return key in self.content

    def any(self, key: str) -> Any:
        """Return a field of whatever type."""
        if key not in self.content:
            raise RefusedError(f"{self.where}: has no {key}")
        return self.content[key]

    def part(self, key: str) -> "Fields":
        """Return a field that is an object."""
        return Fields(f"{self.where}: {key}", self.any(key))

    def items(self, key: str, most: int = MOST_ROWS) -> list[Any]:
        """Return a field that is a list."""
        found = self.any(key)
        if not isinstance(found, list) or len(found) > most:
            raise self._no(key, f"a list of at most {most}")
        return found

    def text(self, key: str, *choices: str) -> str:
        """Return a field that is a text, one of some if there are any."""
        found = self.any(key)
        if not isinstance(found, str) or (choices and found not in choices):
            raise self._no(key, " or ".join(map(repr, choices)) or "a text")
        return found

    def flag(self, key: str) -> bool:
        """Return a field that is true or false."""
        found = self.any(key)
        if not isinstance(found, bool):
            raise self._no(key, "true or false")
        return found

    def whole(self, key: str, least: int = 0) -> int:
        """Return a field that is a whole number."""
        found = self.any(key)
        if type(found) is not int or not least <= found <= LARGEST:
            raise self._no(key, f"a whole number from {least} on")
        return found

    def number(self, key: str, least: float = -LARGEST) -> float:
        """Return a field that is a finite number."""
        found = self.any(key)
        if not is_number(found) or found < least:
            raise self._no(key, "a number" + f" from {least:g} on" * (least > -LARGEST))
        return float(found)

    def above_zero(self, key: str) -> float:
        """Return a field that is a number above zero."""
        found = self.number(key, 0.0)
        if found == 0.0:
            raise self._no(key, "a number above zero")
        return found

    def maybe(self, key: str, least: float = -LARGEST) -> float | None:
        """Return a field that is a number or null."""
        return None if self.any(key) is None else self.number(key, least)

    def rows(self, key: str, width: int, least: int = 0) -> Array:
        """Return a field that is a list of rows of numbers, (rows, width)."""
        return rows_of(f"{self.where}: {key}", self.items(key), width, least)

    def _no(self, key: str, should: str) -> RefusedError:
        return RefusedError(f"{self.where}: {key} should be {should}")


def is_number(value: Any) -> bool:
    """Tell whether a value is a finite number of a sensible size, and no truth value."""
    return type(value) in (int, float) and abs(value) <= LARGEST


def rows_of(where: str, rows: list[Any], width: int, least: int = 0) -> Array:
    """Return rows of numbers as an array, (rows, width)."""
    fits = (
        isinstance(row, list) and len(row) == width and all(map(is_number, row)) for row in rows
    )
    if len(rows) < least or not all(fits):
        raise RefusedError(f"{where} should be at least {least} rows of {width} numbers")
    return np.array(rows, dtype=float).reshape(-1, width)


def opened(folder: Path, name: str) -> Path:
    """Return the path of a plain file of a sensible size; links may lead anywhere."""
    path = folder / name
    try:
        found = path.lstat()
    except (OSError, ValueError) as error:
        raise RefusedError(f"{name}: cannot be read ({one_line(error)})") from error
    if not stat.S_ISREG(found.st_mode):
        raise RefusedError(f"{name}: is no plain file; put the file itself there")
    if found.st_size > MOST_BYTES:
        raise RefusedError(f"{name}: is larger than {MOST_BYTES >> 20} MB")
    return path


def one_line(error: BaseException) -> str:
    """Return an error's text as `shown` has it."""
    return shown(getattr(error, "strerror", None) or str(error) or type(error).__name__)


def shown(value: object) -> str:
    """Return something as text without line breaks and control characters, and not too long."""
    return "".join(c if c.isprintable() else " " for c in str(value))[:200]


def read_json(folder: Path, name: str) -> Fields:
    """Return a JSON file's object; each key stands once, and numbers are finite."""
    try:
        source = opened(folder, name).read_bytes()
        found = json.loads(
            source.decode("utf-8"),
            parse_constant=_no_constant,
            parse_int=_whole,
            parse_float=_finite,
            object_pairs_hook=_once,
        )
    except RefusedError as error:
        raise error if name in str(error) else RefusedError(f"{name}: {error}") from error
    except RecursionError as error:
        raise RefusedError(f"{name}: is nested too deeply") from error
    except (OSError, ValueError) as error:
        raise RefusedError(f"{name}: is no JSON ({one_line(error)})") from error
    return Fields(name, found, source)


def _no_constant(text: str) -> float:
    raise RefusedError(f"holds {text}, which is no JSON")


def _whole(text: str) -> int:
    if len(text) > MOST_DIGITS:
        raise RefusedError(f"holds a number of {len(text)} digits")
    return int(text)


def _finite(text: str) -> float:
    if not math.isfinite(float(text)):
        raise RefusedError("holds a number beyond all bounds")
    return float(text)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise RefusedError("holds a key twice")
    return found


class Column(NamedTuple):
    """A column of a Parquet table: its numbers, and in lists how many each row has."""

    values: Array
    lengths: Array | None = None


def read_columns(folder: Path, name: str, **types: pyarrow.DataType) -> dict[str, Column]:
    """Return columns of a Parquet file by name; each stands once, is of its type and full."""
    try:
        path = opened(folder, name)
        with pyarrow.parquet.ParquetFile(path, memory_map=False) as file:
            _check_sizes(name, file)
            _check_types(name, file.schema_arrow, types)
            table = file.read(list(types))
        return {key: _column(name, key, table[key].combine_chunks()) for key in types}
    except (pyarrow.ArrowException, OSError, MemoryError) as error:
        raise RefusedError(f"{name}: is no Parquet table ({one_line(error)})") from error


def _check_sizes(name: str, file: Any) -> None:
    most = max((chunk.num_values for chunk in _chunks(file.metadata)), default=0)
    if file.metadata.num_rows > MOST_ROWS or most > MOST_VALUES:
        raise RefusedError(f"{name}: holds more than {MOST_ROWS:,} rows")


def _chunks(metadata: Any) -> Iterator[Any]:
    for group in range(metadata.num_row_groups):
        row_group = metadata.row_group(group)
        yield from (row_group.column(i) for i in range(row_group.num_columns))


def _check_types(name: str, schema: Any, types: Mapping[str, pyarrow.DataType]) -> None:
    for key, wanted in types.items():
        if schema.names.count(key) != 1:
            raise RefusedError(f"{name}: should have one column {key}")
        found = schema.field(key).type
        is_list = pyarrow.types.is_list(found) and pyarrow.types.is_list(wanted)
        fits = found.value_type == wanted.value_type if is_list else found == wanted
        if not fits:
            raise RefusedError(f"{name}: column {key} should be of type {wanted}")


def _column(name: str, key: str, array: Any) -> Column:
    is_list = pyarrow.types.is_list(array.type)
    values = array.flatten() if is_list else array
    if array.null_count or values.null_count:
        raise RefusedError(f"{name}: column {key} should hold no null")
    lengths = np.from_dlpack(array.value_lengths()).astype(np.int64) if is_list else None
    return Column(np.from_dlpack(values), lengths)
