"""Particles driven on Dask's workers: each task by a process of that machine, as here.

A Dask worker has threads and may hold much else, so it never forks: it starts the same small
program that drives particles here, and keeps it for the tasks that follow.
"""

import atexit
import hashlib
import importlib
import logging
import os
import pickle
import platform
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from planner.errors import InputError, LostError
from planner.futures.cluster import Cluster
from planner.futures.recording_name import PACKAGE, made_by
from planner.futures.workers import cores, dismiss_idle, in_parts
from planner.network.sumo import sumo_version

Task = TypeVar("Task")
Answer = TypeVar("Answer")

log = logging.getLogger(__name__)

KEPT = "what is recorded is kept: run it again"
WAIT_S = 5.0  # for an answer, before it is asked whether any worker is there
REST_S = 30.0  # after its last task, before a Dask worker ends the processes that wait
FILES = 8  # whose digests a Dask worker remembers

_timers: list[threading.Timer] = []  # of a Dask worker


class OnCluster:
    """Has tasks done by processes on the machines of a Dask cluster.

    The connection is made when there is a first task, and kept for the tasks of further recordings.
    """

    def __init__(self, cluster: Cluster) -> None:
        self.cluster = cluster
        self._stack = ExitStack()
        self._client: Any = None

    def size(self, workers: int | None) -> int:
        """Return how many processes were asked for, or else how many the cluster can take."""
        if self.cluster.address is None:
            return workers or cores()
        return workers or max(1, sum(self._connected(1).nthreads().values()))

    def answers(
        self,
        function: Callable[[Task], Answer],
        tasks: Sequence[Task],
        *,
        workers: int,
        files: Mapping[Path, str],
    ) -> Iterator[tuple[int, Any]]:
        """Yield what a function returns or yields for each task, after the task's number.

        Tasks come in their order, all parts of an answer at once.

        Raises
        ------
        InputError
            If no scheduler answers, or a worker has another program or other files.
        LostError
            If the workers that are at a task are killed again and again, or the scheduler is.
        """
        if not tasks:
            return
        client = self._connected(workers)
        needs = _identity(), tuple((str(path), sha256) for path, sha256 in files.items())
        name = f"planner-{os.urandom(8).hex()}"
        flying = deque(
            # As bytes, so that neither Dask nor its scheduler looks into them.
            client.submit(done_there, pickle.dumps((function, task)), *needs, key=f"{name}-{n}")
            for n, task in enumerate(tasks)
        )
        try:
            for number in range(len(tasks)):
                parts = self._awaited(client, flying[0])
                flying.popleft().release()
                for part in parts:
                    yield number, part
        finally:
            if flying and client.status == "running":  # a closed one would wait for ever
                with suppress(OSError):
                    client.cancel(list(flying))

    def close(self) -> None:
        """End the connection, and the cluster if it was started here."""
        atexit.unregister(self.close)
        self._client = None
        with suppress(OSError):  # the scheduler may be gone
            self._stack.close()

    def _connected(self, workers: int) -> Any:
        if self._client is None:
            self._client = self._stack.enter_context(self.cluster.connected(workers))
            atexit.register(self.close)
        return self._client

    def _awaited(self, client: Any, flying: Any) -> Any:
        dask: Any = importlib.import_module("dask.distributed")
        try:
            while True:
                try:
                    return flying.result(timeout=WAIT_S)
                except TimeoutError:
                    if flying.done():  # it is the task's own
                        raise
                if not _has_workers(client):
                    log.warning("%s: no Dask worker is there; waiting for one", self.cluster.name)
        except dask.KilledWorker as error:
            raise LostError(
                f"{self.cluster.name}: the workers that drove particles were killed, one after "
                f"another; {KEPT}, with more memory for each worker if that is short"
            ) from error
        except CancelledError as error:
            raise LostError(f"{self.cluster.name}: the scheduler has ended; {KEPT}") from error


def _has_workers(client: Any) -> bool:
    """Return whether a cluster has workers; a scheduler that does not answer may have some."""
    with suppress(OSError):
        return bool(client.nthreads())
    return True


# What is called on a Dask worker


def done_there(
    packed: bytes, identity: tuple[str, ...], files: tuple[tuple[str, str], ...]
) -> list[Any]:
    """Return the parts of a task's answer from a process of this machine, if program and files fit.

    Raises
    ------
    InputError
        If this machine has other ones than the program that asks.
    """
    dask: Any = importlib.import_module("dask.distributed")
    worker = dask.get_worker()
    where = f"Dask worker {worker.address} on {platform.node()}"
    _refuse_another_program(where, identity)
    for path, sha256 in files:
        _refuse_another_file(where, path, sha256)
    function, task = pickle.loads(packed)
    key = worker.get_current_task()

    def wanted() -> bool:
        known = worker.state.tasks.get(key)
        return known is not None and known.state != "cancelled"

    try:
        return [part for _, part in in_parts(function, [task], workers=1, wanted=wanted)]
    finally:
        _dismiss_later()


def _dismiss_later() -> None:
    """End the processes that wait, unless further tasks are done meanwhile."""
    with suppress(IndexError):
        _timers.pop().cancel()
    timer = threading.Timer(REST_S, dismiss_idle)
    timer.daemon = True
    timer.start()
    _timers.append(timer)


def _identity() -> tuple[str, ...]:
    """Return what decides what is recorded: SUMO, this program and its libraries."""
    return f"eclipse-sumo {sumo_version()}", *made_by(PACKAGE)


def _refuse_another_program(where: str, identity: tuple[str, ...]) -> None:
    for here, there in zip(_identity(), identity, strict=True):
        if here != there:
            what = here if " " in here else "another version of planner"
            asked = there if " " in there else "the same"
            raise InputError(f"{where}: has {what}; install {asked} there, as here")


def _refuse_another_file(where: str, path: str, sha256: str) -> None:
    same = "have the same file at the same place there, in a folder that all machines share"
    try:
        found = Path(path).stat()
        digest = _digest(path, found.st_mtime_ns, found.st_size)
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{where}: cannot read {path} ({reason}); {same}") from error
    if digest != sha256:
        raise InputError(f"{where}: {path} is another file there; {same}")


@lru_cache(FILES)
def _digest(path: str, _changed_ns: int, _size: int) -> str:
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
