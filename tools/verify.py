"""Check the project's figures against values found elsewhere."""

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

TOOLS = Path(__file__).resolve().parent


def main(argv: Sequence[str] | None = None) -> int:
    """Run the checks that the command line asks for; return their exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--paper-table",
        nargs=argparse.REMAINDER,
        metavar="OPTION",
        help="the paper's planners over many seeds beside reference values; all that follows "
        "goes to tools/paper_table.py (--paper-table --help tells what it takes)",
    )
    wanted = parser.parse_args(argv)
    if wanted.paper_table is None:
        parser.error("nothing to verify: give --paper-table")
    command = [sys.executable, str(TOOLS / "paper_table.py"), *wanted.paper_table]
    return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
