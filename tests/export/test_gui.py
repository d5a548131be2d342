"""What sumo-gui shows of a plan, still and moving."""

import gzip
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from planner.export.gui_scene import (
    DISC,
    DISC_OFF,
    SEEN,
    UNSEEN,
    Canvas,
    Look,
    Mark,
    Scene,
    equally_likely,
)
from planner.export.gui_settings import write_for_gui
from planner.export.gui_window import Show
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.mission.opening import OpenScenario
from planner.network.sumo import sumo_home
from planner.search.plan import plan_of_legs
from support.grid_instance import grid_futures, grid_problem

PROBLEM = grid_problem(grid_futures(3, np.random.default_rng(1)), distance_m=60000.0)


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory, berlin: OpenScenario) -> Path:
    folder = tmp_path_factory.mktemp("gui")
    plan = plan_of_legs(PROBLEM.replace(network=berlin.network), "greedy", [0, 7])
    write_for_gui(folder, plan, berlin.network, net=Path("a & b.net.xml"))
    return folder


def test_a_configuration_names_what_lies_beside_it(shown: Path) -> None:
    tree = etree.parse(str(shown / "plan.sumocfg"))
    schema = sumo_home() / "data" / "xsd" / "sumoConfiguration.xsd"
    etree.XMLSchema(etree.parse(str(schema))).assertValid(tree)
    assert tree.xpath("//net-file/@value") == ["a & b.net.xml"]
    names = tree.xpath("//additional-files/@value | //gui-settings-file/@value")
    assert {path.name for path in shown.iterdir()} == {"plan.sumocfg", *names}


def net_named(folder: Path, net: Path, berlin: OpenScenario) -> str:
    plan = plan_of_legs(PROBLEM.replace(network=berlin.network), "greedy", [0])
    write_for_gui(folder, plan, replace(berlin.network, path=net))
    (name,) = etree.parse(str(folder / "plan.sumocfg")).xpath("//net-file/@value")
    return str(name)


def test_a_net_of_the_cache_is_kept_with_the_run(
    empty_cache: Path, tmp_path: Path, berlin: OpenScenario
) -> None:
    copy = tmp_path / "plan.net.xml.gz"
    own = berlin.network.path
    assert net_named(tmp_path, own, berlin) == str(own.resolve())
    assert not copy.exists()
    empty_cache.mkdir()
    cached = empty_cache / "a.net.xml"
    cached.write_text("<net/>", encoding="utf-8")
    assert net_named(tmp_path, cached, berlin) == copy.name
    first = copy.read_bytes()
    assert gzip.decompress(first) == b"<net/>"
    os.utime(cached, (0, 0))
    net_named(tmp_path, cached, berlin)
    assert copy.read_bytes() == first


def test_what_is_written_beside_points_is_their_number(shown: Path) -> None:
    (key,) = etree.parse(str(shown / "plan.view.xml")).xpath("//pois/@poiTextParam")
    overlay = etree.parse(str(shown / "plan.add.xml"))
    assert overlay.xpath(f"//poi/param[@key='{key}']/@value") == ["take-off", "1", "2"]


def test_the_roads_fill_the_window(shown: Path, berlin: OpenScenario) -> None:
    """Zoom is in per cent of what shows the whole net, here 3,334 m from south to north."""
    (viewport,) = etree.parse(str(shown / "plan.view.xml")).iter("viewport")
    width_m, height_m = np.ptp(berlin.network.shape_xy_m, axis=0)
    high_m = 3333.57 * 100 / float(viewport.get("zoom"))
    assert 1.05 < max(high_m / height_m, 1.5 * high_m / width_m) < 3
    assert min(high_m / height_m, 1.5 * high_m / width_m) == pytest.approx(1 / 0.9, rel=1e-3)
    x_m, y_m = float(viewport.get("x")), float(viewport.get("y"))
    assert np.all(berlin.network.shape_xy_m.min(axis=0) < (x_m, y_m))
    assert np.all(berlin.network.shape_xy_m.max(axis=0) > (x_m, y_m))


# What moves

TRACK = Track(
    np.array([100.0, 200.0]), np.array([0.0, 50.0]), np.zeros(2), np.array([[150.0, 200.0]])
)
# Two targets stand still, one of them until 120 s; the third one appears at 50 s and drives.
FUTURES = Futures(
    time_s=[0, 0, 120, 50, 90],
    x_m=[10, 20, 20, 0, 400],
    y_m=[0, 5, 5, 0, 0],
    first_knot=[0, 1, 3, 5],
    weight=[0.5, 0.25, 0.25],
    gone=[False, True, False],
)
SCENE = Scene(Plan("any", (TRACK,), ((),)), FUTURES, np.array([160.0, np.inf, np.inf]), 30.0, 800.0)


@pytest.mark.parametrize(
    ("time_s", "targets", "uav_x_m", "disc"),
    [
        (0.0, {"target0": (10, 0, UNSEEN), "target1": (20, 5, UNSEEN)}, 0, DISC_OFF),
        (
            70.0,
            {
                "target0": (10, 0, UNSEEN),
                "target1": (20, 5, UNSEEN),
                "target2": (200, 0, UNSEEN),
            },
            0,
            DISC_OFF,
        ),
        (160.0, {"target0": (10, 0, SEEN), "target2": (400, 0, UNSEEN)}, 30, DISC),
        (900.0, {"target0": (10, 0, SEEN), "target2": (400, 0, UNSEEN)}, 50, DISC_OFF),
    ],
)
def test_a_scene(time_s: float, targets: dict[str, Any], uav_x_m: float, disc: Any) -> None:
    marks = SCENE.marks(time_s)
    uav, seen_from_it = marks.pop("uav0"), marks.pop("uav0.disc")
    assert {name: (*mark.place_m, mark.look.colour) for name, mark in marks.items()} == targets
    assert uav.place_m == seen_from_it.place_m == [uav_x_m, 0]
    assert seen_from_it.look.width_m == 60
    assert seen_from_it.look.colour == disc


class Points:
    """Remembers points as sumo-gui does, and refuses what it refuses."""

    def __init__(self) -> None:
        self.poi = self
        self.shown: dict[str, Mark] = {}

    def add(self, name: str, x: float, y: float, *look: Any, **size: float) -> None:
        assert name not in self.shown
        colour, _, layer = look
        self.shown[name] = Mark([x, y], Look(colour, size["width"], layer))

    def setParameter(self, name: str, key: str, label: str) -> None:
        assert key == "label"
        self.shown[name] = self.shown[name]._replace(
            look=self.shown[name].look._replace(label=label)
        )

    def setPosition(self, name: str, x: float, y: float) -> None:
        self.shown[name] = self.shown[name]._replace(place_m=[x, y])

    def remove(self, name: str, layer: int) -> None:
        assert self.shown.pop(name).look.layer == layer


LOOKS = [Look(SEEN, 3.0, 1), Look(UNSEEN, 3.0, 2, "a"), Look(SEEN, 4.0, 1)]
MARKS = st.builds(Mark, st.lists(st.integers(0, 2), min_size=2, max_size=2), st.sampled_from(LOOKS))


@given(st.lists(st.dictionaries(st.sampled_from("abcd"), MARKS), max_size=6))
def test_only_what_changes_is_told(pictures: list[dict[str, Mark]]) -> None:
    points = Points()
    canvas = Canvas(points)
    for marks in pictures:
        canvas.show(marks)
        assert points.shown == marks


@given(
    st.lists(st.floats(0.01, 1), min_size=1, max_size=40),
    st.integers(1, 50),
)
def test_likely_targets_are_picked(weight: list[float], many: int) -> None:
    chosen = equally_likely(np.array(weight), many)
    assert 1 <= len(chosen) <= many
    assert np.all(np.diff(chosen) > 0)
    share = np.array(weight) / sum(weight)
    assert set(np.flatnonzero(share > 1.001 / many)) <= set(chosen.tolist())
    assert len(weight) > many or len(chosen) == len(weight)


@given(st.floats(0, 5000), st.floats(0.001, 5000), st.floats(0.1, 10_000))
def test_a_show_halts_at_the_end_of_a_step(from_s: float, lasts_s: float, speed: float) -> None:
    times = Show.of(from_s, from_s + lasts_s, speed)
    step_s = times.step_ms / 1000
    assert times.from_s == pytest.approx(from_s, abs=0.001)
    assert from_s + lasts_s - 0.002 <= times.until_s <= from_s + lasts_s + step_s + 0.002
    assert step_s == pytest.approx(0.05 * speed, abs=0.001)
    first = [time_s for time_s, _ in zip(times.times_s(), range(3), strict=False)]
    expected = times.from_s + step_s * np.minimum(np.arange(3), times.steps)
    assert first == pytest.approx(expected)
