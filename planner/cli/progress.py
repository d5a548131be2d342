"""Progress on a terminal as a bar, elsewhere as plain log lines."""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from planner.messages import plain
from planner.progress import Progress

log = logging.getLogger(__name__)

QUARTERS = 4  # log lines without a terminal


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """Give a callback that shows how far the work has come; nothing shows before its first call.

    The bar and the lines go to stderr. NO_COLOR is respected.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield _log_quarters(title)
        return
    from rich import progress as rich
    from rich.console import Console
    from rich.markup import escape

    columns = (
        rich.TextColumn("{task.description}"),
        rich.BarColumn(),
        rich.MofNCompleteColumn(),
        rich.TimeRemainingColumn(),
    )
    with rich.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: list[rich.TaskID] = []

        def update(done: int, total: int, note: str = "", /) -> None:
            if not tasks:
                tasks.append(bar.add_task(escape(plain(title)), total=total))
            text = escape(plain(f"{title}: {note}" if note else title))
            bar.update(tasks[0], completed=done, total=total, description=text)

        yield update


def _log_quarters(title: str) -> Progress:
    last = -1

    def update(done: int, total: int, note: str = "", /) -> None:
        nonlocal last
        quarter = QUARTERS * done // max(total, 1)
        if quarter > last:
            last = quarter
            log.info("%s: %d of %d%s", title, done, total, note and f", {note}")

    return update
