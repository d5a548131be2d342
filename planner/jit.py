"""Numba's one door: compiled code is kept where it can be written, with one set of options.

Import this only below a `kernels/` folder: it loads the compiler.
"""

import hashlib
import io
import logging
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from planner.cache import cache_folder
from planner.compiling import COMPILING

log = logging.getLogger(__name__)


def _version() -> str:
    """Name all compiled sources by content: numba overlooks a change in a file it calls into."""
    sources = [Path(__file__), *sorted(Path(__file__).parent.rglob("kernels/*.py"))]
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

from numba.core import caching  # noqa: E402

_CacheFiles: Any = caching.IndexDataCacheFile

F = TypeVar("F", bound=Callable[..., Any])


class _FirstCompilation(event.Listener):
    """Says once what a run waits for; where compiled code is found on disk, nothing is said."""

    said = False

    def on_start(self, _: Any) -> None:
        """Say it before the first function is compiled."""
        COMPILING.begin(time.perf_counter())
        if self.said:
            return
        self.said = True
        log.warning(
            "compiling what this command runs, once on this machine: up to a minute (kept in %s)",
            os.environ["NUMBA_CACHE_DIR"],
        )

    def on_end(self, _: Any) -> None:
        """Take note of the time."""
        COMPILING.end(time.perf_counter())


register: Any = event.register
register("numba:compile", _FirstCompilation())


class _WholeFiles(_CacheFiles):  # type: ignore[misc]
    """Numba's files of compiled code, each with its digest at its end: a cut one is none."""

    def _load_index(self) -> Any:
        return super()._load_index() if _is_whole(self._index_path) else {}

    def _load_data(self, name: str) -> Any:
        path = self._data_path(name)
        if not _is_whole(path):
            raise OSError(f"{path} is damaged")  # it is compiled anew
        return super()._load_data(name)

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[Any]:
        content = io.BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(content.getvalue() + hashlib.sha256(content.getvalue()).digest())


def _is_whole(path: str) -> bool:
    try:
        content = Path(path).read_bytes()
    except OSError:
        return False
    digest = hashlib.sha256().digest_size
    whole = content[-digest:] == hashlib.sha256(content[:-digest]).digest()
    if not whole:
        log.warning("%s: the cache's compiled code is damaged; it is compiled anew", path)
    return whole


def compiled(function: F) -> F:
    """Return ``function`` compiled to machine code on first call, and kept on disk."""
    decorate: Any = numba.njit(cache=True, nogil=True, error_model="numpy")
    made: F = decorate(function)
    kept = made._cache._cache_file  # type: ignore[attr-defined]
    kept.__class__ = _WholeFiles  # numba has no way to name another one
    return made
