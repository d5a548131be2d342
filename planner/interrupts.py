"""Ctrl-C ends the program at once, whatever it is doing, and undoes what is half-done.

Where a search can return the best plan so far, the first Ctrl-C asks for that plan and the second
one ends the program. A KeyboardInterrupt is not enough: compiled code notices it only when it
returns, and some libraries swallow it while they are imported.
"""

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

HANGUP = (signal.SIGHUP,) if hasattr(signal, "SIGHUP") else ()  # a terminal that is closed
SIGNALS = (signal.SIGINT, signal.SIGTERM, *HANGUP)
FAREWELL = "planner: stopped; nothing is half-written\n"
ASKED = "planner: taking the best plan so far; Ctrl-C again ends at once\n"
TERMINAL = "\r\x1b[2K\x1b[?25h"  # clears a progress bar's line and shows the cursor again
PATIENCE_S = 10.0

_undo: list[Callable[[], object]] = []
_requests: list[threading.Event] = []  # one per search that can be asked to finish
_only_asked = threading.Event()  # set when a signal has asked and the program goes on


def at_stop(undo: Callable[[], object]) -> None:
    """Register what is to be undone if the program is stopped; the last one is undone first."""
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
def first_interrupt_asks() -> Iterator[Callable[[], bool]]:
    """Let the first Ctrl-C within the block end nothing; give a function that says if it came."""
    request = threading.Event()
    _requests.append(request)
    try:
        yield request.is_set
    finally:
        _requests.remove(request)


@contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Within the block, Ctrl-C, SIGTERM and a closed terminal end the process: exit code 128 + n.

    Without effect outside of the main thread, the only one that receives signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    listener, wakeup = socket.socketpair()
    wakeup.setblocking(False)
    handled = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, _hold_still) for number in handled}
    wakeup_before = signal.set_wakeup_fd(wakeup.fileno())
    threading.Thread(target=_listen, args=(listener,), daemon=True).start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(wakeup_before)
        for number, handler in before.items():
            signal.signal(number, handler)
        wakeup.close()


def _hold_still(_number: int, _frame: object) -> None:
    """Keep the main thread from going on while the other one ends the process, if it does."""
    if not _only_asked.wait(PATIENCE_S):
        raise KeyboardInterrupt
    _only_asked.clear()


def _listen(listener: socket.socket) -> None:
    with listener:
        while received := listener.recv(1):
            number, requests = received[0], _requests[-1:]
            if number == signal.SIGINT and requests and not requests[0].is_set():
                requests[0].set()
                _only_asked.set()
                _say(ASKED)
            elif number in SIGNALS:
                _end(number)


def _end(number: int) -> None:
    _only_asked.clear()
    for undo in reversed(_undo):
        with contextlib.suppress(Exception):
            undo()
    _say(FAREWELL)
    os._exit(128 + number)


def _say(text: str) -> None:
    # Not by way of sys.stderr, in the midst of which the main thread may hold still.
    with contextlib.suppress(OSError):
        os.write(2, ((TERMINAL if os.isatty(2) else "") + text).encode())
