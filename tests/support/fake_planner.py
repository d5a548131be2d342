"""Stands for the program in tests of the server: what it does is said by `--at`."""

import json
import os
import signal
import sys
from pathlib import Path

PROGRAM = (sys.executable, __file__)


def tell(**content: object) -> None:
    sys.stdout.write(json.dumps(content) + "\n")
    sys.stdout.flush()


def plan(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "plan.json").write_text(json.dumps(sys.argv))
    (folder / "page.html").write_text((folder.parent / "page").read_text())
    tell(event="plan", elapsed_s=1.0, text="first plan", screen=["found by 14:20: 23 %"])


def now() -> None:
    does = next(word for word in sys.argv if word.startswith("--at=")).removeprefix("--at=")
    folder = Path(sys.argv[sys.argv.index("-o") + 1])
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    if does == "faults":
        sys.exit("planner: a.net.xml: --last-seen: there is no street\x1b[2J of that name")
    folder.mkdir(parents=True, exist_ok=True)
    page = (folder.parent / "page").read_text()
    (folder / "page.html").write_text(page.replace("</h1>", ", a guess</h1>"))
    tell(event="cloud", elapsed_s=0.5, text="where it may be", screen=[])
    tell(event="progress", title="particles", done=1, total=2)
    if does == "guesses":
        signal.sigwait({signal.SIGINT})
        sys.exit("planner: stopped")
    plan(folder)
    if does == "tidies":  # when it is asked to end, it takes a while for what is half-done
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
        half_done = folder / "half-done"
        half_done.touch()
        signal.sigwait({signal.SIGTERM})
        half_done.unlink()
        sys.exit(143)
    if does == "dies":
        os.kill(os.getpid(), signal.SIGKILL)
    if does == "waits":
        signal.sigwait({signal.SIGINT})
    tell(event="done", elapsed_s=2.0, text="the best plan takes off 14:07", screen=[])


def export() -> None:
    folder = Path(sys.argv[2], "flight")
    folder.mkdir(exist_ok=True)
    for kind in sys.argv[-1].split(","):
        (folder / f"flight.{kind}").write_text(f"{kind} of {sys.argv[2]}")


if __name__ == "__main__":
    {"now": now, "export": export}[sys.argv[1]]()
