"""Remarks say what the tables do not, and in plain words."""

import numpy as np

from planner.bounds.certificate import Certificate
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.detection.prospects import Prospects
from planner.report import sentences as remarks
from planner.report.tables import MethodRow
from planner.scenario.target import TargetSection


def evaluation(seed: int, low_s: float) -> Evaluation:
    seen_at = np.random.default_rng(seed).uniform(low_s, low_s + 100.0, 400)
    return Evaluation(seen_at, np.full(400, 1 / 400), np.full(400, 900.0), Objective(1000.0))


def test_the_hint_comes_when_fresh_targets_take_longer() -> None:
    good, bad = evaluation(1, 100.0), evaluation(2, 300.0)
    hint = remarks.particles_hint(good, bad, "iid")
    assert hint is not None
    assert hint.endswith("search.particles=1600 or --set search.sampling=sobol")
    assert remarks.particles_hint(bad, good, "iid") is None
    assert remarks.particles_hint(good, good, "iid") is None


def test_the_hint_counts_seconds_where_all_particles_were_seen_at_once() -> None:
    at_once = Evaluation(np.zeros(400), np.full(400, 1 / 400), np.zeros(400), Objective(1000.0))
    hint = remarks.particles_hint(at_once, evaluation(2, 300.0), "iid")
    assert hint is not None
    assert " s longer to find than the particles" in hint
    assert "%" not in hint.split(";")[0]


def test_the_hint_advises_nothing_that_is_done_already() -> None:
    hint = remarks.particles_hint(evaluation(1, 100.0), evaluation(2, 300.0), "sobol")
    assert hint is not None
    assert hint.endswith("search.particles=1600")


def test_a_method_that_cannot_be_used_says_why() -> None:
    rows = [MethodRow("greedy"), MethodRow("exact", why_not="60 roads are too many")]
    assert remarks.reasons(rows) == ["exact: 60 roads are too many"]
    rows += [MethodRow(name, why_not="it has a cycle") for name in ("exhaustive", "breadth-first")]
    assert remarks.reasons(rows)[1:] == ["exhaustive, breadth-first: it has a cycle"]


def test_a_certificate_in_seconds_and_as_probability() -> None:
    said = remarks.certificate_line(Certificate(1100.0, 1000.0, "roads"), None)
    assert "1,100 s; no road plan is below 1,000 s" in said
    assert said.endswith("gap 10.0 %")
    said = remarks.certificate_line(Certificate(0.6, 0.8, "free"), 600.0)
    assert "60.0 %; no flight is above 80.0 %" in said
    assert said.endswith("gap 25.0 %")


def test_a_certificate_of_any_flight_says_what_its_files_prove() -> None:
    said = remarks.certificate_line(Certificate(1100.0, 1000.0, "free", physics=880.0), None)
    assert said.endswith("gap 10.0 % (as computed; the files prove 880 s, gap 25.0 %)")
    said = remarks.certificate_line(Certificate(0.6, 0.8, "free", physics=1.0), 600.0)
    assert said.endswith("gap 25.0 % (as computed; the files prove 100.0 %, gap 40.0 %)")
    said = remarks.certificate_line(Certificate(0.6, 0.8, "free", physics=0.8), 600.0)
    assert said.endswith("(each target met as early as can be: this time gave no better bound)")


def test_a_gap_that_is_not_reached_and_a_limit() -> None:
    assert "10.0 %, is not reached" in remarks.gap_line(0.1)
    assert "below 1,000 s (10 sets)" in remarks.limit_line(1000.0, 10, None)
    assert "above 80.0 % (10 sets)" in remarks.limit_line(0.8, 10, 600.0)


def test_how_far_a_plan_is_from_the_best_in_the_world() -> None:
    evaluated = {"ci95_s": [1040.0, 1100.0], "targets": 4000}
    said = remarks.world_line(1000.0, evaluated, None)
    assert "takes 1,040 to 1,100 s on average (4,000 fresh targets, 95 %)" in said
    assert "at most 10.0 % above the best" in said
    said = remarks.world_line(0.6, {"found_by_probability": 0.5, "targets": 10_000}, 600.0)
    assert "with 49.0 % to 51.0 %" in said
    assert "at most 11.0 points below the best" in said


def test_few_particles_in_a_town_are_told() -> None:
    said = remarks.few_in_town(400)
    assert said is not None
    assert said.startswith("planned on 400 particles: in towns")
    assert remarks.few_in_town(1000) is None
    assert "search.particles=2000" in str(remarks.few_in_town(1000, sought=2))


def test_of_several_targets_those_found_so_far_are_counted() -> None:
    seen_at, target = np.array([10.0, 20.0, 30.0, np.inf]), np.array([0, 1, 0, 1])
    objective = Objective(1000.0, 500.0, sought=2)
    found = Evaluation(seen_at, np.full(4, 0.5), seen_at, objective, target=target)
    assert remarks.so_far(found).startswith("1.50 (")


def test_how_many_leave_the_map_and_what_no_flight_surpasses() -> None:
    ceiling = Evaluation(
        np.array([10.0, np.inf]), np.full(2, 0.5), np.full(2, 900.0), Objective(1000.0)
    )
    said = remarks.prospects_lines(Prospects(((300.0, 0.25), (600.0, 0.25)), 0.5, ceiling))
    assert said[1] == (
        "fresh targets that have left the map: 25 % by 0:05:00, 25 % by 0:10:00, 50 % by 0:16:40; "
        "no flight finds more of them than 50.0 % (each chased alone)"
    )
    assert "larger net" in said[0]
    assert len(remarks.prospects_lines(Prospects((), 0.1, ceiling))) == 1
    assert remarks.prospects_lines(Prospects((), 0.0, ceiling)) == []


def test_who_flees_is_said_not_to_react() -> None:
    flees = TargetSection.model_validate(
        {"start": "anywhere", "flees": {"for_s": 90, "factor": 1.3}}
    )
    said = remarks.flees_line([flees])
    assert said is not None
    assert "the target does not react to the UAV" in said
    assert remarks.flees_line([TargetSection(start="anywhere")]) is None
