"""Prints the SHA-256 of all that a set of runs writes: a change that keeps behaviour keeps these.

python tools/fingerprint.py -o before.txt            # some minutes
... change the code ...
python tools/fingerprint.py --against before.txt     # 0: the same bytes; 1: what differs is listed

The runs: on figure1, figure3 and grid5x5 a plan by every method, certificates, where the
target is, and the experiments section3 and section4. Left out is what no two runs share: run.json,
timings, and reports, whose words are not figures. Each call records with an empty cache.
"""

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from planner.search.methods import METHODS

Commands = list[tuple[str, ...]]

SCENARIOS = ("figure1", "figure3", "grid5x5")
WHERE_S = {"figure1": "60", "figure3": "60", "grid5x5": "1800"}
EXPERIMENTS = (("section3",), ("section4", "--quick"))
CERTIFIED = ("best", "wait")  # one plan over roads, one that leaves them
NOT_REPEATED = ("run.json", "timings.parquet")
PROSE = (".md", ".txt", ".log")
FEWER = ("--set", "search.work=20000", "--targets", "500")


def runs_of(scenario: str, folder: Path) -> Iterator[Commands]:
    """Yield the commands to be run on a scenario; those of one list come after one another."""
    yield [("where", scenario, "--at", WHERE_S[scenario], "-o", str(folder / "where"))]
    for method in METHODS:
        out = str(folder / method.name)
        plan: Commands = [("plan", scenario, "--method", method.name, "-o", out, *FEWER)]
        yield plan + ([("certify", out, "--work", "50")] if method.name in CERTIFIED else [])


def run_all(commands: Commands) -> str:
    """Run commands after one another and return a line for each that ended otherwise than well."""
    lines = []
    for command in commands:
        ended = subprocess.run(
            [sys.executable, "-m", "planner", *command], capture_output=True, text=True, check=False
        )
        if ended.returncode:
            said = ended.stderr.strip().splitlines()
            lines.append(f"exit code {ended.returncode}  {' '.join(command[:4])}: {said[-1]}")
    return "\n".join(lines)


def fingerprint(folder: Path) -> Iterator[str]:
    """Yield a line for each file below a folder: its SHA-256 and its name."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        left_out = path.name in NOT_REPEATED or "timings" in name.parts or path.suffix in PROSE
        if path.is_file() and not left_out:
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            yield f"{digest}  {name.as_posix()}"


def main() -> int:
    """Run, hash, and write or compare; 1 if something differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, help="write the lines here, not to stdout")
    parser.add_argument("--against", type=Path, help="compare with the lines of an earlier call")
    parser.add_argument("--keep", type=Path, help="leave the runs in this empty folder")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        os.environ["PLANNER_CACHE"] = str(Path(temporary) / "cache")
        folder = (arguments.keep or Path(temporary) / "runs").resolve()
        if folder.exists() and any(folder.iterdir()):
            parser.error(f"--keep {folder}: is not empty")
        folder.mkdir(parents=True, exist_ok=True)
        batches = [batch for name in SCENARIOS for batch in runs_of(name, folder / name)]
        batches += [[("experiment", *of, "-o", str(folder / of[0]))] for of in EXPERIMENTS]
        head, *rest = batches  # the first compiles and records for the others
        with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
            refused = [run_all(head), *pool.map(run_all, rest)]
        faults = [line.replace(str(folder), "RUNS") for line in refused if line]
        lines = [*fingerprint(folder), *faults]
    if arguments.output:
        arguments.output.write_text("\n".join(lines) + "\n", encoding="utf-8")
    elif not arguments.against:
        print("\n".join(lines))
    if not arguments.against:
        return 0
    before = arguments.against.read_text(encoding="utf-8").splitlines()
    gone = [f"- {line}" for line in before if line not in set(lines)]
    new = [f"+ {line}" for line in lines if line not in set(before)]
    print("\n".join([*gone, *new]) or f"{len(lines)} lines, all as before")
    return 1 if gone or new else 0


if __name__ == "__main__":
    sys.exit(main())
