"""Try changed files on every reader: fuzz.py COUNT, with a table of what came of it.

Each case is a small sound file, changed at random, and the command that reads it, run in a forked
child with limits of time, memory and file size. A sound answer is exit code 0, or one line and exit
code 2 (verify.py: 1 as well) that leaves all files as they were. All else is a fault; its files and
its output are kept. The same seed gives the same cases.
"""

import argparse
import contextlib
import importlib
import io
import os
import pkgutil
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

TOOLS = Path(__file__).resolve().parent
sys.path[:0] = [str(TOOLS), str(TOOLS.parent)]
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "PYTHONDONTWRITEBYTECODE"):
    os.environ.setdefault(variable, "1")

from fuzzing import children, kinds  # noqa: E402
from fuzzing.mutations import changed  # noqa: E402

KEPT = 3  # cases of a fault whose files are kept


@dataclass
class Count:
    """What came of the cases of a kind."""

    cases: int = 0
    accepted: int = 0
    refused: int = 0
    slowest_s: float = 0.0
    faults: Counter[str] = field(default_factory=Counter)


class Fuzzer:
    """A process that has all loaded, and scratch folders.

    Parameters
    ----------
    kept
        Folder for the files of cases that fail.
    """

    def __init__(self, scratch: Path, kept: Path, seed: int) -> None:
        self._logs, self._case, self._seeds = (scratch / name for name in ("logs", "case", "seeds"))
        self._kept, self._seed = kept, seed
        children.emptied([self._logs, self._seeds])

    def prepare(self, tried: Sequence[kinds.Kind]) -> None:
        """Make the sound files, and run each command on them once: all is loaded and compiled.

        Raises
        ------
        RuntimeError
            If a sound file is refused.
        """
        here = Path.cwd()
        for kind in tried:
            folder = self._seeds / kind.name
            folder.mkdir()
            said, told = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(told), contextlib.redirect_stderr(said):
                kind.seeds(folder)
                shutil.rmtree(self._case, ignore_errors=True)
                shutil.copytree(folder, self._case)
                os.chdir(self._case)
                code = kinds.call_of(kind, kind.words)()
            os.chdir(here)
            if code:
                raise RuntimeError(f"{kind.name}: sound files are refused: {said.getvalue()}")

    def run(self, kind: kinds.Kind, number: int, count: Count) -> list[str]:
        """Run one case, count it, and return its faults."""
        rng = random.Random(f"{self._seed} {kind.name} {number}")
        shutil.rmtree(self._case, ignore_errors=True)
        shutil.copytree(self._seeds / kind.name, self._case)
        children.emptied([self._logs / "tmp"])
        if kind.changes:
            path = self._case / rng.choice(kind.changes)
            path.write_bytes(changed(rng, path.name, path.read_bytes()))
        words, before = kind.command(rng), children.listing(self._case)
        ended = children.run_in_child(kinds.call_of(kind, words), self._case, self._logs)
        speaker = "planner: " if kind.words else "verify.py: "
        after = children.listing(self._case)
        faults = children.faults_of(ended, speaker, before, after)
        left = sorted(path.name for path in (self._logs / "tmp").iterdir())
        faults += [f"left in TMPDIR: {left[0]}"] if left and not ended.hangs else []
        count.cases += 1
        count.accepted += ended.code == 0
        count.refused += ended.code in (1, 2)
        count.slowest_s = max(count.slowest_s, ended.cpu_s)
        count.faults.update(faults)
        if any(count.faults[fault] <= KEPT for fault in faults):
            self._keep(f"{kind.name} {number}".replace(" ", "-"), words, faults, ended)
        return faults

    def _keep(
        self, name: str, words: Sequence[str], faults: Sequence[str], ended: children.Ended
    ) -> None:
        folder = self._kept / name
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(self._case, folder, symlinks=True)
        told = [*faults, f"command: {list(words)}", f"exit code {ended.code}", ended.err, ended.out]
        text = "\n".join(told)[:20_000]
        (folder / "case.txt").write_text(text, encoding="utf-8", errors="backslashreplace")


def load_all(cache: Path) -> None:
    """Import all of the planner; its compiled code is the user's, all else of its cache is not."""
    import planner

    importlib.import_module("planner.jit")  # finds the compiled code in the user's cache
    os.environ["PLANNER_CACHE"] = str(cache)
    for module in pkgutil.walk_packages(planner.__path__, "planner."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    from planner.futures import workers
    from planner.futures.simulation import import_libsumo

    import_libsumo()
    setattr(workers, "in_processes", in_this_process)  # noqa: B010


def in_this_process(
    drive: Callable[[Any], Any],
    batches: Sequence[Any],
    workers: int | None = None,  # noqa: ARG001
) -> Iterator[Any]:
    """Return what SUMO's own processes would, without them."""
    return map(drive, batches)


def table_of(counts: dict[str, Count]) -> Iterator[str]:
    """Yield a table of what came of each kind, and the faults below it."""
    yield f"{'kind':<18}{'cases':>7}{'accepted':>10}{'refused':>9}{'slowest':>9}{'faults':>8}"
    for name, count in counts.items():
        columns = f"{count.cases:>7}{count.accepted:>10}{count.refused:>9}{count.slowest_s:>8.1f}s"
        yield f"{name:<18}{columns}{count.faults.total():>8}"
    for name, count in counts.items():
        yield from (f"{many:>5}  {name}: {fault}" for fault, many in count.faults.most_common())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as many cases as asked for; the exit code is 1 if there is a fault."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    names = [kind.name for kind in kinds.KINDS]
    parser.add_argument("count", type=int, metavar="COUNT", help="how many cases")
    parser.add_argument("--seed", type=int, default=1, help="other cases (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="begin with case N")
    parser.add_argument("--only", choices=names, action="append", help="only this kind; repeatable")
    parser.add_argument(
        "--keep", type=Path, default=Path("fuzz-faults"), metavar="DIR", help="for files of faults"
    )
    options = parser.parse_args(arguments)
    tried = [kind for kind in kinds.KINDS if not options.only or kind.name in options.only]
    counts = {kind.name: Count() for kind in tried}
    with tempfile.TemporaryDirectory(prefix="planner-fuzz-") as folder:
        scratch = Path(folder)
        load_all(scratch / "cache")
        fuzzer = Fuzzer(scratch, options.keep.resolve(), options.seed)
        fuzzer.prepare(tried)
        begun_s = time.monotonic()
        for i in range(options.first, options.first + options.count):
            kind = tried[i % len(tried)]
            for fault in fuzzer.run(kind, i, counts[kind.name]):
                print(f"{kind.name} {i}: {fault}", flush=True)
        took_s = time.monotonic() - begun_s
    print(*table_of(counts), sep="\n")
    faults = sum(count.faults.total() for count in counts.values())
    print(f"{options.count} cases in {took_s:.0f} s, {faults} faults", end="")
    print(f"; files in {options.keep}" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    raise SystemExit(main())
