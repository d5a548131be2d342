"""`planner view`: a window that opens, shows, and closes."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from planner.cli import main
from planner.export.gui_scene import SEEN, UNSEEN
from planner.export.gui_window import _fault
from planner.mission.run_folder import GUI
from planner.network.sumo import binary, sumo_home
from support.command_line import Commands
from support.display import Screen, screen
from support.processes import started

PATIENCE_S = 120.0  # of a busy machine
FAST = ("--speed", "10000")
WAY = (0, 114, 178)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.fixture(scope="module")
def waiting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that sees some of its targets."""
    folder = tmp_path_factory.mktemp("runs") / "it's a & run"
    options = ["--method", "wait", "--targets", "20", "-o", str(folder), "--json"]
    assert main(["plan", "figure3", *options]) == 0
    return folder


@pytest.fixture(scope="module")
def display(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    with screen(tmp_path_factory.mktemp("screen")) as one:
        yield one


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    return monkeypatch


def wait_for(is_so: Callable[[], object]) -> None:
    until_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < until_s
        time.sleep(0.1)


def viewing(
    display: Screen, run: Path, *options: str
) -> AbstractContextManager["subprocess.Popen[str]"]:
    return started(
        [sys.executable, "-m", "planner", "view", str(run), *options],
        env={**os.environ, "DISPLAY": display.name},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def shows_all(display: Screen) -> bool:
    """Whether both kinds of targets are on the screen, more than a letter's worth of each."""
    return min(display.count(*colour[:3]) for colour in (SEEN, UNSEEN)) > 30


@pytest.mark.slow
def test_it_shows_both_kinds_of_targets_until_it_is_closed(display: Screen, waiting: Path) -> None:
    with viewing(display, waiting, *FAST) as command:
        wait_for(lambda: shows_all(display) or command.poll() is not None)
        wait_for(lambda: display.close_windows("plan.sumocfg") or command.poll() is not None)
        out, err = command.communicate(timeout=PATIENCE_S)
    assert (command.returncode, err) == (0, "")
    assert "green: not seen yet; grey: seen" in out


@pytest.mark.slow
def test_ctrl_c_closes_the_window(display: Screen, waiting: Path) -> None:
    with viewing(display, waiting, *FAST) as command:
        wait_for(lambda: shows_all(display) or command.poll() is not None)
        command.send_signal(signal.SIGINT)
        _, err = command.communicate(timeout=PATIENCE_S)
    assert command.returncode == 130
    assert err == "planner: stopped; nothing is half-written\n"
    wait_for(lambda: not shows_all(display))


@pytest.mark.slow
def test_sumo_gui_alone_shows_the_way(display: Screen, waiting: Path) -> None:
    command = [str(binary("sumo-gui")), "-c", str(waiting / "plan.sumocfg")]
    environment = {**os.environ, "DISPLAY": display.name, "SUMO_HOME": str(sumo_home())}
    with started(command, env=environment, stderr=subprocess.DEVNULL) as process:
        wait_for(lambda: display.count(*WAY) > 30 or process.poll() is not None)
        wait_for(lambda: display.close_windows("plan.sumocfg") or process.poll() is not None)
        assert process.wait(PATIENCE_S) == 0


def test_a_display_that_is_not_there_is_told(run: Commands, waiting: Path, no_display: Any) -> None:
    no_display.setenv("DISPLAY", ":64999")
    said = run("view", waiting)
    assert said.code == 2
    assert re.fullmatch("planner: sumo-gui ended with a fault: .*:64999.*\n", said.err)


def test_without_sumo_gui_there_is_a_remedy(run: Commands, waiting: Path, no_display: Any) -> None:
    no_display.setenv("DISPLAY", ":64999")
    is_file = Path.is_file
    no_display.setattr(Path, "is_file", lambda path: path.name != "sumo-gui" and is_file(path))
    said = run("view", waiting)
    assert said.code == 2
    assert said.err.endswith("sumo-gui is missing; install eclipse-sumo again\n")


def test_libraries_that_are_missing_are_named() -> None:
    said = "sumo-gui: error while loading shared libraries: libGL.so.1: cannot open shared object"
    fault = _fault(f"{said}\n")
    assert fault.startswith("sumo-gui cannot start (libGL.so.1: cannot open")
    assert "apt-get install libgl1" in fault


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (("--from", "99999"), "--from 27:46:39: the flight is shown from 0 to "),
        (("--from", "-5"), "--from"),
        (("--speed", "0"), "should be a number from 0.1 to 10000, not '0'"),
        (("--particles", "0"), "should be a whole number from 1 on"),
    ],
)
def test_bad_options(
    run: Commands, waiting: Path, no_display: Any, options: tuple[str, str], fault: str
) -> None:
    no_display.setenv("DISPLAY", ":64999")
    said = run("view", waiting, *options)
    assert (said.code, len(said.err.splitlines())) == (2, 1)
    assert fault in said.err


def test_an_earlier_run_gets_its_files(run: Commands, waiting: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(waiting, tmp_path / "copy")
    for name in GUI:
        (copy / name).unlink()  # the net, too, which is in the cache only
    told = run("view", copy, "--write", "--json").json
    assert told == {"config": str(copy / "plan.sumocfg")}
    for path in waiting.iterdir():
        assert (copy / path.name).read_bytes() == path.read_bytes()


def test_without_a_display_it_says_so(run: Commands, waiting: Path, no_display: Any) -> None:
    said = run("view", waiting)
    assert (said.code, said.out) == (2, "")
    assert said.err.startswith("planner: there is no display to open a window on")
    assert len(said.err.splitlines()) == 1
