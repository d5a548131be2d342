"""A plan that is flown in a window of sumo-gui, among the targets that it looks for.

sumo-gui draws the net and the plan by itself; what moves is moved from here over TraCI. Of SUMO's
simulation only the clock is of use: sumo-gui's buttons halt and single-step the search.
"""

import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path
from typing import Any

from planner.errors import InputError, SumoError
from planner.export.gui_scene import Canvas, Scene
from planner.futures.simulation import LIBRARIES
from planner.interrupts import undone_if_stopped
from planner.network.sumo import binary, sumo_environment

AGAIN_S = 0.02  # between two tries to reach a window that opens
PATIENCE_S = 10.0  # for a window to go that has been closed
PICTURE_MS = 50  # how long each is shown
SIZE = "1100,900"  # of the window, pixels


@dataclass(frozen=True)
class Show:
    """Which part of a search is shown: from a time on, so many steps of so long each."""

    from_ms: int
    step_ms: int
    steps: int

    @classmethod
    def of(cls, from_s: float, until_s: float, speed: float) -> "Show":
        """Return a show from one time to another.

        Parameters
        ----------
        speed
            How many seconds of the search go by in a second.
        """
        step_ms = max(1, round(speed * PICTURE_MS))
        from_ms = round(1000 * from_s)
        return cls(from_ms, step_ms, max(1, math.ceil((1000 * until_s - from_ms) / step_ms)))

    @property
    def from_s(self) -> float:
        """When it begins, seconds."""
        return self.from_ms / 1000

    @property
    def until_s(self) -> float:
        """When the window halts, seconds: at the end of a step, or it would not."""
        return (self.from_ms + self.steps * self.step_ms) / 1000

    def times_s(self) -> Iterator[float]:
        """Yield the time of each picture, seconds, and of the last one again and again."""
        for step in range(self.steps):
            yield (self.from_ms + step * self.step_ms) / 1000
        yield from repeat(self.until_s)


def show(config: Path, scene: Scene, times: Show) -> None:
    """Show a search in a window, and return when somebody has closed it.

    Parameters
    ----------
    config
        The ``.sumocfg`` of the net and the plan, in a folder of its own.

    Raises
    ------
    InputError
        If there is no display to open a window on.
    SumoError
        If sumo-gui is missing, does not start, or ends with a fault.
    """
    refuse_no_display()
    with _window(config, times) as gui:
        canvas, due_s = Canvas(gui), time.monotonic()
        for time_s in times.times_s():
            canvas.show(scene.marks(time_s))
            gui.simulationStep()
            due_s = max(due_s + PICTURE_MS / 1000, time.monotonic())
            time.sleep(max(0.0, due_s - time.monotonic()))


def refuse_no_display() -> None:
    """Do nothing if a window may be opened.

    Raises
    ------
    InputError
        If windows need a display here, and none is named.
    """
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise InputError(
            "there is no display to open a window on (DISPLAY is not set); type it on a desktop "
            "or after ssh -X, or open page.html in a browser"
        )


@contextmanager
def _window(config: Path, times: Show) -> Iterator[Any]:
    """Give a connection to a window; the block ends without a fault when the window is closed.

    sumo-gui takes one connection, from whoever comes first: ours comes at once, and the port is
    another one each time.
    """
    import traci

    sumo_environment()
    port, said = _free_port(), config.with_name("said.txt")
    options = [f"--{key}={value}" for key, value in _options(times, port).items()]
    command = [str(binary("sumo-gui")), f"--configuration-file={config}", *options]
    with said.open("wb") as output:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=output)
    with undone_if_stopped(process.kill):
        try:
            with suppress(traci.FatalTraCIError, OSError):  # the window is gone
                yield _connected(port, process)
            with suppress(subprocess.TimeoutExpired):
                process.wait(PATIENCE_S)
        finally:
            process.kill()
            process.wait()
    if process.returncode not in (0, -signal.SIGKILL):
        raise SumoError(_fault(said.read_text(encoding="utf-8", errors="replace")))


def _options(times: Show, port: int) -> dict[str, object]:
    return {
        "begin": times.from_s,
        "step-length": times.step_ms / 1000,
        "breakpoints": times.until_s,
        "delay": 0,  # sumo-gui's own is several times as long as it says
        "window-size": SIZE,
        "start": "true",
        "quit-on-end": "true",
        "no-warnings": "true",
        "remote-port": port,
    }


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
        return port


def _connected(port: int, process: "subprocess.Popen[bytes]") -> Any:
    """Return the connection to a window that opens.

    Raises
    ------
    OSError
        If its process ends before it can be reached.
    """
    import traci

    while True:
        try:
            return traci.connect(port, numRetries=0, host="127.0.0.1", proc=process)
        except (traci.FatalTraCIError, traci.TraCIException) as error:
            if process.poll() is not None:
                raise ConnectionError from error
            time.sleep(AGAIN_S)


def _fault(said: str) -> str:
    """Return why sumo-gui ended, in a line, from what it said."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    library = next((line for line in lines if "shared librar" in line), None)
    if library is not None:
        return (
            f"sumo-gui cannot start ({library.rpartition('libraries: ')[2]}); install its system "
            f"libraries, on Debian and Ubuntu: apt-get install {LIBRARIES}"
        )
    told = next((line for line in lines if "rror" in line or "unable" in line), "no word of why")
    return f"sumo-gui ended with a fault: {told}"
