"""Ctrl-C ends the program at once, whatever it is doing, and undoes what is half-done.

A KeyboardInterrupt is not enough: compiled code hears of it only when it returns, and some
libraries swallow it while they are imported.
"""

import contextlib
import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)
FAREWELL = "planner: stopped; nothing is half-written\n"
TERMINAL = "\r\x1b[2K\x1b[?25h"  # clears a progress bar's line and shows the cursor again
PATIENCE_S = 10.0

_undo: list[Callable[[], object]] = []


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
    """Keep the main thread from going on while the other one ends the process."""
    time.sleep(PATIENCE_S)
    raise KeyboardInterrupt


def _listen(hearing: socket.socket) -> None:
    with hearing:
        while told := hearing.recv(1):
            if told[0] in SIGNALS:
                _end(told[0])


def _end(number: int) -> None:
    for undo in reversed(_undo):
        with contextlib.suppress(Exception):
            undo()
    # Not by way of sys.stderr, in the midst of which the main thread may hold still.
    with contextlib.suppress(OSError):
        os.write(2, ((TERMINAL if os.isatty(2) else "") + FAREWELL).encode())
    os._exit(128 + number)
