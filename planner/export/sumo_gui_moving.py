"""A run in sumo-gui as it goes on: the UAV, what it sees, and where the target may be."""

import io
import os
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.errors import SumoError
from planner.export.sumo_gui import write_look, write_overlay
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.interrupts import undone_if_stopped
from planner.network.road_network import RoadNetwork
from planner.network.sumo import binary, plain_names, sumo_environment

VIEW = "View #0"
FREE, SEEN = (0, 114, 178, 230), (190, 190, 190, 200)  # red, green, blue, opacity
UAV, DISC = (213, 94, 0, 255), (213, 94, 0, 70)
AWAY_M = -1e7  # where what is not there is put
DOT = 150  # dots across the net
DELAY_MS = 40  # between two steps, so that one can follow them
TRIES, WAIT_S = 300, 0.2  # to reach it, which reads the net first, and the time in between
STEPS = 1500  # of a whole flight, at most


@dataclass(frozen=True, eq=False)
class Scene:
    """What moves."""

    network: RoadNetwork
    plan: Plan
    targets: Futures
    seen_at: Floats  # (N,) seconds, when the plan sees each first
    radius_m: float


def show_moving(scene: Scene, *, picture: tuple[Path, float] | None = None) -> None:
    """Open sumo-gui and move all that moves, until the flight ends or the window is closed.

    Parameters
    ----------
    picture
        A file for what the window shows, and at which second; it is closed then.

    Raises
    ------
    SumoError
        If sumo-gui does not start.
    """
    import traci

    step_s = max(1.0, np.ceil(scene.plan.end_s / STEPS))
    with _opened(scene, step_s) as gui, suppress(traci.exceptions.FatalTraCIError):
        low_m, high_m = (f(scene.network.shape_xy_m, axis=0).tolist() for f in (np.min, np.max))
        gui.gui.setBoundary(VIEW, *low_m, *high_m)
        dots = _Dots(gui, scene)
        for time_s in np.arange(0.0, scene.plan.end_s + step_s, step_s).tolist():
            dots.move(time_s)
            if picture is not None and time_s >= picture[1]:
                gui.gui.screenshot(VIEW, str(picture[0]))
                for _ in range(3):  # by when it is drawn
                    gui.simulationStep()
                return
            gui.simulationStep()


@contextmanager
def _opened(scene: Scene, step_s: float) -> Iterator[Any]:
    """Give the connection to a sumo-gui that shows the plan on its net."""
    if os.name == "posix" and not os.environ.get("DISPLAY"):
        raise SumoError("sumo-gui needs a screen, and DISPLAY names none; open page.html instead")
    sumo_environment()
    net = scene.network.path
    with plain_names([net], net.parent) as links:
        folder = links[net].parent
        write_overlay(folder / "plan.add.xml", scene.plan, scene.network)
        write_look(folder / "plan.view.xml", numbered=False)
        command = [
            *(str(binary("sumo-gui")), "--net-file", str(links[net])),
            *("--additional-files", str(folder / "plan.add.xml")),
            *("--gui-settings-file", str(folder / "plan.view.xml")),
            *("--step-length", f"{step_s:g}", "--delay", str(DELAY_MS), "--start", "--quit-on-end"),
            *("--no-step-log", "--no-warnings", "--window-size", "1100,900"),
        ]
        gui, running = _connected(command)

        def close() -> None:
            with suppress(Exception):
                gui.close(wait=False)
            running.kill()
            running.wait()

        with undone_if_stopped(close):
            try:
                yield gui
            finally:
                close()


def _connected(command: list[str]) -> tuple[Any, subprocess.Popen[bytes]]:
    """Start sumo-gui at a free port of this machine, and take its only connection at once."""
    import traci

    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    try:
        running = subprocess.Popen(
            [*command, "--remote-port", str(port)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except OSError as error:
        raise SumoError(f"sumo-gui cannot be run: {error.strerror or error}") from error
    try:
        with redirect_stdout(io.StringIO()):  # it tells of each try
            gui = traci.connect(port, numRetries=TRIES, proc=running, waitBetweenRetries=WAIT_S)
    except BaseException as error:
        running.kill()
        running.wait()
        if isinstance(error, traci.exceptions.TraCIException | traci.exceptions.FatalTraCIError):
            raise SumoError(
                "sumo-gui does not start; is there a screen? `planner doctor` tells which "
                "libraries it needs, and page.html shows the same"
            ) from error
        raise
    return gui, running


class _Dots:
    """The dots of a scene, on the map of a sumo-gui."""

    def __init__(self, gui: Any, scene: Scene) -> None:
        self._poi, self._scene = gui.poi, scene
        size_m = float(np.ptp(scene.network.shape_xy_m, axis=0).max()) / DOT
        for k in range(len(scene.targets)):
            self._add(f"target{k}", FREE, size_m, layer=300)
        for k in range(len(scene.plan.tracks)):
            self._add(f"disc{k}", DISC, 2 * scene.radius_m, layer=310)
            self._add(f"uav{k}", UAV, 2 * size_m, layer=320)
        self._is_seen = np.zeros(len(scene.targets), dtype=bool)

    def _add(self, name: str, colour: tuple[int, ...], wide_m: float, *, layer: int) -> None:
        self._poi.add(name, AWAY_M, AWAY_M, colour, layer=layer, width=wide_m, height=wide_m)

    def move(self, time_s: float) -> None:
        """Put all where they are at a time, seconds."""
        scene = self._scene
        for k, (x_m, y_m) in enumerate(scene.targets.positions(time_s).tolist()):
            is_there = np.isfinite(x_m)
            self._poi.setPosition(f"target{k}", *((x_m, y_m) if is_there else (AWAY_M, AWAY_M)))
        for k in np.flatnonzero((scene.seen_at <= time_s) & ~self._is_seen).tolist():
            self._poi.setColor(f"target{k}", SEEN)
            self._is_seen[k] = True
        for k, track in enumerate(scene.plan.tracks):
            x_m, y_m = track.xy(float(np.clip(time_s, track.time_s[0], track.end_s))).tolist()
            for name in ("disc", "uav"):
                self._poi.setPosition(f"{name}{k}", x_m, y_m)
