"""Progress on a terminal as a bar, elsewhere as plain log lines."""

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from planner.messages import plain
from planner.progress import Progress

log = logging.getLogger(__name__)

QUARTERS = 4  # log lines without a terminal
LONG_S, SOON_S = 30.0, 3.0  # work that takes longer is announced, after so many seconds of it


@contextmanager
def progress_bar(title: str, shorter: str = "") -> Iterator[Progress]:
    """Give a callback that shows how far the work has come; nothing shows before its first call.

    The bar and the lines go to stderr. NO_COLOR is respected.

    Parameters
    ----------
    shorter
        What makes the work shorter: said where there is no bar to see how long it will take.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield _log_quarters(title, shorter)
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


def _log_quarters(title: str, shorter: str) -> Progress:
    last, said, begun_s = -1, False, time.monotonic()

    def update(done: int, total: int, note: str = "", /) -> None:
        nonlocal last, said
        lasts_s = time.monotonic() - begun_s
        if shorter and not said and done and lasts_s > SOON_S and lasts_s * total / done > LONG_S:
            said = True
            log.warning(
                "%s: %d of %d after %.0f s, about %.1f min in all; %s",
                title,
                done,
                total,
                lasts_s,
                lasts_s * total / done / 60,
                shorter,
            )
        quarter = QUARTERS * done // max(total, 1)
        if quarter > last:
            last = quarter
            log.info("%s: %d of %d%s", title, done, total, note and f", {note}")

    return update
