"""Parts of error messages: a value as it was written, and the known name that was meant."""

import difflib
import json
from collections.abc import Iterable
from typing import Any

LONGEST = 60  # characters of a value that a message shows


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
