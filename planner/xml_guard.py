"""The door for XML that others wrote: within limits, in encodings of SUMO's, without entities."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any
from xml.parsers import expat

from planner.errors import InputError
from planner.guard import AS_WRITTEN, BLOCK, opened, unpacked

LARGEST_XML = 4 << 30  # bytes of a file at most, unpacked
# SUMO's files are written so, and every parser on their way agrees on what they hold.
ENCODINGS = re.compile(r"utf-?8|utf-?16(le|be)?|us-ascii|ascii|iso-8859-\d+|windows-125\d", re.I)
DECLARED = re.compile(rb"""\A<\?xml[^>]*?encoding\s*=\s*["']([^"'>]*)["']""")


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
        raise InputError(f"{path}: is not XML ({error}); {AS_WRITTEN}") from error
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
            raise InputError(f"{path}: is not XML ({error}); {AS_WRITTEN}") from error


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
            raise InputError(f"{path}: is not XML ({error}); {AS_WRITTEN}") from error
