"""Tables say the figures, and are plain where there is no terminal."""

import io
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.cli.doctor import Finding, doctor_table
from planner.cli.printing import console
from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.futures.state_at import UNKNOWN, RoadState, by_road, state_at
from planner.messages import percent
from planner.network.georeference import coordinates
from planner.report.finds import targets_table
from planner.report.flight_tables import legs_table, waypoints_table
from planner.report.formats import Column, FittingTable, _shared_out
from planner.report.run_files import compare_cells
from planner.report.tables import (
    OTHERS,
    MethodRow,
    compare_table,
    flights_table,
    plan_table,
)
from planner.report.where import where_content, where_table
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from support.instances import figure3, physics_futures

NET = figure3()


def evaluation(seen_s: list[float], *, weight: float = 1.0) -> Evaluation:
    n = len(seen_s)
    return Evaluation(
        np.array(seen_s), np.full(n, weight / n), np.full(n, 900.0), Objective(1000.0)
    )


PLANNED = evaluation([100, 200, 300, np.inf])
FRESH = evaluation([150, 250, 350, 950, np.inf, 250, 250, 250, 250, 250])
ROW = MethodRow("greedy", PLANNED, FRESH, roads=7, took_s=0.0186)


@pytest.fixture
def printed(monkeypatch: pytest.MonkeyPatch) -> Callable[[object], str]:
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.delenv("FORCE_COLOR", raising=False)

    def text(table: object) -> str:
        file = io.StringIO()
        console(file).print(table)
        return file.getvalue()

    return text


def line(text: str, start: str) -> list[str]:
    (found,) = [row for row in text.splitlines() if row.strip().startswith(start)]
    return re.split(r"\s{2,}", found.strip())


def test_a_share_that_rounds_to_nothing_is_not_below_nothing() -> None:
    assert percent(-0.0004, sign=True) == "+0.0 %"
    assert percent(-0.0004) == "0.0 %"
    assert percent(-0.0006, sign=True) == "-0.1 %"


def test_plan(printed: Callable[[object], str]) -> None:
    text = printed(plan_table(ROW))
    _, planned, fresh, interval = line(text, "expected detection time")
    assert planned == "400 s"
    assert fresh == "395 s"
    low_s, high_s = FRESH.ci95_s
    assert interval == f"{low_s:,.0f} s .. {high_s:,.0f} s"
    assert line(text, "found  ")[1:3] == ["75.0 %", "90.0 %"]
    assert line(text, "found before")[1:3] == ["75.0 %", "80.0 %"]
    assert line(text, "difference")[1] == "5 s sooner"
    found = percent(FRESH.detection_probability)
    mean_s = FRESH.expected_detection_time_s
    by = clock(FRESH.objective.horizon_s)
    said = f"{ROW.method}: finds {found} by {by}, on average after {clock(mean_s)} (never"
    assert said in " ".join(text.split())


def test_in_towns_nothing_is_said_of_goals(printed: Callable[[object], str]) -> None:
    for on_grid, in_town in (
        (plan_table(ROW), plan_table(ROW, in_town=True)),
        (flights_table(FRESH), flights_table(FRESH, in_town=True)),
        (compare_table([ROW]), compare_table([ROW], in_town=True)),
    ):
        assert "goal" in printed(on_grid)
        assert "goal" not in printed(in_town)
    assert line(printed(compare_table([ROW], in_town=True)), "greedy")[3:6] == [
        "90.0 %",
        "400 s",
        "7",
    ]


def test_nothing_has_no_sign_that_says_less(printed: Callable[[object], str]) -> None:
    earlier = replace(FRESH, seen_at=FRESH.seen_at - 1e-6)
    text = printed(plan_table(replace(ROW, planned=earlier, evaluated=FRESH)))
    assert line(text, "difference")[1] == "0 s sooner"


@pytest.mark.parametrize("width", [120, 80, 60, 40])
def test_figures_stay_whole_in_any_window(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    file = io.StringIO()
    console(file).print(compare_table([replace(ROW, method="exhaustive-shortest")], "a title"))
    text = file.getvalue()
    assert all(len(row.rstrip()) <= width for row in text.splitlines())
    cells = line(text, "exhaustive-shortest")
    assert cells[1] == "395 s"
    low_s, high_s = FRESH.ci95_s
    whole = f"{low_s:,.0f} .. {high_s:,.0f}"
    assert (whole in text) == (width > 40)
    assert ("a wider window also shows" in text) == (width < 120)


def test_other_targets_are_named_and_not_compared(printed: Callable[[object], str]) -> None:
    text = printed(plan_table(replace(ROW, fresh=OTHERS)))
    assert "of the belief" in text
    assert "difference" not in text


def test_rows_end_at_the_horizon_and_after_many(printed: Callable[[object], str]) -> None:
    futures = physics_futures(NET, [["AB", "BC"]], 0.0, 10.0)
    problem = Problem(NET, futures, Uav(0.0, 0.0, 0.0, 100.0), Sensor(100.0), PLANNED.objective)
    plan = plan_of_legs(problem, "any", [0, 1] * 50)
    lasts_s = float(plan.legs[0][0].end_s)
    text = printed(legs_table(plan, NET, until_s=10.5 * lasts_s))
    assert line(text, "11 ")[:2] == ["11", "AB"]
    assert "\n  12 " not in text
    text = printed(legs_table(plan, NET))
    assert "60 more" in text
    assert "plan.json" in text


def test_a_flight_off_the_roads_is_a_table_of_stays(printed: Callable[[object], str]) -> None:
    track = Track(
        np.array([0.0, 60.0, 120.0, 300.0]),
        np.array([0.0, 6e3, 6e3, 6e3]),
        np.array([0.0, 0.0, 0.0, -9e3]),
        np.array([[0.0, 300.0]]),
    )
    plan = Plan("best", (track,), ((),))
    text = printed(waypoints_table(plan, NET))
    assert line(text, "2 ") == ["2", "6,000", "0", "0:01:00", "0:02:00"]
    assert line(text, "3 ") == ["3", "6,000", "-9,000", "0:05:00", "0:05:00"]
    assert "street" not in text


def test_bends_that_do_not_matter_to_the_sensor_are_no_waypoints(
    printed: Callable[[object], str],
) -> None:
    track = Track(
        np.array([0.0, 40.0, 41.0, 60.0, 61.0, 62.0, 90.0]),
        np.array([0.0, 0.0, 15.0, 300.0, 308.0, 310.0, 310.0]),
        np.array([0.0, 0.0, 1.0, 0.0, 2.0, 10.0, 400.0]),
        np.array([[40.0, 90.0]]),
    )
    plan = Plan("best", (track,), ((),))
    assert line(printed(waypoints_table(plan, NET)), "6 ")[:2] == ["6", "310"]
    text = printed(waypoints_table(plan, NET, radius_m=60.0))
    assert line(text, "1 ") == ["1", "0", "0", "0:00:00", "0:00:40"]  # where it stays
    assert line(text, "2 ")[1:3] in (["300", "0"], ["308", "2"], ["310", "10"])
    assert line(text, "3 ") == ["3", "310", "400", "0:01:30", "0:01:30"]


def test_in_a_town_a_waypoint_is_a_street_and_a_place_on_the_earth(
    printed: Callable[[object], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    utm = "+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
    streets = tuple({"AB": "Main Street"}.get(name, "") for name in NET.edge_ids)
    town = replace(NET, edge_street=streets, projection=utm, net_offset_m=(-294e3, -5498e3))
    track = Track([0.0, 60.0, 120.0], [0.0, 2e3, 2e3], [0.0, 0.0, 200.0], [[0.0, 120.0]])
    plan = Plan("best", (track,), ((),))
    monkeypatch.setenv("COLUMNS", "80")
    text = printed(waypoints_table(plan, town))
    place = coordinates(town, np.array([2e3, 0.0]))
    assert re.fullmatch(r"49\.\d{5} N 6\.\d{5} E", place)
    assert line(text, "2 ") == ["2", "Main Street", place, "0:01:00", "0:01:00"]
    assert line(text, "3 ")[1] == "near Main Street"
    assert "x (m)" not in text


def test_intervals_from_few_targets_are_called_rough(printed: Callable[[object], str]) -> None:
    many = evaluation([150.0, np.inf] * 50)
    tables = {
        plan_table: (ROW, replace(ROW, evaluated=many)),
        compare_table: ([ROW, replace(ROW, evaluated=many)], [replace(ROW, evaluated=many)]),
        flights_table: (FRESH, many),
    }
    for table, (few, enough) in tables.items():
        assert "intervals from 10 targets are rough" in printed(table(few))  # type: ignore[operator]
        assert "rough" not in printed(table(enough))  # type: ignore[operator]


def test_compare_keeps_the_row_of_a_method_that_does_not_apply(
    printed: Callable[[object], str],
) -> None:
    rows = [ROW, MethodRow("exact", why_not="60 roads are too many")]
    text = printed(compare_table(rows, "grid [5x5]"))
    assert text.startswith("grid [5x5]")
    assert "395 s" in text
    assert "19 ms" in text
    assert set(line(text, "exact")[1:]) == {"-"}


def test_patterns_stand_apart_in_one_group(printed: Callable[[object], str]) -> None:
    names = ("rate", "hover", "spiral", "wait")
    text = printed(compare_table([replace(ROW, method=name) for name in names]))
    words = [(row.split() or [""])[0] for row in text.splitlines()]
    assert words[words.index("rate") :][:6] == ["rate", "", "hover", "spiral", "", "wait"]
    assert printed(compare_table([]))


def test_a_deadline_has_its_own_line_and_column(printed: Callable[[object], str]) -> None:
    planned, fresh = (
        replace(result, objective=Objective(1000.0, 240.0)) for result in (PLANNED, FRESH)
    )
    row = MethodRow("greedy", planned, fresh, roads=7)
    assert line(printed(plan_table(row)), "found by")[:3] == [
        "found by 0:04:00",
        "50.0 %",
        "10.0 %",
    ]
    assert line(printed(flights_table(fresh)), "found by")[1] == "10.0 %"
    table = printed(compare_table([row, MethodRow("exact", why_not="no")]))
    assert "found by" in table
    low, high = fresh.found_by_interval(240.0)
    within = f"{100 * low:.1f} % .. {100 * high:.1f} %"
    assert line(table, "greedy")[1:4] == ["10.0 %", within, "395 s"]
    cells = compare_cells(row)
    assert (cells["found_by_ci95_low"], cells["found_by_ci95_high"]) == (low, high)
    assert "found by" not in printed(compare_table([ROW]))


def test_where(printed: Callable[[object], str]) -> None:
    futures = physics_futures(
        NET, [["AB"], ["AB"], ["AB", "BC"], ["AB", "BD"]], 0.0, [10, 10, 30, 30]
    )
    state = state_at(futures, NET, 200.0)
    rows = by_road(state, NET)
    text = printed(where_table(rows, NET, time_s=200.0, elsewhere_probability=0.0))
    assert "0:03:20" in text
    assert line(text, "AB")[1] == "50.0 %"
    assert "2,000" in " ".join(line(text, "AB"))
    assert "10.0" in " ".join(line(text, "AB"))
    assert "not on the roads" not in text
    short = printed(where_table(rows, NET, time_s=200.0, elsewhere_probability=0.25, most=1))
    assert line(short, "2 other roads")[1] == "50.0 %"
    assert line(short, "not on the roads")[1] == "25.0 %"


def test_what_is_unknown_is_null_in_json() -> None:
    lost = RoadState(UNKNOWN, UNKNOWN, 0.5, (math.nan,) * 3, (1.0, 2.0, 3.0), (4.0, 5.0))
    content = where_content([lost], NET, time_s=1.0, elsewhere_probability=0.5)
    assert content["roads"][0]["distance_m"] == [None, None, None]
    json.dumps(content, allow_nan=False)


def test_legs_name_the_ends_as_flown(printed: Callable[[object], str]) -> None:
    futures = physics_futures(NET, [["AB"]], 0.0, 10.0)
    problem = Problem(NET, futures, Uav(0.0, 0.0, 0.0, 100.0), Sensor(200.0), Objective(3600.0))
    text = printed(legs_table(plan_of_legs(problem, "any", [0, 3]), NET))
    assert line(text, "1 ") == ["1", "AB", "A", "B", "0:00:00", "0:00:50"]
    assert line(text, "2 ")[:4] == ["2", "BC", "C", "B"]


def test_where_there_are_names_of_streets_roads_are_called_by_them(
    printed: Callable[[object], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    streets = {"AB": "Main Street", "BC": "High Street", "BD": "Low Street"}
    net = replace(NET, edge_street=tuple(streets.get(name, "") for name in NET.edge_ids))
    futures = physics_futures(net, [["AB"], ["BC"]], 0.0, [10.0, 10.0])
    problem = Problem(net, futures, Uav(0.0, 0.0, 0.0, 100.0), Sensor(200.0), Objective(3600.0))
    text = printed(legs_table(plan_of_legs(problem, "any", [0, 3]), net))
    assert "Main Street, towards High Street" in " ".join(text.split())
    assert line(text, "1 ")[-3:] == ["AB", "0:00:00", "0:00:50"]
    state = state_at(futures, net, 20.0)
    where = where_table(by_road(state, net), net, time_s=20.0, elsewhere_probability=0.1)
    text = printed(where)
    assert "Main Street, towards High Street" in " ".join(text.split())
    assert "m from its start" in text
    assert "AB" in text


def test_flights(printed: Callable[[object], str]) -> None:
    text = printed(flights_table(FRESH))
    assert "10 flights" in text
    assert line(text, "found before")[1] == "80.0 %"


def test_doctor_marks_faults(printed: Callable[[object], str]) -> None:
    text = printed(doctor_table([Finding("a", True, "1.0"), Finding("b", False, "[x]", "do so")]))
    assert line(text, "ok")[1] == "a"
    assert line(text, "FAULT") == ["FAULT", "b", "[x]", "do so"]


def test_no_terminal_means_no_colour_and_no_folding(printed: Callable[[object], str]) -> None:
    text = printed(doctor_table([Finding("b", False, "x" * 90, "y")]))
    assert "\x1b" not in text
    assert "x" * 90 in text


def test_no_color_is_respected(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    def printed_to_terminal() -> str:
        file = Terminal()
        console(file).print(doctor_table([Finding("b", False, "x", "y")]))
        return file.getvalue()

    monkeypatch.setenv("TERM", "xterm-256color")
    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    assert "\x1b[1;31m" in printed_to_terminal()
    monkeypatch.setenv("NO_COLOR", "1")
    assert "31m" not in printed_to_terminal()


def test_several_targets_are_compared_by_sums(printed: Callable[[object], str]) -> None:
    seen_at = np.array([100.0, 400.0, 200.0, np.inf])
    found = Evaluation(
        seen_at,
        np.array([0.5, 0.5, 0.5, 0.4]),
        np.full(4, 900.0),
        Objective(1000.0, 300.0, sought=2),
        target=np.array([0, 0, 1, 1]),
    )
    row = MethodRow("rate", found, found)
    cells = line(printed(compare_table([row])), "rate")
    # The pairs' times: 0.5 * 100 + 0.5 * 400, and 0.5 * 200 + 0.5 * 1000.
    for cell in ("1.00", "850 s", "200 s", "650 s", "1.50"):
        assert cell in cells
    table = targets_table(found, ("red", "blue"))
    assert line(printed(table), "blue")[1] == "600 s"
    assert line(printed(table), "all found")[1] == "650 s"


@pytest.mark.parametrize("width", [44, 50, 60, 80, 120])
def test_only_what_wraps_gets_narrower(
    width: int, printed: Callable[[object], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is the widest column: a cell that may not be parted is there as a whole."""
    monkeypatch.setenv("COLUMNS", str(width))
    wide, last = "1 234 567 890 12", "0.0 1.1"
    table = FittingTable("", (Column("a", left=True, wraps=True), Column("b"), Column("c", rank=1)))
    table.add_row("Ringstraße, towards the ends of it all, or not", wide, last)
    text = printed(table)
    assert wide in text
    assert (last in text) == ("wider window" not in text) == (width >= 44)
    assert max(map(len, text.splitlines())) <= width


@pytest.mark.parametrize(
    ("room", "wanted", "given"),
    [
        (10, [3, 4], [3, 4]),
        (10, [20, 3, 20], [3, 3, 4]),
        (7, [1, 0, 20], [1, 0, 6]),
        (0, [5, 5], [0, 0]),
        (5, [], []),
    ],
)
def test_room_is_shared_out(room: int, wanted: list[int], given: list[int]) -> None:
    """Who wants little gets it all, and what is over is for all others alike."""
    assert _shared_out(room, wanted) == given


@pytest.mark.parametrize("width", range(20, 40))
def test_a_number_keeps_to_its_unit_in_a_cell_that_wraps(
    width: int, printed: Callable[[object], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    table = FittingTable("", (Column("question"), Column("answers", left=True, wraps=True)))
    table.add_row("which", "ring-road 12 %, main-street 5 %, another 0 %, in 30 min")
    text = printed(table)
    for part in ("12 %", "5 %", "0 %", "30 min"):
        assert part in text
