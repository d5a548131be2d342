"""Commands run in forked children of a process that has all loaded, and a judge of what came."""

import hashlib
import io
import json
import math
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from planner.futures.workers import dismiss

CPU_S, MEMORY_MB, FILE_MB = 20, 1500, 200  # beyond its first a case hangs, beyond its second eats
ADDRESSES_MB = 12_000
STARVED = 15  # times the processor time, after which a case hangs whatever it has done
TRACEBACK = "Traceback (most recent call last)"
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
FRAME = re.compile(r'File "[^"]*/((?:planner|tools)/[^"]+)", line \d+, in (\S+)')
LONGEST_LINE = 1500


@dataclass(frozen=True)
class Ended:
    """How a child ended."""

    code: int  # negative: the signal
    out: str
    err: str
    cpu_s: float
    memory_mb: float
    hangs: bool


def run_in_child(call: Callable[[], int], folder: Path, logs: Path) -> Ended:
    """Return how a call ended, made in a forked child from within a folder."""
    out, err = logs / "out", logs / "err"
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid == 0:
        _child(call, folder, logs)
    deadline, pause_s, hangs = time.monotonic() + STARVED * CPU_S, 0.001, False
    while True:
        done, status, usage = os.wait4(pid, os.WNOHANG)
        if done:
            break
        if time.monotonic() > deadline:
            os.killpg(pid, signal.SIGKILL)
            _, status, usage = os.wait4(pid, 0)
            hangs = True
            break
        time.sleep(pause_s)
        pause_s = min(0.02, 1.3 * pause_s)
    code, cpu_s = os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime
    hangs = hangs or code == -signal.SIGXCPU or (code == -signal.SIGKILL and cpu_s > 0.9 * CPU_S)
    said, told = (path.read_text(encoding="utf-8", errors="replace") for path in (out, err))
    return Ended(code, said, told, cpu_s, usage.ru_maxrss / 1024, hangs)


def _child(call: Callable[[], int], folder: Path, logs: Path) -> NoReturn:
    code = 99
    try:
        os.setsid()
        for name, number in (("out", 1), ("err", 2)):
            handle = os.open(logs / name, os.O_CREAT | os.O_TRUNC | os.O_RDWR)
            os.dup2(handle, number)
            os.close(handle)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), encoding="utf-8")
        sys.stderr = io.TextIOWrapper(
            io.FileIO(2, "w", closefd=False), "utf-8", "backslashreplace", write_through=True
        )
        os.chdir(folder)
        os.environ["TMPDIR"], tempfile.tempdir = str(logs / "tmp"), None
        for what, most in (
            (resource.RLIMIT_AS, ADDRESSES_MB << 20),
            (resource.RLIMIT_CORE, 0),
            (resource.RLIMIT_CPU, CPU_S),
            (resource.RLIMIT_FSIZE, FILE_MB << 20),
        ):
            resource.setrlimit(what, (most, most))
        code = _code(call)
        sys.stdout.flush()
        dismiss()  # as a program does that ends, and `os._exit` does not
    finally:
        os._exit(code)


def _code(call: Callable[[], int]) -> int:
    try:
        return call()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:
        traceback.print_exc()
        return 70


def listing(folder: Path) -> dict[str, str]:
    """Return what a folder holds: digests by name."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        if path.is_file() and not path.is_symlink()
        else "-"
        for path in sorted(folder.rglob("*"))
    }


def faults_of(
    ended: Ended, speaker: str, before: dict[str, str], after: dict[str, str]
) -> list[str]:
    """Return what is wrong with how a command ended, in words; nothing if all is well.

    Parameters
    ----------
    speaker
        What each line on stderr begins with.
    before, after
        What the folder held.
    """
    lines = ended.err.splitlines()
    found = {
        "hangs": ended.hangs,
        f"more than {MEMORY_MB} MB": ended.memory_mb > MEMORY_MB,
        f"crash {-ended.code}": ended.code < 0 and not ended.hangs,
        "traceback " + signature(ended.err): TRACEBACK in ended.err,
        f"exit code {ended.code}": ended.code not in (0, 1, 2, 70) and ended.code > 0,
        "half-written file": any(Path(name).name.startswith(".") for name in after),
    }
    if ended.code >= 0 and TRACEBACK not in ended.err:
        stray = [line for line in lines if not line.startswith(speaker)]
        found["stray line: " + "".join(stray[:1])[:80]] = bool(stray)
        found["line too long"] = any(len(line) > LONGEST_LINE for line in lines)
        found["control characters"] = bool(CONTROL.search(ended.err + ended.out))
    if ended.code == 2:
        found["silent refusal"] = not lines
        found["files changed on refusal"] = before != after
    if ended.code == 0 and speaker.startswith("planner") and not finite(ended.out):
        found["no finite JSON"] = True
    return [what for what, is_so in found.items() if is_so]


def finite(text: str) -> bool:
    """Tell whether a text is JSON in which all numbers are finite."""
    try:
        return _is_finite(json.loads(text))
    except (ValueError, RecursionError):
        return False


def _is_finite(value: Any) -> bool:
    if isinstance(value, dict | list):
        return all(map(_is_finite, value.values() if isinstance(value, dict) else value))
    return not isinstance(value, float) or math.isfinite(value)


def signature(err: str) -> str:
    """Return the exception at the end of a traceback, and where in this project it was raised."""
    frames = FRAME.findall(err)
    last = [line for line in err.splitlines() if re.match(r"[\w.]+(: |$)", line)][-1:]
    kind = "".join(last).partition(":")[0]
    return f"{kind} in {':'.join(frames[-1])}" if frames else kind


def emptied(folders: Sequence[Path]) -> None:
    """Make folders anew, empty."""
    for folder in folders:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
