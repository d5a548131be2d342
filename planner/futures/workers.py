"""Work shared out among processes that run SUMO, whose answers come in parts.

So what is done of a long task is known, and kept, before the rest is.
"""

import atexit
import contextlib
import logging
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple, Protocol, TypeVar

from planner.errors import LostError
from planner.futures.worker import Worker, running
from planner.interrupts import at_stop, is_stopping

Task = TypeVar("Task")
Answer = TypeVar("Answer")

log = logging.getLogger(__name__)

LOOK_S = 0.2  # between two looks whether answers are wanted still
QUOTA = Path("/sys/fs/cgroup/cpu.max")  # what a container may use, as "200000 100000"

_idle: list[Worker] = []  # started earlier, to be used again


class Backend(Protocol):
    """Where tasks are done: by processes of this machine, or of others."""

    def size(self, workers: int | None) -> int:
        """Return how many processes there are, given how many were asked for, if at all."""

    def answers(
        self,
        function: Callable[[Task], Answer],
        tasks: Sequence[Task],
        *,
        workers: int,
        files: Mapping[Path, str],
    ) -> Iterator[tuple[int, Any]]:
        """Yield what a function returns for each task, as it comes, after the task's number.

        Parameters
        ----------
        function
            Can be pickled; its own exceptions are raised here. What a generator yields comes part
            by part, each after the task's number.
        workers
            How many processes, as `size` has it.
        files
            What the tasks read, and its SHA-256: they have to find the same.

        Raises
        ------
        LostError
            If the processes that are at a task die again and again.
        """


class Here:
    """Has tasks done by processes of this machine."""

    def size(self, workers: int | None) -> int:
        """Return how many processes there are: one per core if not asked for."""
        return workers or cores()

    def answers(
        self,
        function: Callable[[Task], Answer],
        tasks: Sequence[Task],
        *,
        workers: int,
        files: Mapping[Path, str],  # noqa: ARG002
    ) -> Iterator[tuple[int, Any]]:
        """Yield what a function returns for each task, as `in_parts` does."""
        return in_parts(function, tasks, workers=workers)


HERE = Here()


class UnwantedError(Exception):
    """Nobody wants the answers any more."""


def in_processes(
    function: Callable[[Task], Answer],
    tasks: Sequence[Task],
    *,
    workers: int | None = None,
    wanted: Callable[[], bool] | None = None,
) -> Iterator[Answer]:
    """Yield what a function returns for each task, in the tasks' order.

    Parameters
    ----------
    function, workers, wanted
        As `in_parts` takes them; the function is no generator.
    """
    come: dict[int, Answer] = {}
    following = 0
    for number, answer in in_parts(function, tasks, workers=workers, wanted=wanted):
        assert number not in come, "a generator's answers come in parts: see in_parts"
        come[number] = answer
        while following in come:
            yield come.pop(following)
            following += 1


class _Part(NamedTuple):
    """What a worker has answered so far."""

    task: int
    answer: Any


def in_parts(
    function: Callable[[Task], Any],
    tasks: Sequence[Task],
    *,
    workers: int | None = None,
    wanted: Callable[[], bool] | None = None,
) -> Iterator[tuple[int, Any]]:
    """Yield what a function returns or yields for each task, as it comes, after the task's number.

    The parts of one task come in their order.

    Parameters
    ----------
    function
        Can be pickled; its own exceptions are raised here.
    workers
        How many processes; one per core if not given.
    wanted
        Asked now and then whether to go on.

    Raises
    ------
    LostError
        If a process dies, and the one that takes its place too.
    UnwantedError
        If they are not to go on.
    """
    if not tasks:
        return
    team = _Team(function, min(workers or cores(), len(tasks)))
    come: SimpleQueue[_Part | Future[None]] = SimpleQueue()

    def done(number: int, task: Task) -> None:
        for answer in team.answers(task):
            come.put(_Part(number, answer))

    with ThreadPoolExecutor(len(team.workers)) as threads, team:
        list(threads.map(team.begin, tuple(team.workers)))
        flying = [threads.submit(done, *numbered) for numbered in enumerate(tasks)]
        for one in flying:
            one.add_done_callback(come.put)
        try:
            yield from _until_all_end(come, len(flying), wanted)
        finally:
            for one in flying:
                one.cancel()


class _Team:
    """Processes that do tasks with one function; one that dies is replaced once at each task."""

    def __init__(self, function: Callable[[Any], Any], size: int) -> None:
        self.workers = _team(size)
        self._function = function
        self._free: SimpleQueue[Worker] = SimpleQueue()
        self._is_over = False

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Keep the processes for later; end all if one fails, else they would finish first."""
        if kind is not None:
            self._is_over = True
            for worker in list(self.workers):
                worker.kill()
        _idle.extend(worker for worker in self.workers if worker in running)

    def begin(self, worker: Worker) -> None:
        """Have a process take up the function, and be free for tasks."""
        worker.begin(self._function)
        self._free.put(worker)

    def answers(self, task: Any) -> Iterator[Any]:
        """Yield the parts of the answer to a task, from whichever process is free first."""
        worker, known = self._free.get(), 0
        try:
            for answer in worker.answers(task):
                known += 1
                yield answer
        except LostError as error:
            if worker.alive or self._is_over or is_stopping():
                raise
            log.warning("%s; started again", error)
            worker = self._in_place_of(worker)
            yield from islice(worker.answers(task), known, None)
        finally:
            self._free.put(worker)

    def _in_place_of(self, lost: Worker) -> Worker:
        self.workers.remove(lost)
        lost.kill()
        worker = Worker()
        self.workers.append(worker)
        worker.begin(self._function)
        return worker


def _until_all_end(
    come: "SimpleQueue[_Part | Future[None]]", tasks: int, wanted: Callable[[], bool] | None
) -> Iterator[_Part]:
    """Yield all parts of the answers to so many tasks; raise what one of these has raised."""
    while tasks:
        try:
            got = come.get(timeout=None if wanted is None else LOOK_S)
        except Empty:
            if wanted is not None and not wanted():
                raise UnwantedError from None
            continue
        if isinstance(got, _Part):
            yield got
        else:
            got.result()
            tasks -= 1


def cores() -> int:
    """Return how many processors this process may use."""
    here = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else ()
    count = len(here) or os.cpu_count() or 1
    with contextlib.suppress(OSError, ValueError):
        quota, period = QUOTA.read_text(encoding="ascii").split()
        count = min(count, max(1, int(quota) // int(period)))
    return count


def dismiss() -> None:
    """End all processes that wait for further work, or are at it."""
    for worker in list(running):
        worker.kill()
    _idle.clear()


def dismiss_idle() -> None:
    """End the processes that wait for further work."""
    for worker in _team(len(_idle), new=False):
        worker.kill()


def _kill_all() -> None:
    """End all processes without waiting for their ends, as is due when the program is stopped."""
    for worker in list(running):
        worker.process.kill()


atexit.register(dismiss)
at_stop(_kill_all)


def _team(size: int, *, new: bool = True) -> list[Worker]:
    waiting: list[Worker] = []
    while _idle and len(waiting) < size:
        with contextlib.suppress(IndexError):  # another thread may take the last one
            waiting.append(_idle.pop())
    alive = [worker for worker in waiting if worker.alive]
    for worker in set(waiting) - set(alive):
        worker.kill()
    return alive + [Worker() for _ in range(size - len(alive) if new else 0)]
