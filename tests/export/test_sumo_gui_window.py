"""sumo-gui's window: the files of a run opened as they are, and a run that moves."""

import gzip
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from lxml import etree

from planner.errors import SumoError
from planner.export.sumo_gui import net_to_open, write_configuration, write_look, write_overlay
from planner.export.sumo_gui_moving import Scene, show_moving
from planner.mission.opening import OpenScenario
from planner.network.sumo import binary, sumo_environment, sumo_home
from planner.page.shown import Shown
from support.page_runs import shown
from support.screen import screen

ROAD, WAY, SEEN = (213, 94, 0), (0, 114, 178), (190, 190, 190)
NEAR = 24  # of 255, that a colour may be off: dots let something through


@pytest.fixture
def display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    with screen() as name:
        monkeypatch.setenv("DISPLAY", name)
        yield


def colours(picture: Path, *wanted: tuple[int, ...]) -> list[int]:
    """Return how many pixels have each of some colours, nearly."""
    pixels = np.round(matplotlib.image.imread(picture)[..., :3] * 255)
    return [int((np.abs(pixels - colour).max(axis=-1) <= NEAR).sum()) for colour in wanted]


def write_all(folder: Path, run: Shown, picture: Path) -> Path:
    net = run.opened.network
    write_overlay(folder / "plan.add.xml", run.plan, net)
    write_look(folder / "plan.view.xml", snapshot=(picture, 1.0))
    names = {"overlay": "plan.add.xml", "look": "plan.view.xml"}
    opened = net_to_open(net.path, folder / "plan.net.xml.gz")
    write_configuration(folder / "plan.sumocfg", opened, until_s=10.0, **names)
    return folder / "plan.sumocfg"


def test_a_net_of_the_cache_is_kept_with_the_run(
    empty_cache: Path, tmp_path: Path, berlin: OpenScenario
) -> None:
    copy = tmp_path / "plan.net.xml.gz"
    assert net_to_open(berlin.network.path, copy) == str(berlin.network.path.resolve())
    assert not copy.exists()
    empty_cache.mkdir()
    net = empty_cache / "a.net.xml"
    net.write_text("<net/>", encoding="utf-8")
    assert net_to_open(net, copy) == copy.name
    assert gzip.decompress(copy.read_bytes()) == b"<net/>"
    first = copy.read_bytes()
    os.utime(net, (0, 0))
    net_to_open(net, copy)
    assert copy.read_bytes() == first


@pytest.mark.slow
def test_a_run_opens_as_it_is(display: None, berlin: OpenScenario, tmp_path: Path) -> None:
    picture = tmp_path / "seen.png"
    file = write_all(tmp_path, shown(berlin, 3), picture)
    schema = etree.parse(str(sumo_home() / "data" / "xsd" / "sumoConfiguration.xsd"))
    etree.XMLSchema(schema).assertValid(etree.parse(str(file)))
    sumo_environment()
    command = [str(binary("sumo-gui")), "-c", str(file), "--start", "--quit-on-end", "--end", "3"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    numbers, lines = colours(picture, ROAD, WAY)
    assert numbers > 300
    assert lines > 300


@pytest.mark.slow
def test_a_run_moves(display: None, berlin: OpenScenario, tmp_path: Path) -> None:
    run = shown(berlin, 30)
    seen_at = np.where(np.arange(30) % 2, 0.0, np.inf)
    scene = Scene(berlin.network, run.plan, run.fresh, seen_at, 60.0)
    show_moving(scene, picture=(tmp_path / "moving.png", 20.0))
    uav, free, seen = colours(tmp_path / "moving.png", ROAD, WAY, SEEN)
    assert uav > 50
    assert free > 50
    assert seen > 50


def test_it_needs_a_screen(
    berlin: OpenScenario, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    run = shown(berlin, 3)
    scene = Scene(berlin.network, run.plan, run.fresh, np.full(3, np.inf), 60.0)
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(SumoError, match="DISPLAY names none"):
        show_moving(scene)
    monkeypatch.setenv("DISPLAY", ":9876")
    with pytest.raises(SumoError, match="sumo-gui does not start"):
        show_moving(scene)
    assert capfd.readouterr().out == ""
