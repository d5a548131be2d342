"""Progress on a terminal as a bar, elsewhere as a line every half minute."""

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from planner.clock import rough
from planner.messages import plain
from planner.progress import Progress

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

log = logging.getLogger(__name__)

EVERY_S = 30.0  # between two lines where there is no terminal; what is done by then is silent
QUARTERS = 4  # lines of --verbose


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """Give a callback that shows how far the work has come; nothing shows before its first call.

    The bar and the lines go to stderr. NO_COLOR is respected.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield progress_lines(title)
        return
    from rich.markup import escape

    with ExitStack() as stack:
        bars: list[Bar] = []

        def update(done: int, total: int, note: str = "", /) -> None:
            if not bars:
                bars.append(stack.enter_context(_bar()))
                bars[0].add_task(escape(plain(title)), total=total)
            text = escape(plain(f"{title}: {note}" if note else title))
            bars[0].update(bars[0].task_ids[0], completed=done, total=total, description=text)

        yield update


def _bar() -> "Bar":
    from rich import progress as rich
    from rich.console import Console

    return rich.Progress(
        rich.TextColumn("{task.description}"),
        rich.BarColumn(),
        rich.MofNCompleteColumn(),
        rich.TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )


def progress_lines(title: str) -> Progress:
    """Return a callback that writes a line every half minute, with how long the rest will take."""
    begun_s = said_s = time.monotonic()
    last = -1

    def update(done: int, total: int, note: str = "", /) -> None:
        nonlocal last, said_s
        now_s, quarter = time.monotonic(), QUARTERS * done // max(total, 1)
        is_due = now_s - said_s >= EVERY_S and done < total
        if is_due or quarter > last:
            last = max(last, quarter)
            words = f"{title}: {done:,} of {total:,}"
            if is_due and done:
                words += f", about {rough((now_s - begun_s) * (total - done) / done)} left"
            log.log(logging.WARNING if is_due else logging.INFO, words + (note and f"; {note}"))
        if is_due:
            said_s = now_s

    return update
