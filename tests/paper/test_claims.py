"""Verdicts on the paper's claims turn with the numbers that they are drawn from."""

from typing import Any

import pytest

from planner.experiments.run import Results
from planner.paper import (
    claims_crossing,
    claims_distance,
    claims_knowledge,
    claims_orders,
    claims_speed,
)
from planner.paper.claims import Claim, ResultsByName, markdown_table, page
from planner.paper.figures import ALL, PATHS, U0
from planner.paper.optimum import BOUND
from planner.report.estimates import BEFORE_GOAL, EXPECTED, FOUND
from support.experiment_results import exhaustive_until, figure8, figure9


def judged(found: ResultsByName, judge: Any, start: str) -> Claim:
    (claim,) = [claim for claim in judge(found) if claim.text.startswith(start)]
    return claim


@pytest.mark.parametrize(
    ("km", "fails", "better"),
    [
        (120, "reproduced", "reproduced"),
        (60, "reproduced", "reproduced"),
        (150, "not reproduced", ""),
    ],
)
def test_where_exhaustive_search_fails(km: float, fails: str, better: str) -> None:
    found = {"figure8": figure8(exhaustive_until(km))}
    claim = judged(found, claims_distance.claims, "The exhaustive search fails")
    assert claim.verdict == fails
    if better:
        crossing = judged(found, claims_distance.claims, "Except for cases")
        assert crossing.verdict == better
        assert f"{km} km" in crossing.note


def test_paths_on_which_exhaustive_is_better_are_counted() -> None:
    results = figure8(exhaustive_until(60))
    greedy = {"block": "300 s", "method": "greedy"}
    counts = [
        claims_crossing.exhaustive_wins(results, greedy, {"targets": ALL, U0: u0})
        for u0 in (0.0, 60e3, 120e3)
    ]
    assert counts == [(1, 1.0, 1), (1, 1.0, 1), (0, 0, 1)]


@pytest.mark.parametrize(("before", "verdict"), [(0.9, "reproduced"), (0.4, "not reproduced")])
def test_before_the_goal(before: float, verdict: str) -> None:
    found = {"figure8": figure8(exhaustive_until(120), before=before)}
    start = "The simulation-aided search in most"
    assert judged(found, claims_distance.claims, start).verdict == verdict


def test_greedy_well_under_the_horizon_or_not() -> None:
    start = "In the simulation-aided search the detection time remains"
    found = {"figure8": figure8(exhaustive_until(120))}
    assert judged(found, claims_distance.claims, start).verdict == "reproduced"
    late = {"figure8": figure8(lambda _method, _u0: 9_990.0)}
    assert judged(late, claims_distance.claims, start).verdict == "not reproduced"


@pytest.mark.parametrize(
    ("late_s", "verdict"), [(8_900.0, "reproduced"), (9_100.0, "not reproduced")]
)
def test_well_under_is_by_a_tenth(late_s: float, verdict: str) -> None:
    found = {"figure8": figure8(lambda _method, _u0: late_s)}
    claim = judged(found, claims_distance.claims, "In the simulation-aided search the detection")
    assert claim.verdict == verdict
    assert "below 9,000 s, 10 % less" in claim.interpretation


def test_before_the_goal_up_to_some_distance() -> None:
    results = figure8(exhaustive_until(120))
    rows = tuple(row | {BEFORE_GOAL: 0.9 if row[U0] < 120e3 else 0.3} for row in results.rows)
    found = {"figure8": Results(rows, 0, results.figures)}
    claim = judged(found, claims_distance.claims, "The simulation-aided search in most")
    assert (claim.verdict, claim.note) == ("in part", "up to 60 km")


@pytest.mark.parametrize(
    ("longer_from_m", "verdict"), [(700e3, "not reproduced"), (0.0, "reproduced")]
)
def test_one_distance_makes_no_method_far_better(longer_from_m: float, verdict: str) -> None:
    def time_s(method: str, u0_m: float) -> float:
        return 3000.0 if method == "greedy" and u0_m >= longer_from_m else 2000.0

    claim = judged({"figure8": figure8(time_s)}, claims_distance.claims, "There may exist far")
    assert claim.verdict == verdict
    assert "to 50.0 %)" in claim.finding


def test_a_falling_step_is_named() -> None:
    start = "In all 4 experiments"
    rising = {"figure8": figure8(exhaustive_until(120))}
    assert judged(rising, claims_distance.claims, start).verdict == "reproduced"
    falling = {"figure8": figure8(lambda _method, u0: 5000.0 - u0 / 1000)}
    claim = judged(falling, claims_distance.claims, start)
    assert claim.verdict == "in part"
    assert "0 km to 60 km (-60 s)" in claim.table


@pytest.mark.parametrize(("slope", "verdict"), [(10.0, "reproduced"), (-10.0, "in part")])
def test_time_grows_with_speed(slope: float, verdict: str) -> None:
    found = {"figure9": figure9(slope)}
    claim = judged(found, claims_speed.claims, "In both search methods")
    assert claim.verdict == verdict
    earlier = judged(found, claims_speed.claims, "In exhaustive search a higher")
    assert earlier.verdict == "reproduced"
    assert "15 m/s: 150 km" in earlier.finding
    assert judged(found, claims_speed.claims, "The target reaches").verdict == "reproduced"
    assert "never finds up to 100.0 % of the targets at 15 m/s (at 700 km)" in claim.finding
    assert "the edge of what" not in claim.finding  # fast ones are missed as often


def test_slow_targets_are_the_edge_only_where_more_of_them_are_missed() -> None:
    results = figure9(10.0)
    rows = tuple(
        row | {FOUND: 0.75 if row["targets"] == f"{ALL}, 15 m/s" else 0.9} for row in results.rows
    )
    found = {"figure9": Results(rows, 0, results.figures)}
    claim = judged(found, claims_speed.claims, "In both search methods")
    assert "never finds up to 25.0 % of the targets at 15 m/s" in claim.finding
    assert "up to 10.0 % of those at 25 m/s" in claim.finding
    assert "the edge of what the UAV believes" in claim.finding


def test_single_paths_may_take_too_long_where_all_do_not() -> None:
    start = "In simulation-aided search the detection time stays"
    results = figure9(10.0)
    assert judged({"figure9": results}, claims_speed.claims, start).verdict == "reproduced"
    for late, verdict in (((PATHS[3],), "in part"), ((PATHS[3], ALL), "not reproduced")):
        rows = [
            row | {EXPECTED: 9_990.0} if row["targets"].startswith(late) else row
            for row in results.rows
        ]
        slow = {"figure9": Results(tuple(rows), 0, results.figures)}
        assert judged(slow, claims_speed.claims, start).verdict == verdict


def test_plans_beside_a_bound() -> None:
    rows = [
        {"what": what, "seed": seed, U0: 60e3, EXPECTED: value + seed, "gap": gap, "particles": 64}
        for what, value, gap in (("greedy", 1500.0, 0.5), (BOUND, 1000.0, 0.0))
        for seed in (1, 2)
    ]
    found = {"optimum": Results(tuple(rows), 2, {})}
    claim = judged(found, claims_orders.claims, "How far from optimal")
    assert "50 to 50 % above" in claim.finding
    assert "64 independent particles, 2 seeds" in claim.interpretation
    assert claim.table.endswith(
        "| 60 km | 1,002 s (995 to 1,008) | 1,502 s (1,495 to 1,508) | 50.0 % |"
    )


def test_random_orders_check_the_mean_of_all() -> None:
    row = {
        "target.at_sink": "gone",
        "uav.start.x_m": -30e3,
        "orders": 645_120,
        "futures": 90,
        "seed": 1,
    }
    values = (
        ("all orders: mean", 1000.0, 0.5, None),
        ("all orders: best", 800.0, 0.0, None),
        ("500 random orders: mean", 1030.0, 0.6, 20.0),
        ("greedy", 900.0, 0.0123, None),
    )
    rows = [
        row | {"what": what, EXPECTED: value, "orders_better": better, "standard_error_s": error}
        for what, value, better, error in values
    ]
    found = {"section4": Results(tuple(rows), 1, {})}
    claim = judged(found, claims_orders.claims, "7 road segments")
    assert "Figure 3, 90 futures" in claim.interpretation
    assert claim.finding.startswith("645,120 orders are flown")
    assert "is 1.5 to 1.5 standard errors" in claim.finding
    assert "| 1,030 s ± 20 |" in claim.table
    assert "| 900 s (1.23 %) |" in claim.table
    good = judged(found, claims_orders.claims, "The greedy algorithm works")
    assert good.verdict == "reproduced"
    assert "12.5 % to 12.5 % above" in good.finding


def section3(missed: float, certain: float) -> Results:
    orders = ("breadth-first", "optimised, as printed", "topological, shortest")
    rows = [
        {
            "order": order,
            claims_orders.TAKE_OFF: 300,
            claims_orders.TRANSIT: "true",
            FOUND: 1.0 - missed if order == "breadth-first" else certain,
            "roads": 10,
            "extra_movements": 1 if order.endswith("shortest") else 2,
            "never_flown": "ED" if order == "breadth-first" else "",
            "flight_ends_s": 900.0,
        }
        for order in orders
    ]
    return Results(tuple(rows), 3, {})


@pytest.mark.parametrize(
    ("missed", "certain", "verdicts"),
    [
        (0.1, 1.0, ("reproduced", "reproduced")),
        (0.0, 0.99, ("not reproduced", "not reproduced")),
    ],
)
def test_orders_that_find_and_that_miss(
    missed: float, certain: float, verdicts: tuple[str, str]
) -> None:
    found = {"section3": section3(missed, certain)}
    starts = ("Breadth-first", "A search that takes no road")
    claims = [judged(found, claims_orders.claims, start) for start in starts]
    assert tuple(claim.verdict for claim in claims) == verdicts
    assert claims[0].finding.endswith("Roads that are never flown: breadth-first: ED.")


@pytest.mark.parametrize(("printed", "verdict"), [(2, "reproduced"), (3, "not reproduced")])
def test_only_two_extra_movements(printed: int, verdict: str) -> None:
    rows = [
        row | {"extra_movements": printed} if row["order"].endswith("printed") else row
        for row in section3(0.1, 1.0).rows
    ]
    found = {"section3": Results(tuple(rows), 3, {})}
    claim = judged(found, claims_orders.claims, "An optimisation of the search order")
    assert claim.verdict == verdict
    assert "the least extra flight has 1" in claim.finding


def readings(gain_s: float) -> Results:
    rows = [
        {
            "id": f"{block} {depth} {seed}",
            "block": block,
            "method": "greedy",
            "seed": seed,
            "targets": ALL,
            U0: 60e3,
            "search.depth": depth,
            "greedy.miss": miss,
            EXPECTED: 2000.0 + 10 * seed + change,
            FOUND: 1.0,
        }
        for block, depth, miss, change in (
            (claims_knowledge.REFERENCE, 16, "horizon", 0.0),
            ("roads", 60, "horizon", -gain_s),
            ("miss", 16, "infinity", 500.0),
        )
        for seed in (1, 2)
    ]
    return Results(tuple(rows), len(rows), {})


@pytest.mark.parametrize(("gain_s", "verdict"), [(5.0, "reproduced"), (400.0, "not reproduced")])
def test_sixteen_roads_and_readings(gain_s: float, verdict: str) -> None:
    found = {"readings": readings(gain_s)}
    assert judged(found, claims_knowledge.claims, "A path of 16").verdict == verdict
    claim = judged(found, claims_knowledge.claims, "Which reading")
    assert "`greedy.miss = infinity` | +500 s" in claim.table
    assert "is 25 %: `greedy.miss = infinity` at 60 km, +500 s" in claim.finding


def test_a_change_within_chance_is_not_the_largest() -> None:
    results = readings(5.0)
    noisy = [
        row | {EXPECTED: row[EXPECTED] + 1e3 * (row["block"] == "miss" and row["seed"] == 1)}
        for row in results.rows
    ]
    claim = judged(
        {"readings": Results(tuple(noisy), 0, {})}, claims_knowledge.claims, "Which reading"
    )
    assert "is 0 %: none is more than chance" in claim.finding


def beliefs(blind_s: float, turns_s: float) -> Results:
    base, known, turns = claims_knowledge.BASE, claims_knowledge.KNOWN, claims_knowledge.TURNS
    values = {
        (base, known): 2000.0,
        (base, turns): 2000.0 + turns_s,
        (base, "stop on the way"): 2600.0,
        ("start anywhere", known): 2000.0 + blind_s,
        (turns, turns): 2000.0,
    }
    rows = [
        {
            "block": block,
            "method": "greedy",
            "targets": targets,
            U0: 60e3,
            "seed": seed,
            EXPECTED: value + seed,
            FOUND: 0.9,
            "found_before_goal_probability": 0.8,
        }
        for (block, targets), value in values.items()
        for seed in (1, 2)
    ]
    return Results(tuple(rows), len(rows), {})


@pytest.mark.parametrize(
    ("blind_s", "turns_s", "verdict"),
    [(300.0, 50.0, "reproduced"), (300.0, -50.0, "in part"), (-300.0, -50.0, "not reproduced")],
)
def test_knowledge_is_worth_something(blind_s: float, turns_s: float, verdict: str) -> None:
    found = {"beliefs": beliefs(blind_s, turns_s)}
    claim = judged(found, claims_knowledge.claims, "A system that uses all")
    assert claim.verdict == verdict
    assert (
        f"turns taken for equal | greedy | 60 km | {claims_knowledge.TURNS} | {turns_s:+.0f} s"
        in (claim.table)
    )
    wrong = judged(found, claims_knowledge.claims, "What does a wrong belief cost?")
    assert wrong.finding == "It costs greedy at 60 km most, +600 s: stop on the way."


def test_the_page_has_each_claim_once_in_short_and_in_full() -> None:
    claim = Claim("It works", "Section 1", "as printed", "in part", "By 3 s.", "| a |\n|---|")
    text = page([claim, claim])
    assert text.count("It works") == 4
    assert '<a id="claim-2"></a>' in text
    assert "*Section 1.* **In part.** By 3 s." in text


def test_how_far_a_claim_holds_stands_beside_its_verdict() -> None:
    claim = Claim("It works", "Section 1", "as printed", "in part", "", note="up to 60 km")
    assert "| Section 1 | **in part**: up to 60 km |" in page([claim])


def test_a_table_in_markdown() -> None:
    assert markdown_table(["a", "b"], [("x", "1")]) == "| a | b |\n|---|--:|\n| x | 1 |"
