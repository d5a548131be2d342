"""Results on standard output: tables and sentences for people, JSON for programs.

It loads none of the stages, so that `planner doctor` can print where their libraries are broken.
"""

import argparse
import json
import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.console import Console

PLAIN_WIDTH = 120  # characters, where there is no terminal to ask


def console(file: TextIO | None = None) -> "Console":
    """Return where tables are printed: coloured on a terminal unless NO_COLOR is set.

    Parameters
    ----------
    file
        Standard output if not given.
    """
    from rich.console import Console

    verbatim: dict[str, Any] = {
        "highlight": False,
        "markup": False,
        "emoji": False,
    }  # names may hold [brackets]
    found = Console(file=file, **verbatim)
    if found.is_terminal or "COLUMNS" in os.environ:
        return found
    return Console(file=file, width=PLAIN_WIDTH, **verbatim)


def print_result(
    arguments: argparse.Namespace, summary: Mapping[str, Any], blocks: Iterable[Any]
) -> None:
    """Print the result of a command: with --json its summary, else tables and sentences."""
    if arguments.json:
        print_json(summary)
        return
    out = console()
    for block in blocks:
        out.print(block)


def print_json(content: Any) -> None:
    """Print plain data as JSON on stdout."""
    print(json.dumps(content, indent=1, allow_nan=False))


def summary_lines(summary: Mapping[str, Any]) -> list[str]:
    """Return a line for each entry, with the values aligned."""
    width = max(map(len, summary))
    return [f"{key:{width}}  {value}" for key, value in summary.items()]
