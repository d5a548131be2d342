"""A worker process: libsumo holds one simulation, and ignores Ctrl-C.

It is a separate Python that reads tasks from its input and writes answers to its output. It runs in
its own session, so that Ctrl-C reaches the program alone; its input closes with the program, which
ends it.
"""

import contextlib
import os
import pickle
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from types import GeneratorType
from typing import Any

from planner.errors import LostError
from planner.futures.forks import told_end
from planner.locks import temporary_folder

MALLOC = ("glibc.malloc.hugetlb=1", "glibc.malloc.tcache_count=60000")

_PART, _ERROR, _END = range(3)  # what an answer is

running: set["Worker"] = set()  # all that have been started and not killed


class Worker:
    """A process and a folder for its temporary files, which goes when it goes."""

    def __init__(self) -> None:
        self._stack = contextlib.ExitStack()
        folder = self._stack.enter_context(temporary_folder())
        self._said = folder / "said.txt"
        here = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder)) | _lean()
        with self._said.open("wb") as said:
            self.process = subprocess.Popen(
                [sys.executable, "-c", _program()],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=said,
                env={**os.environ, **here},
                start_new_session=True,
            )
        running.add(self)

    @property
    def alive(self) -> bool:
        """Whether its process has not ended."""
        return self.process.poll() is None

    def begin(self, function: Callable[[Any], Any]) -> None:
        """Take up a function, in the place of an earlier one."""
        self._ask(function)
        self._answer()

    def answers(self, task: Any) -> Iterator[Any]:
        """Yield what the function returns or yields, or raise what it raises."""
        self._ask((task,))
        while True:
            kind, answer = self._answer()
            if kind == _END:
                return
            if kind == _ERROR:
                raise answer
            yield answer

    def kill(self) -> None:
        """End it, and wait for its end."""
        running.discard(self)
        self.process.kill()
        self.process.wait()
        self._stack.close()

    def _ask(self, message: Any) -> None:
        asked = self.process.stdin
        assert asked is not None
        try:
            pickle.dump(message, asked, pickle.HIGHEST_PROTOCOL)
            asked.flush()
        except OSError as error:
            raise LostError(self._last_words()) from error

    def _answer(self) -> Any:
        answered = self.process.stdout
        assert answered is not None
        try:
            return pickle.load(answered)
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            raise LostError(self._last_words()) from error

    def _last_words(self) -> str:
        code = self.process.wait()
        lines = self._said.read_text(errors="replace").splitlines() if self._said.exists() else []
        said = f": {lines[-1].strip()}" if lines else ""
        return (
            f"a process that runs SUMO {told_end(code)}{said}; what is recorded is kept: run it "
            "again, with fewer --jobs if memory is short"
        )


def _lean() -> dict[str, str]:
    """Return what keeps a process without threads and quick to fork.

    NumPy, which comes with libsumo, would start threads. Of huge pages few have to be listed for a
    child. What a child frees it keeps at hand and takes again: the free places that loading the net
    has left are scattered over pages that it shares, each of which it would have to copy.
    """
    known = os.environ.get("GLIBC_TUNABLES")
    tunables = ":".join(filter(None, [known, *MALLOC]))
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {"GLIBC_TUNABLES": tunables, **threads}


def _program() -> str:
    return f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve()"


def serve() -> None:
    """Answer tasks until the input ends; what a worker runs."""
    # Whatever prints to standard output must not get in between answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    function: Callable[[Any], Any] | None = None
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            message = pickle.load(sys.stdin.buffer)
            if isinstance(message, tuple):
                assert function is not None
                said = _answers(function, *message)
            else:
                function, said = message, iter([pickle.dumps(None)])
            for answer in said:
                answers.write(answer)
                answers.flush()


def _answers(function: Callable[[Any], Any], task: Any) -> Iterator[bytes]:
    try:
        found = function(task)
        for part in found if isinstance(found, GeneratorType) else (found,):
            yield pickle.dumps((_PART, part), pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        error.add_note(traceback.format_exc())
        yield pickle.dumps((_ERROR, error))
    else:
        yield pickle.dumps((_END, None))
