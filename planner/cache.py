"""The cache: nets, recordings and compiled code, each entry checked before it is believed.

Beside the entries stand their digests, made when an entry is complete. An entry that does not match
is made anew. What was used least recently goes when the cache outgrows ``PLANNER_CACHE_GB``, but
never what a command that still runs may have in use.
"""

import atexit
import hashlib
import logging
import math
import os
import shutil
import stat
import time
from contextlib import suppress
from functools import cache, partial
from pathlib import Path

from planner.errors import InputError, OutputError
from planner.files import cache_root, written_whole
from planner.interrupts import at_stop
from planner.locks import is_at, locked

log = logging.getLogger(__name__)

PARTS = ("nets", "futures", "unfinished", "compiled")
DIGESTS, RUNNING = "digests", "running"
LARGEST_GB = 5.0
FRESH_S = 60.0  # an entry's last use is noted no more often

UNSEEN = 0.05  # of the limit: so much we add before we look at what others have added meanwhile

# Bytes of a cache when this process last looked, and what it has added since.
_looked: dict[Path, tuple[float, float]] = {}


def cache_folder(*parts: str) -> Path:
    """Return a folder of the cache.

    Raises
    ------
    OutputError
        If others could have written to it: what is in it is believed, and compiled code is run.
    """
    root = cache_root()
    _refuse_foreign(root)
    return root.joinpath(*parts)


@cache
def _refuse_foreign(root: Path) -> None:
    with suppress(OSError):
        root.parent.mkdir(parents=True, exist_ok=True)
        root.mkdir(mode=0o700, exist_ok=True)
    if os.environ.get("PLANNER_CACHE_SHARED") == "1" or not hasattr(os, "getuid"):
        return
    for folder in (root, *(root / part for part in PARTS)):
        with suppress(OSError):
            found = folder.stat()
            foreign = found.st_uid not in (os.getuid(), 0)
            if foreign or found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                who = "belongs to another user" if foreign else "can be written by others"
                raise OutputError(
                    f"{folder}: the cache {who}, and code in it is run; chmod go-w, choose another "
                    "folder with PLANNER_CACHE, or trust it with PLANNER_CACHE_SHARED=1"
                )


def is_whole(entry: Path) -> bool:
    """Return whether an entry is there as it was when it was sealed, and note that it is used."""
    note_running()
    record = _record(entry)
    try:
        known = record.read_text(encoding="ascii")
        if known != _digest(entry):
            log.warning("%s: the cache's copy is damaged; it is made anew", entry.name)
            return False
        if time.time() - record.stat().st_mtime > FRESH_S:
            os.utime(record)
    except (OSError, UnicodeDecodeError):
        return False
    return True


def seal(entry: Path) -> None:
    """Note what a new entry holds, and make room for it."""
    with written_whole(_record(entry)) as new:
        new.write_text(_digest(entry), encoding="ascii")
    _make_room(entry)


def _record(entry: Path) -> Path:
    return cache_folder(DIGESTS, entry.parent.name, entry.name)


def _digest(entry: Path) -> str:
    """Return the digest of a file, or of all files in a folder but those that are being written."""
    files = [entry]
    if entry.is_dir():
        files = sorted(file for file in entry.iterdir() if not file.name.startswith("."))
    digest = hashlib.sha256()
    for path in files:
        with path.open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()


def size(path: Path) -> int:
    """Return how many bytes a file or a folder takes."""
    with suppress(OSError):
        return _size_within(path) if path.is_dir() else path.lstat().st_size
    return 0


def _size_within(folder: str | Path) -> int:
    total = 0
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            with suppress(OSError):  # another command may have removed it meanwhile
                inside = entry.is_dir(follow_symlinks=False)
                own = entry.stat(follow_symlinks=False).st_size
                total += _size_within(entry.path) if inside else own
    return total


def sizes() -> dict[str, int]:
    """Return how many bytes each part of the cache takes."""
    root = cache_folder()
    return {part: size(root / part) if (root / part).is_dir() else 0 for part in PARTS}


def clear() -> int:
    """Remove all that no other command may have in use; return how many bytes that was."""
    before = sum(sizes().values())
    for _, entry in _unused():
        _drop(entry)
    return before - sum(sizes().values())


def _make_room(newest: Path) -> None:
    most, root = limit_bytes(), cache_folder()
    # To look at all that is there takes long in a cache of many files.
    total, added = _looked.get(root, (math.inf, 0.0))
    added += size(newest)
    if total + added > most or added > UNSEEN * most:
        total, added = _with_room(newest, sum(sizes().values()), most), 0.0
    _looked[root] = total, added


def _with_room(newest: Path, total: float, most: float) -> float:
    """Remove what was used least recently until the rest takes no more; return what that takes."""
    for _, entry in _unused():
        if total <= most:
            break
        if entry != newest:
            total -= size(entry)
            _drop(entry)
    return total


def limit_bytes() -> float:
    """Return how many bytes the cache may take: ``$PLANNER_CACHE_GB`` times 10^9.

    Raises
    ------
    InputError
        If that is no number.
    """
    said = os.environ.get("PLANNER_CACHE_GB", "")
    try:
        number = float(said) if said else LARGEST_GB
    except ValueError:
        number = -1.0
    if not number >= 0.0:
        raise InputError(f"PLANNER_CACHE_GB={said}: is no size; give gigabytes, such as 5")
    return number * 1e9


def _unused() -> list[tuple[float, Path]]:
    """Return when each entry was last used, the longest ago first; none that may be in use."""
    since_s = _oldest_running_s()
    root = cache_folder()
    found = []
    for part in PARTS:
        for entry in root.joinpath(part).glob("*"):
            record = root / DIGESTS / part / entry.name
            with suppress(OSError):
                used_s = (record if record.exists() else entry).stat().st_mtime
                if used_s < since_s and not entry.name.startswith("."):
                    found.append((used_s, entry))
    return sorted(found)


def _drop(entry: Path) -> None:
    """Remove an entry; its record first, so that half of it is never believed."""
    with suppress(OSError):
        _record(entry).unlink(missing_ok=True)
        if entry.is_dir():
            shutil.rmtree(entry)
        else:
            entry.unlink()


# Commands that run


@cache
def note_running() -> int | None:
    """Hold a lock that says that this process uses the cache from now on, until it ends.

    Returns
    -------
    int or None
        The open file that is locked; None where nothing can be.
    """
    with suppress(OSError):
        folder = cache_folder(RUNNING)
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{os.getpid()}-{os.urandom(4).hex()}"
        descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
        locked(descriptor)
        atexit.register(_note_ended, path, os.getpid())
        at_stop(partial(_note_ended, path, os.getpid()))
        return descriptor
    return None


def _note_ended(path: Path, process: int) -> None:
    if os.getpid() == process:  # a copy of it may end sooner
        path.unlink(missing_ok=True)


def _oldest_running_s() -> float:
    """Return when the first of the other commands that still run began; now if there is none."""
    mine = note_running()
    first_s = time.time()
    for path in cache_folder(RUNNING).glob("*"):
        with suppress(OSError):
            if mine is not None and is_at(path, mine):
                continue
            if _has_ended(path):
                path.unlink()
            else:
                first_s = min(first_s, path.stat().st_mtime)
    return first_s


def _has_ended(path: Path) -> bool:
    descriptor = os.open(path, os.O_WRONLY)
    try:
        return locked(descriptor) is True
    finally:
        os.close(descriptor)
