"""Files changed at random, the way files go wrong: by hand, in transfer, or on purpose."""

import io
import json
import random
import re
from collections.abc import Callable
from typing import Any

import pyarrow
import pyarrow.parquet

Change = Callable[[random.Random, bytes], bytes]

NUMBERS = (
    *("0", "-0.0", "-1", "1", "0.5", "1e-320", "1e-7", "1e5", "1e9", "1e100", "1e308", "1e400"),
    *("-1e300", "NaN", "nan", "inf", "-inf", "Infinity", "true", "2147483648", "9" * 19, "1_000"),
    *("9" * 5000, "1:30:00", "0x10", "1e", "--1", "٣", "1,5", ""),
)
WORDS = (
    *(
        "",
        " ",
        "x",
        "AB",
        "null",
        "false",
        "../../etc/passwd",
        "/dev/zero",
        "a,b",
        "a b",
        "${HOME}",
    ),
    *("$x^2$", "%s", "\x00", "\x1b[31m", "\r\n", "\ufeff", "\u202e", "é", "日本", "😀", "a" * 3000),
    *('"', "'", "<", "&", "]]>", "{}", "[]", "#", "!AB", ":0", "12345"),
)
NESTED = ("[" * 2000, "{" * 2000, "[" * 50 + "]" * 50, '{"a":' * 3000, "<a>" * 3000, "a.b." * 900)
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 0.5, -0.0, 1e300, 1e-300, 2**31, 2**63, "", "x", "é"),
    *(float("nan"), float("inf"), "false", "1.0", "\x1b[2J", "a" * 3000),
)
NUMBER = re.compile(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?")
ATTRIBUTE = re.compile(rb'"[^"]*"')
ENCODINGS = ("utf-16", "utf-8-sig", "latin-1", "cp1252", "utf-32", "shift_jis")


def changed(rng: random.Random, name: str, content: bytes) -> bytes:
    """Return the content of a file with one to three things changed."""
    own: list[Change] = []
    if name.endswith(".parquet"):
        own = [table] * 8
    elif name.endswith(".json"):
        own = [json_value] * 6
    elif name.endswith((".xml", ".toml", ".csv", ".gpx")):
        own = [attribute, number, line] * 3
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        change = rng.choice([*own, *ANY])
        content = change(rng, content)[:4_000_000]
    return content


def _place(rng: random.Random, content: bytes) -> slice:
    begin = rng.randrange(len(content) + 1)
    return slice(begin, min(len(content), begin + rng.choice((1, 2, 8, 40, 300))))


def flip(rng: random.Random, content: bytes) -> bytes:
    """Return it with some bits flipped."""
    new = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 20)) if new else 0):
        new[rng.randrange(len(new))] ^= 1 << rng.randrange(8)
    return bytes(new)


def cut(rng: random.Random, content: bytes) -> bytes:
    """Return its beginning or its end."""
    at = rng.randrange(len(content) + 1)
    return content[:at] if rng.random() < 0.8 else content[at:]


def drop(rng: random.Random, content: bytes) -> bytes:
    """Return it without a part."""
    place = _place(rng, content)
    return content[: place.start] + content[place.stop :]


def repeat(rng: random.Random, content: bytes) -> bytes:
    """Return it with a part again, perhaps often."""
    place = _place(rng, content)
    return (
        content[: place.stop] + content[place] * rng.choice((1, 1, 3, 500)) + content[place.stop :]
    )


def swap(rng: random.Random, content: bytes) -> bytes:
    """Return it with a part moved elsewhere."""
    place = _place(rng, content)
    rest = content[: place.start] + content[place.stop :]
    at = rng.randrange(len(rest) + 1)
    return rest[:at] + content[place] + rest[at:]


def insert(rng: random.Random, content: bytes) -> bytes:
    """Return it with a strange word somewhere."""
    at = rng.randrange(len(content) + 1)
    return content[:at] + _word(rng) + content[at:]


def number(rng: random.Random, content: bytes) -> bytes:
    """Return it with another number in a number's place."""
    return _put(rng, content, NUMBER, rng.choice(NUMBERS).encode())


def attribute(rng: random.Random, content: bytes) -> bytes:
    """Return it with another text between quotation marks."""
    word = rng.choice((*NUMBERS, *WORDS)).encode("utf-8", "surrogatepass")
    return _put(rng, content, ATTRIBUTE, b'"' + word + b'"')


def line(rng: random.Random, content: bytes) -> bytes:
    """Return it with a line left out, twice, elsewhere, or with another value."""
    lines = content.splitlines(keepends=True)
    if not lines:
        return content
    i, kind = rng.randrange(len(lines)), rng.randrange(4)
    if kind == 0:
        del lines[i]
    elif kind == 1:
        lines.insert(rng.randrange(len(lines)), lines[i])
    elif kind == 2:
        lines.insert(rng.randrange(len(lines)), lines.pop(i))
    else:
        lines[i] = lines[i].partition(b"=")[0] + b"= " + _word(rng) + b"\n"
    return b"".join(lines)


def encoded(rng: random.Random, content: bytes) -> bytes:
    """Return it in another encoding, or with other ends of lines."""
    if rng.random() < 0.3:
        return content.replace(b"\n", rng.choice((b"\r\n", b"\r", b"\x0b")))
    return content.decode("utf-8", "replace").encode(rng.choice(ENCODINGS), "replace")


def empty(rng: random.Random, content: bytes) -> bytes:  # noqa: ARG001
    """Return next to nothing."""
    return rng.choice((b"", b"\n", b"\x00" * 100, b"{}", b"[]", b"null", b"<a/>", b"PAR1", b"\xff"))


def json_value(rng: random.Random, content: bytes) -> bytes:
    """Return JSON with another value somewhere, or a key less."""
    try:
        found = json.loads(content)
    except (ValueError, RecursionError):
        return number(rng, content)
    at, place = found, None
    while isinstance(at, dict | list) and at and (place is None or rng.random() < 0.85):
        key: Any = rng.choice(list(at)) if isinstance(at, dict) else rng.randrange(len(at))
        place, at = (at, key), at[key]
    if place is None:
        return content
    holder, key = place
    if rng.random() < 0.15:
        del holder[key]
    else:
        holder[key] = rng.choice((*VALUES, [], {}, [[]], [1], {"a": 1}, at))
    return json.dumps(found, indent=rng.choice((None, 1))).encode()


def table(rng: random.Random, content: bytes) -> bytes:
    """Return a Parquet file with a column of another type, name, order or content."""
    try:
        found = pyarrow.parquet.read_table(io.BytesIO(content))
        sink = io.BytesIO()
        pyarrow.parquet.write_table(_changed_table(rng, found), sink)
        return sink.getvalue()
    except (pyarrow.ArrowException, OSError, ValueError, TypeError, OverflowError):
        return flip(rng, content)


def _changed_table(rng: random.Random, found: Any) -> Any:
    names, kind = found.column_names, rng.randrange(8)
    i = rng.randrange(len(names))
    column, rows = found.column(i), found.num_rows
    if kind == 0:
        return found.remove_column(i)
    if kind == 1:
        return found.append_column(rng.choice(names), column)
    if kind == 2:
        return found.rename_columns([rng.choice((n, n, n, "x", n.upper())) for n in names])
    if kind == 3:
        return found.take(pyarrow.array([rng.randrange(rows) for _ in range(rows)], "int64"))
    if kind == 4:
        return found.slice(0, rng.randrange(rows + 1)).replace_schema_metadata(
            {"net_sha256": "0", "schema": "x"} if rng.random() < 0.5 else None
        )
    if kind == 5:
        kinds = ("string", "float32", "float64", "int8", "int64", "uint64", "bool_", "large_string")
        return found.set_column(i, names[i], column.cast(getattr(pyarrow, rng.choice(kinds))()))
    values = column.to_pylist()
    for _ in range(rng.choice((1, 1, 5))):
        values[rng.randrange(rows)] = rng.choice(
            (
                None,
                float("nan"),
                float("inf"),
                -1,
                0,
                1e300,
                1e-300,
                0.5,
                2**31,
                2**62,
                "x",
                "",
                "é",
            )
        )
    kept = column.type if rng.random() < 0.7 else None
    return found.set_column(i, names[i], pyarrow.array(values, kept))


def _word(rng: random.Random) -> bytes:
    return rng.choice((*WORDS, *NUMBERS, *NESTED)).encode("utf-8", "surrogatepass")


def _put(rng: random.Random, content: bytes, pattern: re.Pattern[bytes], word: bytes) -> bytes:
    found = list(pattern.finditer(content))
    if not found:
        return insert(rng, content)
    place = rng.choice(found)
    return content[: place.start()] + word + content[place.end() :]


ANY: tuple[Change, ...] = (flip, cut, drop, repeat, swap, insert, encoded, empty, number)
