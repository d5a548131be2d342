"""``python -m planner``, and the program ``planner``: the command line.

Little is imported before Ctrl-C is heard, and all else after it.
"""

import os
import signal
import sys

INTERRUPTED = 128 + signal.SIGINT


def main() -> int:
    """Run the command that was typed and return its exit code, as `planner.cli.main` does.

    Until that hears of signals, Ctrl-C ends the process without a word: nothing is begun yet.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    from planner.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
