"""Sections of which there may be several: one table ``[key]``, or a list of tables ``[[key]]``."""

from collections.abc import Iterable, Iterator
from typing import Any

from planner.errors import Fault


def listed(section: str, said: Any) -> list[tuple[str, Any]]:
    """Return each table of a section by its key: ``uav`` if there is one, else ``uav[0]`` and on.

    A list of one is that one; what is neither a table nor a list is one, and for others to refuse.
    """
    if not isinstance(said, list):
        return [(section, said)]
    if len(said) == 1:
        return [(section, said[0])]
    return [(f"{section}[{number}]", table) for number, table in enumerate(said)]


def keys_of(section: str, many: int) -> list[str]:
    """Return the keys of so many tables of a section, as `listed` has them."""
    return [key for key, _ in listed(section, [None] * many)]


def named_for(key: str, faults: Iterable[Fault]) -> Iterator[Fault]:
    """Yield faults of one table with its own key, wherever they name the section."""
    section = key.partition("[")[0]
    return (fault.renamed(section, key) for fault in faults)
