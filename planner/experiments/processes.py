"""Processes of joblib (loky) that run conditions; the run survives killed ones.

A killed process breaks its pool, and loky ends the others of it: the pool is made anew, and only
what was in flight is run again. loky's processes would outlive a killed parent; these hold a
pipe from it, which closes with it.
"""

import logging
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool  # loky's are of this kind
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for

from planner.experiments.condition import Condition
from planner.experiments.run_condition import Outcome
from planner.futures.workers import dismiss
from planner.interrupts import children_deaf, hear_again, start_tracker

log = logging.getLogger(__name__)

TRIES = 3  # of a condition whose process is killed each time, alone

RunCondition = Callable[[Condition], Outcome]
Done = tuple[Condition, Outcome]


def in_processes(
    run_one: RunCondition, conditions: Sequence[Condition], workers: int
) -> Iterator[Done]:
    """Yield conditions as they are done, with what came of them.

    If a process is killed, those in flight are run again, one at a time, so that one that
    kills its process (by memory, say) is found; the others go on after that.
    """
    waiting = list(conditions)
    while waiting:
        lost: list[Condition] = []
        yield from _round(run_one, waiting, workers, lost)
        yield from _one_at_a_time(run_one, lost)


def _round(
    run_one: RunCondition, waiting: list[Condition], workers: int, lost: list[Condition]
) -> Iterator[Done]:
    """Run from the front of a list, which shrinks, until it is empty or a process is killed."""
    flying: dict[Future[Outcome], Condition] = {}
    with _pool(min(workers, len(waiting))) as pool:
        try:
            while waiting or flying:
                while waiting and len(flying) <= workers:  # one more, so that none has to wait
                    with children_deaf():
                        flying[pool.submit(run_one, waiting[0])] = waiting[0]
                    del waiting[0]
                for done in wait(flying, return_when=FIRST_COMPLETED).done:
                    outcome = done.result()
                    yield flying.pop(done), outcome
        except BrokenProcessPool:
            log.warning("a process was killed; what it was at is run again")
            for future, condition in flying.items():
                if future.done() and future.exception() is None:
                    yield condition, future.result()
                else:
                    lost.append(condition)


def _one_at_a_time(run_one: RunCondition, waiting: list[Condition]) -> Iterator[Done]:
    tries = 0
    while waiting:
        with _pool(1) as pool:
            try:
                while waiting:
                    with children_deaf():
                        submitted = pool.submit(run_one, waiting[0])
                    outcome = submitted.result()
                    yield waiting.pop(0), retried(outcome, tries + 1)
                    tries = 0
            except BrokenProcessPool:
                tries += 1
                if tries == TRIES:
                    reason = (
                        f"the process that ran it was killed {TRIES + 1} times; is memory short?"
                    )
                    failed = Outcome({"reason": reason}, {}, final=False)
                    yield waiting.pop(0), retried(failed, tries)
                    tries = 0


def retried(outcome: Outcome, times: int) -> Outcome:
    """Return an outcome that records how often its process was killed before."""
    return replace(outcome, timing=outcome.timing | {"retries": times})


def start_trackers() -> None:
    """Start what clears away after processes: later that would let a deaf thread hear again."""
    if os.name == "posix":
        from multiprocessing import resource_tracker as own

        from joblib.externals.loky.backend import resource_tracker

        start_tracker(resource_tracker)
        start_tracker(own)


@contextmanager
def _pool(workers: int) -> Iterator[Executor]:
    """Give processes that each end when this one does, however it does."""
    from joblib.externals.loky import ProcessPoolExecutor

    start_trackers()
    held, alive = Pipe(duplex=False)
    with (
        held,
        alive,
        warnings.catch_warnings(),
        ProcessPoolExecutor(workers, initializer=_begin, initargs=(held,)) as pool,
    ):
        # Processes that have grown are replaced, which is no fault.
        warnings.filterwarnings("ignore", message="A worker stopped while some jobs")
        yield pool


def _begin(held: Connection) -> None:
    """Leave Ctrl-C to the program alone, and end with it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    hear_again()
    logging.getLogger("planner").addHandler(logging.NullHandler())
    threading.Thread(target=_end_with_parent, args=(held,), daemon=True).start()


def _end_with_parent(held: Connection) -> None:
    wait_for([held])
    dismiss()
    os._exit(1)
