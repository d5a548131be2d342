"""Arguments of Python callers, checked: a number or an array as it is meant, or InputError.

NumPy's scalars are numbers like Python's own; truth values and texts are not.
"""

import math
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any, get_args

import numpy as np

from planner.arrays import Floats, Offsets
from planner.errors import InputError
from planner.messages import as_written

MOST = 2**63 - 1  # of a whole number


def number(
    name: str,
    value: Any,
    *,
    least: float = -math.inf,
    above: float | None = None,
    ends: bool = True,
) -> float:
    """Return a number as Python's own.

    Parameters
    ----------
    least, above
        What it has to reach, or exceed.
    ends
        False: infinity will do as well.

    Raises
    ------
    InputError
        If it is none, or out of its range.
    """
    found = _plain(value)
    fits = isinstance(found, Real) and not isinstance(found, bool | np.bool_) and found == found
    fits = fits and not (ends and math.isinf(found)) and found >= least
    if not fits or (above is not None and not found > above):
        limit = f" above {above:g}" if above is not None else f" from {least:g} on"
        wanted = f"a {'finite ' * ends}number{limit * (above is not None or least > -math.inf)}"
        raise InputError(f"{name}: {_shown(value)} is not {wanted}")
    return float(found)


def whole(name: str, value: Any, *, least: int = 0) -> int:
    """Return a whole number as Python's own.

    Raises
    ------
    InputError
        If it is none, or less than ``least``.
    """
    found = _plain(value)
    fits = isinstance(found, Integral) and not isinstance(found, bool | np.bool_)
    if not fits or not least <= found <= MOST:
        raise InputError(f"{name}: {_shown(value)} is not a whole number from {least} on")
    return int(found)


def flag(name: str, value: Any) -> bool:
    """Return a truth value as Python's own.

    Raises
    ------
    InputError
        If it is anything else.
    """
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name}: {_shown(value)} is not True or False")
    return bool(value)


def choice(name: str, value: Any, choices: Any) -> None:
    """Do nothing if a value is one of a ``Literal``.

    Raises
    ------
    InputError
        If it is not.
    """
    if not (isinstance(value, str) and value in get_args(choices)):
        known = ", ".join(map(repr, get_args(choices)))
        raise InputError(f"{name}: {_shown(value)} is unknown; choose one of {known}")


def instance(name: str, value: Any, *kinds: type) -> None:
    """Do nothing if a value is of one of some classes.

    Raises
    ------
    InputError
        If it is not.
    """
    if not isinstance(value, kinds):
        wanted = " or ".join(kind.__name__ for kind in kinds)
        raise InputError(f"{name}: {_shown(value)} is not {wanted}")


def lengths(length: int, **columns: Any) -> None:
    """Do nothing if columns have a length.

    Raises
    ------
    InputError
        If one has another; the text names it.
    """
    for name, column in columns.items():
        if np.ndim(column) == 0 or len(column) != length:
            raise InputError(f"{name}: has the shape {np.shape(column)}, not {length} entries")


def finite(**columns: Floats) -> None:
    """Do nothing if columns hold finite numbers only.

    Raises
    ------
    InputError
        If one does not; the text names it.
    """
    for name, column in columns.items():
        if not np.isfinite(column).all():
            raise InputError(f"{name}: holds NaN or infinity; leave such rows out")


def weights(name: str, weight: Floats) -> None:
    """Do nothing if weights are finite and none is negative.

    Raises
    ------
    InputError
        If they are not.
    """
    if not np.all((weight >= 0.0) & (weight < np.inf)):
        raise InputError(f"{name}: should be finite and 0 or more each")


def offsets(name: str, first: Offsets, rows: int, entries: int) -> None:
    """Do nothing if offsets say where each of some rows starts in a column of entries.

    Raises
    ------
    InputError
        If they do not.
    """
    fits = first.shape == (rows + 1,) and first[0] == 0 and first[-1] == entries
    if not fits or np.any(np.diff(first) < 0):
        raise InputError(f"{name}: should rise from 0 to {entries} in {rows + 1} entries")


def indices(most: int, **columns: Offsets) -> None:
    """Do nothing if columns hold indices below a number.

    Raises
    ------
    InputError
        If one does not; the text names it.
    """
    for name, column in columns.items():
        if len(column) and not 0 <= column.min() <= column.max() < most:
            raise InputError(f"{name}: should hold whole numbers from 0 to {most - 1}")


def same_length(**columns: Any) -> int:
    """Return the length that columns have in common.

    Raises
    ------
    InputError
        If they have none; the text names the one that differs from the first.
    """
    first, *_ = columns.values()
    if np.ndim(first) == 0:
        raise InputError(f"{next(iter(columns))}: is no column")
    lengths(len(first), **columns)
    return len(first)


def set_fields(holder: object, values: Mapping[str, Any]) -> None:
    """Give fields of a frozen dataclass the values that were checked."""
    for name, value in values.items():
        object.__setattr__(holder, name, value)


def _plain(value: Any) -> Any:
    is_scalar = isinstance(value, np.ndarray) and value.ndim == 0
    return value.item() if is_scalar else value


def _shown(value: Any) -> str:
    known = isinstance(value, str | int | float | bool) or value is None
    return as_written(value) if known else as_written(repr(value))
