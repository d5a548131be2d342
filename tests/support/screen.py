"""A screen that nobody looks at, for windows; tests are skipped where there is none to be had."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

XVFB = shutil.which("Xvfb")


@contextmanager
def screen() -> Iterator[str]:
    """Give the name of a screen, as DISPLAY has it."""
    if XVFB is None:
        pytest.skip("Xvfb is not installed: sudo apt-get install xvfb")
    reads, writes = os.pipe()
    options = ("-displayfd", str(writes), "-noreset", "-nolisten", "tcp", "-screen", "0")
    running = subprocess.Popen(
        [XVFB, *options, "1200x1000x24"], pass_fds=[writes], stderr=subprocess.DEVNULL
    )
    os.close(writes)
    try:
        with os.fdopen(reads) as told:
            yield f":{int(told.readline())}"
    finally:
        running.terminate()
        running.wait()
