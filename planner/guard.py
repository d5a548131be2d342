"""The one door for files that others wrote: read whole, within limits, and reading nothing else.

Every TOML, JSON and XML file is opened here; so are those that SUMO's programs read after us. A
file may not name entities, files outside its folder, or more than memory should hold.
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
from xml.parsers import expat

from planner.errors import InputError

# Bytes of a file at most, unpacked.
LARGEST_TOML = 16 << 20
LARGEST_JSON = 1 << 30
LARGEST_XML = 4 << 30
# A file unpacks to at most so many times its own size, once it is larger than a small one.
MOST_PACKED, SMALL = 200, 100 << 20
DEEPEST = 100  # tables in tables
BLOCK = 1 << 20
AS_WRITTEN = "give the file as its program wrote it"
LARGEST_NUMBER = 2**63  # what TOML promises to hold
# SUMO's files are written so, and every parser on their way agrees on what they hold.
ENCODINGS = re.compile(r"utf-?8|utf-?16(le|be)?|us-ascii|ascii|iso-8859-\d+|windows-125\d", re.I)
# The parser of TOML takes the square of a key's parts: these are refused before it begins.
LONG_KEY = re.compile(r"""((?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){100}""")
DECLARED = re.compile(rb"""\A<\?xml[^>]*?encoding\s*=\s*["']([^"'>]*)["']""")


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
def opened_xml(path: Path, largest: int = LARGEST_XML) -> Iterator[IO[bytes]]:
    """Give an XML file for reading, unpacked if it is gzipped, once its beginning is seen sound.

    Raises
    ------
    InputError
        If it is missing, is no XML, has a document type or an encoding that SUMO does not write,
        or (while it is read) unpacks to more than ``largest`` bytes.
    """
    with unpacked(path, largest) as file:
        root_of(path, file.peek(BLOCK))  # only before the root may a document type stand
        yield file


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


class _Root(Exception):
    """The root element was reached."""


def root_of(path: Path, beginning: bytes) -> str:
    """Return the name of the root element of an XML file, of which the beginning is given.

    Raises
    ------
    InputError
        If it has a document type, an encoding that SUMO does not write, or is no XML.
    """
    found: list[str] = []

    def root(name: str, _: Any) -> None:
        found.append(name)
        raise _Root

    def document_type(*_: Any) -> None:
        raise InputError(
            f"{path}: declares a document type (<!DOCTYPE>), by which files may read others; "
            "take that out"
        )

    declared = DECLARED.match(beginning)
    encoding = declared[1].decode("ascii", "replace") if declared else "utf-8"
    if not ENCODINGS.fullmatch(encoding):
        raise InputError(f"{path}: its encoding is {encoding}; save it as UTF-8")
    parser = expat.ParserCreate()
    parser.StartElementHandler = root
    parser.StartDoctypeDeclHandler = document_type
    try:
        parser.Parse(beginning, False)
    except _Root:
        return found[0]
    except InputError:
        raise
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise InputError(
            f"{path}: is not XML ({error}); give the file as its program wrote it"
        ) from error
    if beginning.strip():
        raise InputError(f"{path}: is not XML (no element); {AS_WRITTEN}")
    return ""


def kind_of_xml(path: Path) -> str | None:
    """Return the root element of an XML file, "" if it has none that is sound; None: other files.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    with opened(path) as file:
        packed = file.read(2) == b"\x1f\x8b"
    try:
        with opened_xml(path) if packed else opened(path) as file:
            beginning = file.read(BLOCK)
        looks_so = beginning.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"<")
        return root_of(path, beginning) if looks_so else None
    except InputError:
        return ""


def xml_elements(path: Path, largest: int = LARGEST_XML) -> Iterator[Any]:
    """Yield the elements of an XML file as they end, as `xml.etree.ElementTree` makes them.

    Raises
    ------
    InputError
        As `opened_xml`, or if it is not well-formed.
    """
    from xml.etree import ElementTree

    with opened_xml(path, largest) as file:
        parser: Any = ElementTree.XMLPullParser()
        try:
            # In large blocks, as a comment is read anew from its beginning with each.
            while block := file.read(BLOCK):
                parser.feed(block)
                yield from (element for _, element in parser.read_events())
            parser.close()
            yield from (element for _, element in parser.read_events())
        except (ElementTree.ParseError, LookupError, UnicodeError) as error:
            raise InputError(
                f"{path}: is not XML ({error}); give the file as its program wrote it"
            ) from error


def elements_in(path: Path, suspects: re.Pattern[bytes]) -> list[tuple[str, dict[str, str]]]:
    """Return the elements of a file that others will parse, if their tags match a pattern.

    The bytes are searched first, which costs next to nothing; the file is parsed only where they
    hold what looks like such a tag.

    Parameters
    ----------
    suspects
        Of a tag's name with the ``<`` before it.

    Raises
    ------
    InputError
        As `opened_xml`, or if it is suspected and not well-formed.
    """
    found: list[tuple[str, dict[str, str]]] = []

    def start(name: str, attributes: dict[str, str]) -> None:
        if suspects.match(f"<{name} ".encode()):
            found.append((name, attributes))

    if holds(path, suspects):
        parser = expat.ParserCreate()
        parser.StartElementHandler = start
        _parse(path, parser)
    return found


def holds(path: Path, suspects: re.Pattern[bytes]) -> bool:
    """Return whether the bytes of an XML file match a pattern, or may do so when they are read.

    Parameters
    ----------
    suspects
        Matches no more than 64 bytes.

    Raises
    ------
    InputError
        As `opened_xml`.
    """
    with opened_xml(path) as file:
        return _suspected(file, suspects)


Change = Callable[[str, dict[str, str]], dict[str, str] | None]


def rewritten_xml(path: Path, into: IO[bytes], change: Change) -> None:
    """Write an XML file anew, its elements changed; comments are left out.

    Parameters
    ----------
    change
        Returns what the attributes of an element become; None takes it out, with all within it.

    Raises
    ------
    InputError
        As `opened_xml`, or if it is not well-formed.
    """
    from xml.sax.saxutils import XMLGenerator

    # Characters beyond ASCII by their numbers: read alike in every locale.
    writer = XMLGenerator(into, "ascii", short_empty_elements=True)
    left_out: list[str] = []  # the elements around, from one on that is taken out

    def start(name: str, attributes: dict[str, str]) -> None:
        changed = None if left_out else change(name, attributes)
        if changed is None:
            left_out.append(name)
        else:
            writer.startElement(name, changed)  # type: ignore[arg-type]

    def end(name: str) -> None:
        if left_out:
            left_out.pop()
        else:
            writer.endElement(name)

    def text(content: str) -> None:
        if not left_out:
            writer.characters(content)

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = text
    writer.startDocument()
    _parse(path, parser)
    writer.endDocument()


def _suspected(file: IO[bytes], suspects: re.Pattern[bytes]) -> bool:
    tail = b""
    while block := file.read(BLOCK):
        # Bytes of other encodings than ASCII's heirs are left to the parser.
        if (not tail and block[:2] in (b"\xff\xfe", b"\xfe\xff")) or b"\0" in block[:4]:
            return True
        content = tail + block
        if suspects.search(content):
            return True
        tail = content[-64:]
    return False


def _parse(path: Path, parser: expat.XMLParserType) -> None:
    """Parse a file with what was made for it.

    Raises
    ------
    InputError
        As `opened_xml`, or if it is not well-formed.
    """
    with opened_xml(path) as file:
        try:
            while block := file.read(BLOCK):  # as in `xml_elements`
                parser.Parse(block, False)
            parser.Parse(b"", True)
        except (expat.ExpatError, ValueError, LookupError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(
                f"{path}: is not XML ({error}); give the file as its program wrote it"
            ) from error
