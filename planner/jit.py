"""Numba's one door: compiled code is kept where it can be written, with one set of options.

Import this only below a `kernels/` folder: it loads the compiler.
"""

import hashlib
import logging
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from planner.files import cache_folder

log = logging.getLogger(__name__)


def _version() -> str:
    """Name all compiled sources by content: numba overlooks a change in a file it calls into."""
    sources = sorted(Path(__file__).parent.rglob("kernels/*.py"))
    content = b"".join(source.read_bytes() for source in sources)
    return hashlib.sha256(content).hexdigest()[:16]


def _kept_in() -> Path:
    """Return a folder for compiled code that can be written: in the cache, else a temporary one.

    The temporary folder bears the user's number and is used again only if it is really the
    user's own: compiled code that others could write would be run.
    """
    with suppress(OSError):
        folder = cache_folder("compiled", _version())
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    user = os.getuid() if hasattr(os, "getuid") else 0
    shared = Path(tempfile.gettempdir(), f"planner-compiled-{user}-{_version()}")
    with suppress(OSError):
        shared.mkdir(mode=0o700, exist_ok=True)
        found = shared.lstat()
        if found.st_uid == user and not shared.is_symlink() and not found.st_mode & 0o022:
            return shared
    return Path(tempfile.mkdtemp(prefix="planner-compiled-"))


# Numba reads this while it is imported; a read-only installation keeps nothing beside its code.
if "NUMBA_CACHE_DIR" not in os.environ:
    os.environ["NUMBA_CACHE_DIR"] = str(_kept_in())

import numba  # noqa: E402
from numba.core import event  # noqa: E402

# Numba has read it already where the caller has imported numba first.
setattr(numba.config, "CACHE_DIR", os.environ["NUMBA_CACHE_DIR"])  # noqa: B010

F = TypeVar("F", bound=Callable[..., Any])


class _FirstCompilation(event.Listener):
    """Says once what a run waits for; where compiled code is found on disk, nothing is said."""

    said = False

    def on_start(self, _: Any) -> None:
        """Say it before the first function is compiled."""
        if self.said:
            return
        self.said = True
        log.warning(
            "compiling the search for this machine, once: up to a minute (kept in %s)",
            os.environ["NUMBA_CACHE_DIR"],
        )

    def on_end(self, _: Any) -> None:
        """Nothing is left to say."""


register: Any = event.register
register("numba:compile", _FirstCompilation())


def compiled(function: F) -> F:
    """Return ``function`` compiled to machine code on first call, and kept on disk."""
    decorate: Any = numba.njit(cache=True, nogil=True, error_model="numpy")
    made: F = decorate(function)
    return made
