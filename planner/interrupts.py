"""Ctrl-C ends the program at once, whatever it is doing, and undoes what is half-done.

Where a search can return the best plan so far, the first Ctrl-C asks for that plan and the second
one ends the program. A KeyboardInterrupt is not enough: compiled code notices it only when it
returns, and some libraries swallow it while they are imported.
"""

import contextlib
import os
import select
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

HANGUP = (signal.SIGHUP,) if hasattr(signal, "SIGHUP") else ()  # a terminal that is closed
SIGNALS = (signal.SIGINT, signal.SIGTERM, *HANGUP)
FAREWELL = "planner: stopped; nothing is half-written\n"
ASKED = "planner: taking the best plan so far; Ctrl-C again ends at once\n"
TERMINAL = "\r\x1b[2K\x1b[?25h"  # clears a progress bar's line and shows the cursor again
PATIENCE_S = 10.0
STILL_S, AGAIN_S = 0.5, 0.05  # to wait for the main thread, before what is half-done is undone
DEAD_S = 0.3  # to wait for the processes that are killed
SAY_S = 0.2  # to wait for a terminal that takes nothing

_undo: list[Callable[[], object]] = []
_gently: list[Callable[[], object]] = []  # done before the processes that we started are killed
_requests: list[threading.Event] = []  # one per search that can be asked to finish
_signals: list[socket.socket] = []  # where the numbers of signals arrive, and stay until dealt with
_ends = threading.Event()  # set once the program is being stopped
_holds_still = threading.Event()  # set while the main thread waits for what comes of a signal


def at_stop(undo: Callable[[], object]) -> None:
    """Register what is to be undone if the program is stopped; the last one is undone first.

    It is called from another thread while the main one may hold any lock, that of imports too, so
    it must wait for none and import nothing, and it may be called twice.
    """
    _undo.append(undo)


def is_stopping() -> bool:
    """Return whether the program is being stopped, which kills the processes that it started."""
    return _ends.is_set()


@contextmanager
def undone_if_stopped(undo: Callable[[], object]) -> Iterator[None]:
    """Have something undone if the program is stopped within the block."""
    at_stop(undo)
    try:
        yield
    finally:
        _undo.remove(undo)


@contextmanager
def ended_gently(end: Callable[[], object]) -> Iterator[None]:
    """Have processes end by themselves if the program is stopped within the block.

    They have half-done things of their own, which they cannot undo once they are killed. As in
    `at_stop`, it must not wait for a lock that the main thread may hold.

    Parameters
    ----------
    end
        Asks them to, and waits until they have, for a while.
    """
    _gently.append(end)
    try:
        yield
    finally:
        _gently.remove(end)


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
    _signals.append(listener)
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
        _signals.remove(listener)
        wakeup.close()


def _hold_still(_number: int, _frame: object) -> None:
    """Keep the main thread from going on until every signal that has come is dealt with.

    Of two that come while compiled code runs, this is called once: when the second one ends the
    program, the main thread must not go on because the first one only asked.
    """
    _holds_still.set()
    patient_until = time.monotonic() + PATIENCE_S
    while _signals and select.select(_signals[-1:], [], [], 0.0)[0]:
        if time.monotonic() > patient_until:
            raise KeyboardInterrupt
        time.sleep(0.002)
    _holds_still.clear()


def _listen(listener: socket.socket) -> None:
    with listener:
        while received := listener.recv(1, socket.MSG_PEEK):
            _decide(received[0])
            listener.recv(1)  # only now, as the main thread may go on when none is left


def _decide(number: int) -> None:
    requests = _requests[-1:]
    if number == signal.SIGINT and requests and not requests[0].is_set():
        requests[0].set()
        _say(ASKED)
    elif number in SIGNALS:
        _end(number)


def _end(number: int) -> None:
    """Undo what is half-done while the main thread holds still, and end the process.

    Compiled code holds still only when it returns, but makes no files either.
    """
    _ends.set()
    if hasattr(signal, "pthread_kill"):
        # The system may have handed the signal to another thread, and has handled it once.
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    for wait_s in (STILL_S, AGAIN_S):
        still = _holds_still.wait(wait_s)
        for end in [*_gently]:
            with contextlib.suppress(Exception):
                end()
        _kill_descendants()
        for undo in reversed([*_undo]):
            with contextlib.suppress(Exception):
                undo()
        if still:
            break
    _say(FAREWELL)
    os._exit(128 + number)


def _kill_descendants() -> None:
    """End the processes that this one and they have started, where the system lists them."""
    found = _descendants(os.getpid())
    for process in found:
        with contextlib.suppress(OSError):
            os.kill(process, signal.SIGKILL)
    patient_until = time.monotonic() + DEAD_S
    while any(map(_runs, found)) and time.monotonic() < patient_until:
        time.sleep(0.005)


def _descendants(process: int) -> list[int]:
    found = []
    with contextlib.suppress(OSError):
        for thread in Path(f"/proc/{process}/task").iterdir():
            # As bytes: looking a codec up may import it, and the main thread may be at an import.
            children = (thread / "children").read_bytes()
            for child in map(int, children.split()):
                # What clears away after this process ends by itself.
                if b"resource_tracker" not in Path(f"/proc/{child}/cmdline").read_bytes():
                    found += [child, *_descendants(child)]
    return found


@contextmanager
def children_deaf() -> Iterator[None]:
    """Have processes that are started in the block not hear Ctrl-C before `hear_again`.

    It reaches all that a terminal runs, and would end them with a traceback while they start.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def hear_again() -> None:
    """Have a process that was started deaf hear Ctrl-C, as it has it handled by now."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def start_tracker(tracker: Any) -> None:
    """Start the process that clears semaphores away; without its warning if we are stopped.

    Parameters
    ----------
    tracker
        The module `multiprocessing.resource_tracker`, or a library's own one.
    """
    key = "PYTHONWARNINGS"
    before = os.environ.get(key)
    quiet = f"ignore::UserWarning:{tracker.__name__}"
    os.environ[key] = f"{before},{quiet}" if before else quiet
    try:
        tracker.ensure_running()
    finally:
        if before is None:
            del os.environ[key]
        else:
            os.environ[key] = before


def _runs(process: int) -> bool:
    """Return whether a process has not ended yet; one that has ended has no command any more."""
    with contextlib.suppress(OSError):
        return bool(Path(f"/proc/{process}/cmdline").read_bytes())
    return False


def _say(text: str) -> None:
    # Not by way of sys.stderr, in the midst of which the main thread may hold still.
    said = (TERMINAL if os.isatty(2) else "") + text
    writing = threading.Thread(target=_write, args=(said.encode(),), daemon=True)
    writing.start()
    writing.join(SAY_S)


def _write(text: bytes) -> None:
    with contextlib.suppress(OSError):
        os.write(2, text)
