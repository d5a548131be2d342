"""Work in a fork of this process, of which nothing comes back but what it answers."""

import os
import select
import signal
import sys
from collections.abc import Callable, Iterator
from typing import NoReturn

CAN_FORK = hasattr(os, "fork")
CHUNK = 1 << 20  # bytes read from a fork at once
ENDED = "the program that asked has ended"


def answer_of_fork(work: Callable[[], bytes]) -> tuple[bytes, int]:
    """Return what a fork has answered, and its exit code, negative for a signal.

    Raises
    ------
    EOFError
        If the program that has started this process has ended meanwhile.
    """
    readable, writable = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(readable)
        _answer_and_end(work, writable)
    os.close(writable)
    try:
        parts = list(_read_all(readable))
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        os.close(readable)
        status = os.waitpid(child, 0)[1]
    return b"".join(parts), os.waitstatus_to_exitcode(status)


def refuse_to_outlive() -> None:
    """Go on only while the program that has started this process is there.

    Raises
    ------
    EOFError
        If it has ended.
    """
    waiting = select.poll()
    waiting.register(sys.stdin.fileno(), 0)  # says only when the other end is closed
    if waiting.poll(0):
        raise EOFError(ENDED)


def told_end(code: int) -> str:
    """Return in words how a process has ended."""
    return f"was killed by signal {-code}" if code < 0 else f"ended with code {code}"


def _answer_and_end(work: Callable[[], bytes], writable: int) -> NoReturn:
    """Answer, and end without what ends a program."""
    code = 1
    try:
        left = memoryview(work())
        while left:
            left = left[os.write(writable, left) :]
        code = 0
    finally:
        os._exit(code)


def _read_all(readable: int) -> Iterator[bytes]:
    """Yield what comes from a fork; end with the program that waits for it."""
    waiting = select.poll()
    waiting.register(readable, select.POLLIN)
    waiting.register(sys.stdin.fileno(), 0)  # says only when the other end is closed
    while True:
        ready = dict(waiting.poll())
        if readable in ready:
            part = os.read(readable, CHUNK)
            if not part:
                return
            yield part
        elif ready:
            raise EOFError(ENDED)
