"""Parquet tables of NumPy columns; the one user of pyarrow beside the reader of SUMO's files.

pyarrow's own ways between NumPy and its arrays load pandas, half a second, for nothing. Columns are
cast when they are read: pandas, polars and DuckDB write the same table in types of their own.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.clock import seconds
from planner.errors import InputError
from planner.files import written_whole


def write_table(path: Path, columns: Mapping[str, Any], metadata: Mapping[str, str]) -> None:
    """Write columns (arrays of numbers, lists of texts, pyarrow arrays) as a Parquet file.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    import pyarrow
    import pyarrow.parquet

    arrays = {name: _array(column) for name, column in columns.items()}
    table = pyarrow.Table.from_arrays(list(arrays.values()), names=list(arrays))
    with written_whole(path) as new:
        described = table.replace_schema_metadata(dict(metadata))
        pyarrow.parquet.write_table(described, new, compression="zstd")


def dictionary(index: Ints, values: list[str], *, missing: int) -> Any:
    """Return a column of texts by their index in ``values``, null where it is ``missing``."""
    import pyarrow

    present = np.packbits(index != missing, bitorder="little")
    codes = np.where(index == missing, 0, index).astype(np.int32)
    buffers = [pyarrow.py_buffer(present), pyarrow.py_buffer(codes)]
    indices = pyarrow.Array.from_buffers(pyarrow.int32(), len(codes), buffers)
    return pyarrow.DictionaryArray.from_arrays(indices, _texts(values))


def nullable(values: Sequence[Any], kind: Literal["float64", "int64", "string"]) -> Any:
    """Return a column of one type, null where a value is None."""
    import pyarrow

    return pyarrow.array(values, getattr(pyarrow, kind)())


def nested(rows: Sequence[Any], kind: Literal["float64", "int64"]) -> Any:
    """Return a column of lists of numbers of one type."""
    import pyarrow

    return pyarrow.array([list(row) for row in rows], pyarrow.list_(getattr(pyarrow, kind)()))


def _array(column: Any) -> Any:
    import pyarrow

    if not isinstance(column, np.ndarray):
        return column if isinstance(column, pyarrow.Array) else _texts(column)
    kind = getattr(pyarrow, column.dtype.name)()
    data = pyarrow.py_buffer(np.ascontiguousarray(column))
    return pyarrow.Array.from_buffers(kind, len(column), [None, data])


def _texts(values: Sequence[str]) -> Any:
    """Return texts as a pyarrow array."""
    import pyarrow

    encoded = [value.encode() for value in values]
    ends = np.cumsum([0, *map(len, encoded)]).astype(np.int32)
    buffers = [None, pyarrow.py_buffer(ends), pyarrow.py_buffer(b"".join(encoded))]
    return pyarrow.Array.from_buffers(pyarrow.string(), len(encoded), buffers)


class Coded(NamedTuple):
    """A column of texts: the distinct ones, and each row's number among them."""

    values: tuple[str, ...]
    code: Ints  # (K,) -1 for none


def read_table(path: Path, *, texts: Sequence[str] = ()) -> Any:
    """Return the pyarrow table in a Parquet file.

    Parameters
    ----------
    texts
        Columns of few distinct texts, which are then read faster.

    Raises
    ------
    InputError
        If it cannot be read, or a column stands in it twice.
    """
    import pyarrow
    import pyarrow.parquet

    try:
        file = pyarrow.parquet.ParquetFile(path)
        names = file.schema_arrow.names
        refuse_twice(path, names)
        known = [name for name in texts if name in names]
        return pyarrow.parquet.ParquetFile(path, read_dictionary=known).read()
    except MemoryError:  # one of pyarrow's exceptions, too
        raise
    except (pyarrow.ArrowException, OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is no readable Parquet file ({one_line(error)})") from error


def one_line(error: Exception) -> str:
    """Return a library's message as a single line."""
    return " ".join(str(error).split())


def refuse_twice(path: Path, names: Sequence[str]) -> None:
    """Refuse a table in which two columns have the same name.

    Raises
    ------
    InputError
        With the name.
    """
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise InputError(f"{path}: column {twice[0]!r} stands in it twice; leave one of them out")


def metadata(path: Path, table: Any, key: str) -> str | None:
    """Return a text of a table's metadata, None if there is none of that name.

    Raises
    ------
    InputError
        If it is no text.
    """
    said = (table.schema.metadata or {}).get(key.encode())
    try:
        return None if said is None else str(said, encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: its metadata {key!r} is no text; write it again") from error


def column(path: Path, table: Any, name: str) -> Any:
    """Return a column as one pyarrow array.

    Raises
    ------
    InputError
        If there is none of that name, or more than one.
    """
    refuse_twice(path, [one for one in table.column_names if one == name])
    if name not in table.column_names:
        raise InputError(f"{path}: has no column {name!r}; it has {', '.join(table.column_names)}")
    return table[name].combine_chunks()


def numbers(path: Path, table: Any, name: str) -> Floats:
    """Return a column of finite numbers.

    Raises
    ------
    InputError
        If there is no such column, or it holds anything else.
    """
    return _finite(path, name, numbers_or_nan(path, table, name))


def numbers_or_nan(path: Path, table: Any, name: str) -> Floats:
    """Return a column of numbers, NaN where it is null.

    Raises
    ------
    InputError
        If there is no such column, or it holds anything but numbers, or texts of numbers.
    """
    return _floats(path, name, _plain(column(path, table, name)))


def seconds_or_nan(path: Path, table: Any, name: str) -> Floats:
    """Return a column of times in seconds, NaN where it is null.

    Durations and times of the day become seconds, whatever their unit; so do texts, which may be
    "H:M:S" as well.

    Raises
    ------
    InputError
        If there is no such column, or it holds anything else, such as dates.
    """
    from pyarrow import types

    values = _plain(column(path, table, name))
    kind = values.type
    if types.is_timestamp(kind) or types.is_date(kind):
        raise InputError(
            f"{path}: column {name!r} holds dates ({kind}); subtract the moment that is to be "
            "time 0, and write seconds"
        )
    if types.is_duration(kind) or types.is_time(kind):
        return _seconds_of_units(path, name, values)
    if _is_text(kind):
        texts = _coded(path, name, values)
        return np.append(_clock_times(path, name, texts.values), np.nan)[texts.code]
    return _floats(path, name, values)


def seconds_column(path: Path, table: Any, name: str) -> Floats:
    """Return a column of finite times in seconds, as `seconds_or_nan` reads them.

    Raises
    ------
    InputError
        As `seconds_or_nan`, and if a time is missing.
    """
    return _finite(path, name, seconds_or_nan(path, table, name))


def texts(path: Path, table: Any, name: str) -> Coded:
    """Return a column of texts; whole numbers are taken as names, such as 7 as "7".

    Raises
    ------
    InputError
        If there is no such column, or it holds anything else.
    """
    return _coded(path, name, column(path, table, name))


def coded(values: Sequence[str | None], code: Ints) -> Coded:
    """Return texts by their number in ``values``, which may hold one of them twice, or None."""
    number: dict[str, int] = {}
    of = [-1 if one is None else number.setdefault(one, len(number)) for one in values]
    if of != list(range(len(values))):
        code = np.array([*of, -1])[code]
    return Coded(tuple(number), code)


def _finite(path: Path, name: str, values: Floats) -> Floats:
    finite = np.isfinite(values)
    if not finite.all():
        raise InputError(
            f"{path}: column {name!r} holds no finite number (null, NaN or infinity) in row "
            f"{int(np.argmin(finite))}; remove it"
        )
    return values


def _plain(values: Any) -> Any:
    """Return an array without a dictionary."""
    import pyarrow

    return values.dictionary_decode() if pyarrow.types.is_dictionary(values.type) else values


def _is_text(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_string(kind) or types.is_large_string(kind) or types.is_string_view(kind))


def _floats(path: Path, name: str, values: Any) -> Floats:
    import pyarrow
    from pyarrow import types

    kind = values.type
    known = _is_text(kind) or types.is_null(kind) or types.is_decimal(kind)
    if not (known or types.is_integer(kind) or types.is_floating(kind)):
        raise InputError(f"{path}: column {name!r} must hold numbers, not {kind}")
    try:
        # A number of nanoseconds may need more digits than a float has.
        floats = values.cast(pyarrow.float64(), safe=False)
    except pyarrow.ArrowException as error:
        text = one_line(error)
        raise InputError(f"{path}: column {name!r} must hold numbers ({text})") from error
    return np.asarray(_filled(floats, np.nan) if floats.null_count else np.from_dlpack(floats))


def _seconds_of_units(path: Path, name: str, values: Any) -> Floats:
    import pyarrow

    per_second = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[values.type.unit]
    whole = values.cast(pyarrow.int32()) if values.type.bit_width == 32 else values
    return _floats(path, name, whole.cast(pyarrow.int64())) / per_second


def _clock_times(path: Path, name: str, values: Sequence[str]) -> list[float]:
    try:
        return [seconds(one) for one in values]
    except InputError as error:
        raise InputError(f"{path}: column {name!r} {error}") from error


def _coded(path: Path, name: str, values: Any) -> Coded:
    import pyarrow
    from pyarrow import types

    try:
        if not types.is_dictionary(values.type):
            view = types.is_string_view(values.type)
            values = (values.cast(pyarrow.large_string()) if view else values).dictionary_encode()
        words = values.dictionary
        kind = words.type
        if types.is_floating(kind) or types.is_decimal(kind):
            words = words.cast(pyarrow.int64())  # names of which one is missing, as pandas has them
        elif not (_is_text(kind) or _is_bytes(kind) or types.is_integer(kind)):
            raise InputError(f"{path}: column {name!r} must hold names, not {kind}")
        words = words.cast(pyarrow.large_string())
    except pyarrow.ArrowException as error:
        text = one_line(error)
        raise InputError(f"{path}: column {name!r} must hold names ({text})") from error
    return coded(words.to_pylist(), _codes(values))


def _is_bytes(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_binary(kind) or types.is_large_binary(kind) or types.is_null(kind))


def _filled(values: Any, missing: float) -> Any:
    """Return a pyarrow array as NumPy's, with a number in the place of nulls.

    pyarrow's own way makes a value of the number first, and that loads pandas.
    """
    import pyarrow

    present = np.from_dlpack(values.is_valid().cast(pyarrow.uint8())) != 0
    data = [None, values.buffers()[1]]
    bare = pyarrow.Array.from_buffers(values.type, len(values), data, offset=values.offset)
    return np.where(present, np.from_dlpack(bare), missing)


def _codes(encoded: Any) -> Ints:
    """Return where in its dictionary each row's value stands, -1 for none, (K,)."""
    import pyarrow

    found = encoded.indices
    if found.null_count:
        return np.asarray(_filled(found.cast(pyarrow.int32()), -1))
    return np.asarray(np.from_dlpack(found))
