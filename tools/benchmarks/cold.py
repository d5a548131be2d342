"""Caches with nothing in them, for what is measured cold."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from planner.cache import cache_folder

KEPT = ("nets", "compiled", "digests")


@contextmanager
def empty_cache() -> Iterator[None]:
    """Let everything but compiled code come from a cache with nothing in it."""
    before = os.environ.get("PLANNER_CACHE")
    with TemporaryDirectory() as folder:
        os.environ["PLANNER_CACHE"] = folder
        try:
            yield
        finally:
            del os.environ["PLANNER_CACHE"]
            if before is not None:
                os.environ["PLANNER_CACHE"] = before


def nothing_recorded(folder: Path) -> dict[str, str]:
    """Return an environment whose cache has the user's nets and compiled code alone."""
    cold = folder / f"cache-{time.monotonic_ns()}"
    cold.mkdir()
    for part in KEPT:
        (cold / part).symlink_to(cache_folder(part))
    return {**os.environ, "PLANNER_CACHE": str(cold)}
