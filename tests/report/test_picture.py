"""Pictures repeat byte for byte, need no screen, and show what they should."""

import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.errors import OutputError
from planner.flight.airspace import Airspace
from planner.flight.pieces import Piece, pieces
from planner.flight.plan import Plan
from planner.futures.state_at import state_at
from planner.messages import percent
from planner.mission.opening import OpenScenario, open_scenario
from planner.network.road_network import RoadNetwork
from planner.report.airspace_map import COLOUR
from planner.report.curves import shown_until_s
from planner.report.figure import axes_at, new_figure
from planner.report.maps import View, draw_order
from planner.report.picture import moments_s, plan_picture, where_picture
from planner.search.plan import plan_of_legs, plan_of_wait
from planner.search.problem import Problem
from support.drawn_texts import texts
from support.grid_instance import grid_futures, grid_problem

PROBLEM = grid_problem(grid_futures(60, np.random.default_rng(1)), distance_m=60000.0)
LEGS = plan_of_legs(PROBLEM, "greedy", [2, 6, 41])
WAIT = plan_of_wait(PROBLEM, "wait", 75000.0, -75000.0)


def evaluated(plan: Plan) -> dict[str, Evaluation]:
    fresh = grid_futures(40, np.random.default_rng(2))
    return {
        name: evaluate(plan.tracks, futures, PROBLEM.sensor, PROBLEM.objective)
        for name, futures in (("planned", PROBLEM.futures), ("fresh", fresh))
    }


@pytest.mark.parametrize("kind", [".png", ".svg", ".pdf"])
def test_the_same_plan_gives_the_same_bytes(tmp_path: Path, kind: str) -> None:
    import matplotlib

    first, second = tmp_path / f"a{kind}", tmp_path / f"b{kind}"
    plan_picture(first, PROBLEM, LEGS, evaluations=evaluated(LEGS), title="grid")
    with matplotlib.rc_context({"font.size": 20.0, "axes.facecolor": "red"}):
        plan_picture(second, PROBLEM, LEGS, evaluations=evaluated(LEGS), title="grid")
    assert first.read_bytes() == second.read_bytes()
    assert len(first.read_bytes()) > 10000


def test_it_says_what_it_shows(tmp_path: Path) -> None:
    evaluations = evaluated(LEGS)
    plan_picture(tmp_path / "p.svg", PROBLEM, LEGS, evaluations=evaluations, title="a title")
    said = texts(tmp_path / "p.svg")
    assert "a title" in said
    assert "UAV takes off at 0:00:00, 60 km north-west of the net;" in " ".join(said)
    # The third road is flown long after the last of those that are found.
    assert [text for text in said if text in {"1", "2", "3"}] == ["1", "2"]
    assert any(text.startswith("roads in the order flown until 0:") for text in said)
    mean_s = evaluations["fresh"].expected_detection_time_s
    assert any(text.startswith("fresh: ") and f"mean {mean_s:,.0f} s" in text for text in said)
    assert {"east (km)", "time (min)", "horizon: 167 min, farther right"} <= set(said)
    assert sum(text.endswith("% found") for text in said) == 4
    assert {percent(0.0, 0), percent(1.0, 0)} <= set(said)  # along the axis as everywhere
    assert not any(re.search(r"\d%", text) for text in said)


def test_of_several_targets_it_shows_their_mean(tmp_path: Path) -> None:
    two = PROBLEM.replace(objective=Objective(PROBLEM.horizon_s, sought=2))
    of_two = evaluated(LEGS)
    of_one = texts_of(tmp_path / "one.svg", PROBLEM, of_two)
    for name, one in of_two.items():
        seen_at, weight, end_s = (np.tile(x, 2) for x in (one.seen_at, one.weight, one.end_s))
        target = np.repeat([0, 1], len(one.weight))
        of_two[name] = Evaluation(seen_at, weight, end_s, two.objective, target=target)
    twice = two.futures.take(np.tile(np.arange(len(two.futures)), 2))
    said = texts_of(tmp_path / "two.svg", two.replace(futures=twice), of_two)
    assert "probability of having found one of the 2 targets, on average" in said
    for told in (" found", " s"):  # beside each picture, and in the legend
        assert [text for text in said if text.endswith(told)] == [
            text for text in of_one if text.endswith(told)
        ]


def texts_of(path: Path, problem: Problem, evaluations: dict[str, Evaluation]) -> list[str]:
    plan_picture(path, problem, LEGS, evaluations=evaluations)
    return texts(path)


def test_it_shows_the_airspace(tmp_path: Path) -> None:
    ring = shapely.box(20000, -40000, 40000, -20000).difference(
        shapely.Point(3e4, -3e4).buffer(5e3)
    )
    closed = PROBLEM.replace(
        airspace=Airspace(no_fly=ring, fence=shapely.box(-1e5, -1e5, 1e5, 1e5))
    )
    for name, problem in (("open", PROBLEM), ("closed", closed)):
        plan_picture(tmp_path / f"{name}.svg", problem, LEGS, evaluations=evaluated(LEGS))
    assert "hatched: no-fly; dashed: fence" in texts(tmp_path / "closed.svg")
    assert not any("no-fly" in text for text in texts(tmp_path / "open.svg"))
    purple = (tmp_path / "closed.svg").read_text().count(COLOUR)
    assert purple > 2 * 5  # on the map and beside each moment
    assert COLOUR not in (tmp_path / "open.svg").read_text()


def ordered(
    path: Path, network: RoadNetwork, flight: Sequence[Piece]
) -> tuple[bool, list[str], list[Any]]:
    """Whether all numbers of a flight found room, their labels, and the labels' boxes."""
    with new_figure(path, (7.6, 6.9), "") as figure:
        axes = axes_at(figure, 0.65, 0.6, 5.45, 5.45)
        view = View.of(network)
        all_there = draw_order(axes, view, flight, np.zeros((len(flight), 4)))
        view.frame(axes, numbered=False)
        figure.canvas.draw()
        boxes = [label.get_bbox_patch().get_window_extent() for label in axes.texts]
    return all_there, [label.get_text() for label in axes.texts], boxes


def test_a_road_flown_often_keeps_all_its_numbers(tmp_path: Path) -> None:
    plan = plan_of_legs(PROBLEM, "greedy", [2, 3] * 5)
    all_there, labels, _ = ordered(tmp_path / "p.svg", PROBLEM.network, pieces(plan))
    assert all_there
    said = ", ".join(labels).replace("\n", ", ").split(", ")
    assert {str(order) for order in range(1, 11)} == set(said)


def test_labels_on_many_short_roads_do_not_cover_each_other(tmp_path: Path) -> None:
    network = open_scenario("berlin", overrides=["network.road_tolerance_m=0"]).network
    roads = np.random.default_rng(1).integers(0, len(network.road_ids), 120)
    flight = [
        Piece(0, order, int(road), network.shape(road), float(order), order + 1.0)
        for order, road in enumerate(roads, 1)
    ]
    all_there, labels, boxes = ordered(tmp_path / "p.svg", network, flight)
    assert not all_there
    assert len(labels) > 10
    assert any(label.split(",")[0] == "1" for label in labels)
    for one, other in combinations(boxes, 2):
        across = min(one.x1, other.x1) - max(one.x0, other.x0)
        up = min(one.y1, other.y1) - max(one.y0, other.y0)
        assert min(across, up) < 2.0  # pixels


def test_moments_are_never_the_same() -> None:
    """Seven seconds apart on a search of an hour; and once where all is found at once."""
    problem = PROBLEM.replace(objective=Objective(3600.0))
    seen = np.append(np.linspace(5.0, 21.0, 10), [21.0] * 50)
    assert moments_s(problem, seen, 4) == [0.0, 7.0, 14.0, 21.0]
    assert moments_s(problem, np.full(60, 0.0), 4) == [0.0]
    assert moments_s(problem, np.full(60, 1790.0), 4) == [0.0, 600.0, 1200.0, 1800.0]
    assert moments_s(problem, np.full(60, np.inf), 4) == [0.0, 1200.0, 2400.0, 3600.0]


def test_the_axis_of_times_ends_soon_after_the_last_sightings() -> None:
    def seen(*times_s: float) -> Evaluation:
        times = np.array(times_s)
        weight = np.full(len(times), 1 / len(times))
        return Evaluation(times, weight, np.full(len(times), np.inf), PROBLEM.objective)

    assert shown_until_s(PROBLEM, [seen(100.0, 2000.0), seen(400.0)]) == pytest.approx(2300.0)
    few = seen(*[1000.0] * 999, 9000.0)  # one of a thousand does not stretch the axis
    assert shown_until_s(PROBLEM, [few]) == pytest.approx(1150.0)
    for late in (seen(9500.0), seen(np.inf)):
        assert shown_until_s(PROBLEM, [late]) == PROBLEM.horizon_s
    deadline = PROBLEM.replace(objective=Objective(10000.0, 4000.0))
    assert shown_until_s(deadline, [seen(100.0)]) == pytest.approx(4600.0)


@pytest.mark.parametrize(
    "plan",
    [WAIT, plan_of_legs(PROBLEM, "greedy", []), plan_of_legs(PROBLEM, "all", range(0, 120, 2))],
    ids=["waits", "flies nothing", "flies everything"],
)
def test_other_plans_have_a_picture_too(tmp_path: Path, plan: Plan) -> None:
    plan_picture(tmp_path / "p.png", PROBLEM, plan, evaluations=evaluated(plan))
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")


def test_nobody_there_has_a_picture(tmp_path: Path) -> None:
    nobody = PROBLEM.replace(futures=PROBLEM.futures.take(np.zeros(60, dtype=bool)))
    none = evaluate(LEGS.tracks, nobody.futures, nobody.sensor, nobody.objective)
    plan_picture(tmp_path / "p.png", nobody, LEGS, evaluations={"planned": none})
    assert (tmp_path / "p.png").exists()


def test_where(tmp_path: Path) -> None:
    state = state_at(PROBLEM.futures, PROBLEM.network, 1800.0)
    where_picture(tmp_path / "a.png", PROBLEM.network, state, title="where")
    where_picture(tmp_path / "b.png", PROBLEM.network, state, title="where")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    before = state_at(PROBLEM.futures, PROBLEM.network, -5.0)
    where_picture(tmp_path / "before.svg", PROBLEM.network, before)
    assert any("probability 0.0 %" in text for text in texts(tmp_path / "before.svg"))


def test_it_needs_no_screen_and_no_pyplot(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np; from pathlib import Path\n"
        "import test_picture as t\n"
        f"t.plan_picture(Path({str(tmp_path / 'p.png')!r}), t.PROBLEM, t.LEGS, "
        "evaluations=t.evaluated(t.LEGS))\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    here = Path(__file__).parent
    paths = [str(here), str(here.parent), str(here.parents[1])]
    environment = {"PYTHONPATH": ":".join(paths), "MPLBACKEND": "TkAgg", "PATH": "/usr/bin:/bin"}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)
    assert (tmp_path / "p.png").exists()


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        plan_picture(tmp_path / "file" / "p.png", PROBLEM, LEGS, evaluations=evaluated(LEGS))


def test_numbers_without_room_share_their_road_s_label(tmp_path: Path) -> None:
    """Road 2 is flown nine times: in one label, in order, three to a line."""
    order = [2, 3] * 9 + [41]
    plan = plan_of_legs(PROBLEM, "greedy", order)
    _, labels, _ = ordered(tmp_path / "p.svg", PROBLEM.network, pieces(plan))
    numbers = [text for label in labels for text in label.split("\n")]
    several = [text for text in numbers if ", " in text]
    assert [text for text in several if text.count(",") == 2] == several
    assert sorted(int(n) for text in several for n in text.split(",")) == list(range(1, 19))
    assert "19" in numbers


def test_the_labels_of_a_small_map_stay_in_the_picture(
    tmp_path: Path, berlin: OpenScenario
) -> None:
    with new_figure(tmp_path / "a.png", (7.6, 6.9), "") as figure:
        axes = axes_at(figure, 0.65, 0.6, 5.45, 5.45)
        View.of(berlin.network).frame(axes, numbered=True)
        figure.canvas.draw()
        for axis in (axes.xaxis, axes.yaxis):
            box = axis.label.get_window_extent()
            assert box.x0 > 0.0
            assert box.y0 > 0.0


@pytest.mark.parametrize(("seen_s", "unit"), [(900.0, "s"), (6000.0, "min")])
def test_moments_are_told_in_the_unit_of_the_curves(
    tmp_path: Path, seen_s: float, unit: str
) -> None:
    futures = PROBLEM.futures
    seen_at = np.linspace(seen_s / 2, seen_s, len(futures))
    found = Evaluation(seen_at, futures.weight, futures.end_s, PROBLEM.objective)
    plan_picture(tmp_path / "p.svg", PROBLEM, WAIT, evaluations={"planned": found})
    said = texts(tmp_path / "p.svg")
    assert f"time ({unit})" in said
    moments = [text.partition(":")[0] for text in said if text.endswith("% found")]
    assert len(moments) == 4
    assert {moment.split()[-1] for moment in moments} == {unit}


def test_where_targets_go_there_is_room_to_say_so(tmp_path: Path) -> None:
    futures = replace(PROBLEM.futures, gone=np.ones(len(PROBLEM.futures), bool))
    goes = PROBLEM.replace(futures=futures)
    missed = Evaluation(
        np.where(np.arange(len(futures)) % 2, np.inf, 6000.0),
        futures.weight,
        np.full(len(futures), 1000.0),
        goes.objective,
    )
    plan_picture(tmp_path / "p.svg", goes, WAIT, evaluations={"planned": missed})
    said = texts(tmp_path / "p.svg")
    above = [text for text in said if re.search(r"\d+ % (found|gone)$", text) and ": " in text]
    assert len([text for text in above if "found" in text]) == 3  # wider than the usual four
    assert "gone: has reached its goal, not found" in said
