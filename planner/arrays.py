"""Array columns that nobody changes after they are built."""

from collections.abc import Iterable, Sized
from dataclasses import fields
from typing import Any

import numpy as np
import numpy.typing as npt

from planner.errors import InputError

Floats = npt.NDArray[np.float64]
# Integers of any width while they are computed with; `freeze` gives a column its own.
Ints = npt.NDArray[np.integer[Any]]
Offsets = npt.NDArray[np.integer[Any]]
Flags = npt.NDArray[np.bool_]


class Frozen:
    """A frozen dataclass whose arrays stay read-only when it is pickled or copied.

    What it has derived from its fields is left out: a copy derives it again, and compiled code
    meets the same kinds of arrays there.
    """

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone."""
        holder: Any = self
        return {field.name: getattr(self, field.name) for field in fields(holder)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take the fields back, arrays read-only."""
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)


def freeze(holder: object, **dtypes: type[np.generic]) -> None:
    """Turn the named fields of a frozen dataclass into read-only contiguous arrays of a type.

    Raises
    ------
    InputError
        If one cannot be turned into such an array.
    """
    for name, dtype in dtypes.items():
        try:
            _refuse_fractions(getattr(holder, name), dtype)
            column: npt.NDArray[Any] = np.array(getattr(holder, name), dtype=dtype, order="C")
        except (TypeError, ValueError, OverflowError) as error:
            kind = np.dtype(dtype).name
            raise InputError(f"{name}: cannot be an array of {kind} ({error})") from error
        column.flags.writeable = False
        object.__setattr__(holder, name, column)


def _refuse_fractions(values: Any, dtype: type[np.generic]) -> None:
    """Whole numbers may come as floats, but no fraction is cut off, and no NaN becomes a number."""
    if issubclass(dtype, np.integer) and getattr(values, "dtype", None) is not None:
        is_real = values.dtype.kind == "f"
        if is_real and not np.all(np.isfinite(values) & (values == np.floor(values))):
            raise ValueError("a number is not whole")


# Rows of N owners, one owner's after the other's: `first` says where each one's start, and at its
# end how many rows there are, (N + 1,).


def first_rows(counts: npt.ArrayLike) -> Offsets:
    """Return where the rows of owners start who have so many each, (N,)."""
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))


def first_of_parts(parts: Iterable[Sized]) -> Offsets:
    """Return where the rows of each part start when all stand one after the other."""
    return first_rows([len(part) for part in parts])


def rows_taken(first: Offsets, owners: Offsets) -> tuple[Offsets, Offsets]:
    """Return which rows some owners have, in the order given, and where each one's start there."""
    counts = np.diff(first)[owners]
    taken = first_rows(counts)
    return np.arange(taken[-1]) + np.repeat(first[owners] - taken[:-1], counts), taken


def first_kept(first: Offsets, kept: Flags) -> Offsets:
    """Return where each owner's rows start once only some rows are kept."""
    return first_rows(kept)[first]
