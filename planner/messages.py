"""Parts of messages: a value as it was written, a share, the known name that was meant."""

import difflib
import json
import re
from collections.abc import Iterable
from typing import Any

LONGEST = 60  # characters of a value that a message shows
LONGEST_LINE = 1000  # characters of a message

# What a terminal obeys or cannot show: controls, marks that turn text round, halves of characters.
UNSEEN = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")

UNPARTED = "\ue000"  # for private use; rich parts lines at a no-break space
BEFORE_UNIT = re.compile(r"(?<=\d) (?=%|(?:m/s2?|k?m|m?s|min|h|degrees)\b)")


def plain(text: str) -> str:
    """Return a text without what a terminal obeys: each such character as it is escaped in code.

    Names, titles, keys and paths are other people's words; nothing of them goes to a terminal or
    into a picture but through here.
    """
    return UNSEEN.sub(lambda found: ascii(found[0])[1:-1], text)


def unparted(text: str) -> str:
    """Return a text in which numbers keep to their units, for ``planner.cli.printing.console``."""
    return BEFORE_UNIT.sub(UNPARTED, text)


def as_line(text: str) -> str:
    """Return a message as a terminal shows it: plain, and cut in its middle if it is very long."""
    line, half = plain(text), LONGEST_LINE // 2
    return line if len(line) <= LONGEST_LINE else f"{line[:half]} ... {line[-half:]}"


def as_written(value: Any) -> str:
    """Return a value as a message shows it: as the scenario file writes it, and not too long."""
    if isinstance(value, float):
        text = f"{value:.10g}"
    else:
        text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return the remedy for an unknown name: the nearest known one, or some that exist."""
    names = list(known)
    near = difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    if near:
        return f"did you mean {near[0]}?"
    if not names:
        return "leave it out"
    return f"known: {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}"


def counted(many: int, what: str, several: str = "") -> str:
    """Return a number of things in words, such as "1 process" or "2,000 processes"."""
    return f"{many:,} {what if many == 1 else several or f'{what}s'}"


def percent(share: float, digits: int = 1, *, sign: bool = False) -> str:
    """Return a share as people read it everywhere, such as "63.5 %".

    Parameters
    ----------
    digits
        Decimals.
    sign
        Whether a plus is written too.
    """
    return f"{100.0 * share:{'+' if sign else ''}z.{digits}f} %"
