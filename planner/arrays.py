"""Array columns that nobody changes after they are built."""

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
# Integers of any width while they are computed with; `freeze` gives a column its own.
Ints = npt.NDArray[np.integer[Any]]
Offsets = npt.NDArray[np.integer[Any]]
Flags = npt.NDArray[np.bool_]


def freeze(holder: object, **dtypes: type[np.generic]) -> None:
    """Turn the named fields of a frozen dataclass into read-only contiguous arrays of a type."""
    for name, dtype in dtypes.items():
        column: npt.NDArray[Any] = np.array(getattr(holder, name), dtype=dtype, order="C")
        column.flags.writeable = False
        object.__setattr__(holder, name, column)
