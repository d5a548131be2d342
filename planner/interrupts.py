"""Ctrl-C ends the program at once, whatever it is doing, and undoes what is half-done.

Where a search can give the best plan so far, the first Ctrl-C asks for it, and the second one ends
the program. A KeyboardInterrupt is not enough: compiled code hears of it only when it returns, and
some libraries swallow it while they are imported.
"""

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)
FAREWELL = "planner: stopped; nothing is half-written\n"
ASKED = "planner: taking the best plan so far; Ctrl-C again ends at once\n"
TERMINAL = "\r\x1b[2K\x1b[?25h"  # clears a progress bar's line and shows the cursor again
PATIENCE_S = 10.0

_undo: list[Callable[[], object]] = []
_asks: list[threading.Event] = []  # of searches that can be asked to come to an end
_forgiven = threading.Event()  # set when a signal has only asked


def at_stop(undo: Callable[[], object]) -> None:
    """Have something undone if the program is stopped; what came last is undone first."""
    _undo.append(undo)


@contextmanager
def undone_if_stopped(undo: Callable[[], object]) -> Iterator[None]:
    """Have something undone if the program is stopped within the block."""
    at_stop(undo)
    try:
        yield
    finally:
        _undo.remove(undo)


@contextmanager
def first_asks() -> Iterator[Callable[[], bool]]:
    """Within the block, the first Ctrl-C ends nothing; give a function that tells of it."""
    asked = threading.Event()
    _asks.append(asked)
    try:
        yield asked.is_set
    finally:
        _asks.remove(asked)


@contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Within the block, Ctrl-C and a polite kill end the process: one line, exit code 128 + n.

    Without effect outside of the main thread, which alone hears signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    hearing, telling = socket.socketpair()
    telling.setblocking(False)
    heard = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, _hold_still) for number in heard}
    told_before = signal.set_wakeup_fd(telling.fileno())
    threading.Thread(target=_listen, args=(hearing,), daemon=True).start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(told_before)
        for number, handler in before.items():
            signal.signal(number, handler)
        telling.close()


def _hold_still(_number: int, _frame: object) -> None:
    """Keep the main thread from going on while the other one ends the process, if it does."""
    if not _forgiven.wait(PATIENCE_S):
        raise KeyboardInterrupt
    _forgiven.clear()


def _listen(hearing: socket.socket) -> None:
    with hearing:
        while told := hearing.recv(1):
            asks = _asks[-1:]
            if told[0] == signal.SIGINT and asks and not asks[0].is_set():
                asks[0].set()
                _forgiven.set()
                _say(ASKED)
            elif told[0] in SIGNALS:
                _end(told[0])


def _end(number: int) -> None:
    _forgiven.clear()
    for undo in reversed(_undo):
        with contextlib.suppress(Exception):
            undo()
    _say(FAREWELL)
    os._exit(128 + number)


def _say(text: str) -> None:
    # Not by way of sys.stderr, in the midst of which the main thread may hold still.
    with contextlib.suppress(OSError):
        os.write(2, ((TERMINAL if os.isatty(2) else "") + text).encode())
