"""The one door for files that others wrote: read whole, within limits, and reading nothing else.

Every file is opened here, TOML and JSON are read here, and XML by `planner.xml_guard`; so are the
files that SUMO's programs read after us. A file may not hold more than memory should.
"""

import gzip
import io
import json
import math
import os
import re
import stat
import tomllib
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import IO, Any

from planner.errors import InputError

# Bytes of a file at most, unpacked.
LARGEST_TOML = 16 << 20
LARGEST_JSON = 1 << 30
# A file unpacks to at most so many times its own size, once it is larger than a small one.
MOST_PACKED, SMALL = 200, 100 << 20
DEEPEST = 100  # tables in tables
BLOCK = 1 << 20
AS_WRITTEN = "give the file as its program wrote it"
LARGEST_NUMBER = 2**63  # what TOML promises to hold
# The parser of TOML takes the square of a key's parts: these are refused before it begins.
LONG_KEY = re.compile(r"""((?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){100}""")


def read_text(path: Path, largest: int = LARGEST_TOML) -> str:
    """Return the text of a UTF-8 file, unpacked if it is gzipped, without its byte order mark.

    Raises
    ------
    InputError
        If it cannot be read, is no UTF-8, or is larger than ``largest`` bytes.
    """
    with unpacked(path, largest) as file:
        content = file.read()
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: byte {error.start}: is not UTF-8 text; save the file as UTF-8"
        ) from error


def read_toml(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file.

    Raises
    ------
    InputError
        If it cannot be read, or is no TOML that `parsed_toml` takes.
    """
    try:
        return parsed_toml(read_text(path))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: is not TOML ({error}); correct it there") from error


def parsed_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises
    ------
    ValueError
        If it is no TOML, or holds a number or a depth that no file of ours needs.
    """
    if LONG_KEY.search(text):
        raise ValueError(f"a key has more than {DEEPEST} parts")
    return dict(_within_limits(tomllib.loads, text))


def read_json(path: Path) -> Any:
    """Return what a JSON file holds.

    Raises
    ------
    InputError
        If it cannot be read, or is no JSON that `parsed_json` takes.
    """
    try:
        return parsed_json(read_text(path, LARGEST_JSON))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: is not JSON ({error}); give a file as it was written") from error


def parsed_json(text: str) -> Any:
    """Return what a JSON text holds.

    Raises
    ------
    ValueError
        If it is no JSON, or holds a number or a depth that no file of ours has.
    """
    return _within_limits(partial(json.loads, parse_constant=_no_number), text)


def _no_number(name: str) -> Any:
    raise ValueError(f"{name} is no number of JSON")


def _within_limits(parse: Callable[[str], Any], text: str) -> Any:
    try:
        content = parse(text)
    except (RecursionError, MemoryError):
        raise ValueError(f"it nests deeper than {DEEPEST} levels") from None
    except ValueError as error:
        if "digits" in str(error):  # Python's own limit, in words about Python
            raise ValueError("it holds a number that is too large") from None
        raise
    _refuse_extremes(content, in_json=parse is not tomllib.loads)  # TOML has an infinity
    return content


def _refuse_extremes(content: Any, *, in_json: bool) -> None:
    level = [content]
    for _ in range(DEEPEST):
        if any(type(v) is int and not -LARGEST_NUMBER <= v < LARGEST_NUMBER for v in level):
            raise ValueError("it holds a number that is too large")
        if in_json and any(type(v) is float and not math.isfinite(v) for v in level):
            raise ValueError("it holds a number that is too large")
        tables = [v.values() for v in level if isinstance(v, dict)]
        lists = [v for v in level if isinstance(v, list)]
        level = [inner for outer in (*tables, *lists) for inner in outer]
        if not level:
            return
    raise ValueError(f"it nests deeper than {DEEPEST} levels")


@contextmanager
def opened(path: Path) -> Iterator[IO[bytes]]:
    """Give a file for reading; faults of the file become one line.

    Raises
    ------
    InputError
        If it is missing, no plain file, or cannot be read.
    """
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise InputError(f"{path}: is no plain file; give the path of one")
            yield file
    except InputError:
        raise
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror or error}); correct the path"
        ) from error
    except ValueError as error:
        if "\0" not in str(path):
            raise
        raise InputError(f"{path}: no file's name holds a NUL; correct the path") from error


def _without_waiting(name: str, flags: int) -> int:
    """Open a file; a pipe that nobody writes to does not hold us."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


@contextmanager
def unpacked(path: Path, largest: int) -> Iterator[io.BufferedReader]:
    """Give a file for reading, unpacked if it is gzipped.

    Raises
    ------
    InputError
        If it is missing, is no plain file, or (while it is read) its gzip is broken or it holds
        more than ``largest`` bytes.
    """
    with opened(path) as file:
        packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        if not packed and os.fstat(file.fileno()).st_size > largest:
            raise _too_large(path, largest)
        raw: IO[bytes] = gzip.GzipFile(fileobj=file) if packed else file  # type: ignore[assignment]
        limit = min(largest, max(SMALL, MOST_PACKED * os.fstat(file.fileno()).st_size))
        bounded: Any = io.BufferedReader(_Bounded(raw, path, limit if packed else largest), BLOCK)
        try:
            yield bounded
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise InputError(f"{path}: is no whole gzip file ({error}); copy it again") from error


class _Bounded(io.RawIOBase):
    """A stream that refuses to give more than its limit."""

    def __init__(self, raw: IO[bytes], path: Path, limit: int) -> None:
        super().__init__()
        self._raw, self._path, self._limit, self._given = raw, path, limit, 0

    def readable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read into a buffer and return how many bytes that were."""
        content = self._raw.read(len(buffer))
        buffer[: len(content)] = content
        self._given += len(content)
        if self._given > self._limit:
            raise _too_large(self._path, self._limit)
        return len(content)


def _too_large(path: Path, limit: int) -> InputError:
    return InputError(
        f"{path}: holds more than {limit / 1e6:,.0f} MB; give a smaller file, or a part of it"
    )
