"""Results on standard output: tables and sentences for people, JSON for programs.

It loads none of the stages, so that `planner doctor` can print where their libraries are broken.
"""

import argparse
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, TextIO

from planner.messages import UNPARTED, plain, unparted

if TYPE_CHECKING:
    from rich.console import Console

SHORT = 10  # characters of a number that inexact sums have missed, where it is as short as that
PLAIN_WIDTH = 120  # characters, where there is no terminal to ask


def console(file: TextIO | None = None) -> "Console":
    """Return where tables are printed: coloured on a terminal unless NO_COLOR is set.

    Parameters
    ----------
    file
        Standard output if not given.
    """
    from rich.console import Console
    from rich.segment import Segment

    class Plain(Console):
        """Writes other people's words without what a terminal obeys."""

        def on_broken_pipe(self) -> None:
            raise  # within rich's handling of it; the command line ends quietly

        def render(self, *what: Any, **how: Any) -> Iterator[Segment]:
            for text, style, control in super().render(*what, **how):
                shown = text if control else "\n".join(map(plain, text.split("\n")))
                shown = shown.replace(UNPARTED, " ")
                yield Segment(shown, style, control)

    # Names may hold [brackets].
    verbatim: dict[str, Any] = {"highlight": False, "markup": False, "emoji": False}
    found = Plain(file=file, **verbatim)
    if found.is_terminal or "COLUMNS" in os.environ:
        return found
    return Plain(file=file, width=PLAIN_WIDTH, **verbatim)


def print_result(
    arguments: argparse.Namespace, summary: Mapping[str, Any], blocks: Iterable[Any]
) -> None:
    """Print the result of a command: with --json its summary, else tables and sentences.

    In sentences a number stands on one line with its unit, and a path in one piece.
    """
    if arguments.json:
        print_json(_without_noise(summary))
        return
    out = console()
    for block in blocks:
        if isinstance(block, str):
            is_long = any(len(word) > out.width for word in block.split())  # left to the terminal
            out.print(unparted(block), soft_wrap=is_long)
        else:
            out.print(block)


def _without_noise(content: Any) -> Any:
    """Return plain data in which 419.9999999999999 is 420; other numbers keep all digits.

    They are those that files hold.
    """
    if isinstance(content, float):
        near = round(float(f"{content:.14g}"), 14)
        return near if len(repr(near)) <= SHORT else content
    if isinstance(content, Mapping):
        return {key: _without_noise(value) for key, value in content.items()}
    return [*map(_without_noise, content)] if isinstance(content, list | tuple) else content


def print_json(content: Any) -> None:
    """Print plain data as JSON on stdout."""
    # JSON may hold DEL as it is; all else that a terminal obeys is escaped anyway.
    print(json.dumps(content, indent=1, allow_nan=False).replace("\x7f", "\\u007f"))


def summary_lines(summary: Mapping[str, Any]) -> list[str]:
    """Return a line for each entry, with the values aligned."""
    width = max(map(len, summary))
    shown = {
        key: f"{value:.6g}" if isinstance(value, float) else value for key, value in summary.items()
    }
    return [f"{key:{width}}  {value}" for key, value in shown.items()]
