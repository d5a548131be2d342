"""Parquet tables of NumPy columns; the one user of pyarrow beside the reader of SUMO's files.

pyarrow's own ways between NumPy and its arrays load pandas, half a second, for nothing.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from planner.arrays import Ints
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
    return pyarrow.DictionaryArray.from_arrays(indices, pyarrow.array(values))


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
        return column if isinstance(column, pyarrow.Array) else pyarrow.array(column)
    kind = getattr(pyarrow, column.dtype.name)()
    data = pyarrow.py_buffer(np.ascontiguousarray(column))
    return pyarrow.Array.from_buffers(kind, len(column), [None, data])


def read_table(path: Path) -> Any:
    """Return the pyarrow table in a Parquet file.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    import pyarrow
    import pyarrow.parquet

    try:
        return pyarrow.parquet.ParquetFile(path).read()
    except (pyarrow.ArrowException, OSError) as error:
        raise InputError(f"{path}: is no readable Parquet file ({error})") from error


def column(path: Path, table: Any, name: str) -> Any:
    """Return a column as one pyarrow array.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if table.column_names.count(name) > 1:
        raise InputError(f"{path}: has a column {name!r} twice; leave one out")
    if name not in table.column_names:
        raise InputError(f"{path}: has no column {name!r}; it has {', '.join(table.column_names)}")
    return table[name].combine_chunks()


def numbers(path: Path, table: Any, name: str) -> npt.NDArray[np.float64]:
    """Return a column of finite numbers.

    Raises
    ------
    InputError
        If there is no such column, or it holds anything else.
    """
    import pyarrow

    try:
        values = np.from_dlpack(column(path, table, name)).astype(float)
    except (TypeError, pyarrow.ArrowException) as error:
        raise InputError(f"{path}: column {name!r} must hold numbers ({error})") from error
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values)))
        raise InputError(f"{path}: column {name!r} holds NaN or infinity in row {row}; remove it")
    return values


def indices(encoded: Any) -> Ints:
    """Return where in its dictionary each row's value stands, -1 for none, (K,)."""
    if encoded.indices.null_count == 0:
        return np.asarray(np.from_dlpack(encoded.indices))
    return np.array([-1 if i is None else i for i in encoded.indices.to_pylist()])
