"""Progress on long work: a bar on a terminal, plain log lines elsewhere."""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

log = logging.getLogger(__name__)

QUARTERS = 4  # log lines without a terminal


class Told(Protocol):
    """Hears how much is done, how much there is, and what else is worth knowing."""

    def __call__(self, done: int, total: int, note: str = "") -> None:
        """Show it."""


@contextmanager
def progress(what: str) -> Iterator[Told]:
    """Give a function that shows how far the work has come; nothing shows if it is never called.

    The bar and the lines go to stderr. NO_COLOR is respected.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield _lines(what)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Remaining())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: list[TaskID] = []

        def told(done: int, total: int, note: str = "") -> None:
            if not tasks:
                tasks.append(bar.add_task(what, total=total))
            text = f"{what}: {note}" if note else what
            bar.update(tasks[0], completed=done, total=total, description=text)

        yield told


def _lines(what: str) -> Told:
    last = [-1]

    def told(done: int, total: int, note: str = "") -> None:
        quarter = QUARTERS * done // max(total, 1)
        if quarter > last[0]:
            last[0] = quarter
            log.info("%s: %d of %d%s", what, done, total, note and f", {note}")

    return told
