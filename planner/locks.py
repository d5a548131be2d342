"""Locks that end with the process that holds them, and temporary files that bear one.

A process that is killed cleans nothing up, but the system releases its locks: a temporary file
whose lock is free has no owner any more, and the next command removes it (`sweep`).
"""

import logging
import os
import re
import shutil
import socket
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from hashlib import sha256
from pathlib import Path

from planner.interrupts import at_stop, undone_if_stopped

if sys.platform != "win32":
    import fcntl

log = logging.getLogger(__name__)

NAME = re.compile(r"\.?planner-(?P<host>[0-9a-f]{8})-[0-9a-f]{12}")
NEW = os.O_RDWR | os.O_CREAT | os.O_EXCL
LONGEST = 32  # characters of an ending, as names have an end
SWEEPING_S = 0.05  # for which a sweep may hold a lock that nobody needs
FOREIGN_S = 86400.0  # after which what another computer left is taken for left behind


def locked(descriptor: int, *, shared: bool = False, wait: bool = False) -> bool | None:
    """Return whether an open file or folder could be locked; None where nothing can be.

    The lock is released when the descriptor is closed, at the latest when the process ends.
    """
    if sys.platform == "win32":
        return None
    how = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
    try:
        fcntl.flock(descriptor, how if wait else how | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return None
    return True


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Have a folder alone, which is made if there is none; wait while another process has it."""
    while True:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            if locked(descriptor) is False:
                log.warning("another command is at the same; waiting for it")
                locked(descriptor, wait=True)
            if is_at(folder, descriptor):
                yield
                return
            # The other process has removed its folder meanwhile.
        finally:
            os.close(descriptor)


@contextmanager
def sole_writer(path: Path) -> Iterator[bool]:
    """Give whether no other process of this computer is about to write a file; it need not exist.

    Meanwhile a hidden file lies beside it, whose name is made from its own.
    """
    lock = path.parent / f".planner-{_host()}-{sha256(os.fsencode(path.name)).hexdigest()[:12]}"
    while True:
        descriptor = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if locked(descriptor) is False:
                time.sleep(SWEEPING_S)
                if locked(descriptor) is False:
                    yield False
                    return
            if is_at(lock, descriptor):
                with undone_if_stopped(partial(_remove, lock)):
                    try:
                        yield True
                    finally:
                        _remove(lock)
                return
            # The other process has written its file meanwhile.
        finally:
            os.close(descriptor)


@contextmanager
def temporary_folder(parent: Path | None = None) -> Iterator[Path]:
    """Give an empty folder of this process alone, which goes when the block ends.

    Parameters
    ----------
    parent
        Where it is made, under a hidden name; the system's folder for temporary files if not
        given.
    """
    with _owned(parent, partial(os.mkdir, mode=0o700), "") as path:
        yield path


@contextmanager
def temporary_file(parent: Path, ending: str) -> Iterator[Path]:
    """Give an empty file of this process alone; what is left of it goes when the block ends.

    Parameters
    ----------
    ending
        Of its name, by which some programs know what to write.
    """
    with _owned(parent, partial(os.open, flags=NEW, mode=0o600), ending) as path:
        yield path


@cache
def swept(folder: Path) -> None:
    """Sweep a folder, once in a process: large batches write into the same one often."""
    sweep(folder)


def sweep(folder: Path | None = None) -> None:
    """Remove the temporary files in a folder (the system's if not given) whose owner has ended."""
    with suppress(OSError), os.scandir(folder or tempfile.gettempdir()) as entries:
        for entry in entries:
            name = NAME.match(entry.name)
            if name:
                with suppress(OSError):
                    _remove_if_left(Path(entry.path), here=name["host"] == _host())


@contextmanager
def _owned(parent: Path | None, make: Callable[[Path], object], ending: str) -> Iterator[Path]:
    while True:
        path = _new_name(parent, ending)
        with undone_if_stopped(partial(_remove, path)):
            made = make(path)
            descriptor = made if isinstance(made, int) else None
            try:
                if descriptor is None:
                    try:
                        descriptor = os.open(path, os.O_RDONLY)
                    except FileNotFoundError:
                        continue  # swept before it was opened
                locked(descriptor, wait=True)
                if not is_at(path, descriptor):
                    continue  # swept before it was locked
                yield path
                return
            finally:
                _remove(path)
                if descriptor is not None:
                    os.close(descriptor)


def _new_name(parent: Path | None, ending: str) -> Path:
    name = f"planner-{_host()}-{os.urandom(6).hex()}{ending[-LONGEST:]}"
    return Path(tempfile.gettempdir(), name) if parent is None else parent / f".{name}"


def _remove_if_left(path: Path, *, here: bool) -> None:
    found = path.lstat()
    if hasattr(os, "getuid") and found.st_uid != os.getuid():
        return
    # Locks may not reach from one computer to another.
    if not here and time.time() - found.st_mtime < FOREIGN_S:
        return
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
    try:
        if locked(descriptor) and is_at(path, descriptor):
            _remove(path)
    finally:
        os.close(descriptor)


def is_at(path: Path, descriptor: int) -> bool:
    """Return whether a path still leads to what is open."""
    with suppress(OSError):
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    return False


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


@cache
def _host() -> str:
    return f"{zlib.crc32(socket.gethostname().encode()):08x}"


def _sweep_at_stop() -> None:
    """Remove what processes of our own leave that are killed with this one."""
    if tempfile.tempdir is not None:  # else it was never asked for, and to ask takes a lock
        sweep(Path(tempfile.tempdir))


at_stop(_sweep_at_stop)
