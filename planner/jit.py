"""Numba's one door: compiled code is kept where it can be written, with one set of options.

Import this only from ``kernels.py`` files: it loads the compiler.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from planner.files import cache_folder


def _version() -> str:
    """Name all compiled sources by content: numba overlooks a change in a file it calls into."""
    sources = sorted(Path(__file__).parent.rglob("kernels*.py"))
    content = b"".join(source.read_bytes() for source in sources)
    return hashlib.sha256(content).hexdigest()[:16]


# Numba reads this while it is imported; a read-only installation keeps nothing beside its code.
os.environ.setdefault("NUMBA_CACHE_DIR", str(cache_folder("compiled", _version())))

import numba  # noqa: E402

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Return ``function`` compiled to machine code on first call, and kept on disk."""
    decorate: Any = numba.njit(cache=True, nogil=True, error_model="numpy")
    made: F = decorate(function)
    return made
