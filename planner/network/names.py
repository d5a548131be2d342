"""Names of nodes and edges that SUMO refuses, all of them at once."""

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from planner.errors import InputError
from planner.messages import as_written
from planner.xml_guard import xml_elements

UNUSABLE = re.compile(r"[ \t\n\r|\\;,']")
MOST = 20  # names in a message


def refuse_unusable_names(files: Sequence[Path]) -> None:
    """Raise InputError if nodes or edges of plain XML have names that SUMO does not take.

    netconvert names the first one alone.
    """
    found: dict[Path, list[str]] = {}
    for path in files:
        with suppress(InputError):  # what is no XML has been refused for that
            found[path] = [*_unusable(path)]
    told = [f"{path}: {_listed(names)}" for path, names in found.items() if names]
    if told:
        raise InputError(
            f"{', '.join(told)}: SUMO takes no name with a space or any of | \\ ; , '; rename them"
        )


def _unusable(path: Path) -> Iterator[str]:
    for element in xml_elements(path):
        name = element.get("id", "")
        if element.tag in ("node", "edge") and UNUSABLE.search(name):
            yield f"{element.tag} {as_written(name)}"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    return f"{', '.join(names[:MOST])}{more}"
