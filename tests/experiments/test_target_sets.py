"""Plans meet enumerated targets: against the planner's own figures where the two are the same."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.experiments.condition import Condition
from planner.experiments.experiment_file import read_experiment
from planner.experiments.results import rows_of
from planner.experiments.run_condition import run_condition
from planner.experiments.target_set import TargetSet
from planner.experiments.target_sets import targets_of
from planner.files import shipped
from planner.mission.recorder import Recorder
from planner.mission.trial import try_method
from planner.search.methods import method_named


def condition(scenario: str, method: str, *sets: TargetSet, **other: object) -> Condition:
    folder = shipped(scenario)
    assert folder is not None
    overrides = other.pop("overrides", ())
    return Condition(
        scenario=scenario,
        preset=None,
        overrides=overrides,  # type: ignore[arg-type]
        method=method,
        seed=1,
        targets=other.pop("targets", 0),  # type: ignore[arg-type]
        sets=sets,
        place=folder / "scenario.toml",
    )


def test_all_targets_are_those_planned_with_where_all_are() -> None:
    outcome = run_condition(condition("figure3", "greedy", TargetSet("all", by_route=True)))
    on_all = outcome.figures["sets"]["all"]
    assert on_all["expected_detection_time_s"] == pytest.approx(outcome.figures["planned_s"])
    routes = on_all["routes"]
    assert {name: share for name, (share, _) in routes.items()} == pytest.approx(
        dict.fromkeys(("AB BC CE", "AB BC CF", "AB BD DF", "AB BD DG"), 0.25)
    )
    mean = sum(share * time_s for share, time_s in routes.values())
    assert mean == pytest.approx(on_all["expected_detection_time_s"])


def test_a_route_of_its_own_has_that_routes_time() -> None:
    both = (TargetSet("all", by_route=True), TargetSet("one", route="AB BD DG"))
    sets = run_condition(condition("figure3", "rate", *both)).figures["sets"]
    _, time_s = sets["all"]["routes"]["AB BD DG"]
    assert sets["one"]["expected_detection_time_s"] == pytest.approx(time_s)


def test_a_sensor_that_misses_takes_longer() -> None:
    sets = (TargetSet("all"), TargetSet("misses", detects=0.5))
    found = run_condition(condition("figure3", "greedy", *sets)).figures["sets"]
    times = [found[one.name]["expected_detection_time_s"] for one in sets]
    assert times[0] < times[1]


def test_a_deadline_has_a_figure_of_its_own() -> None:
    deadline = ('search.objective="probability"', "search.by_s=500")
    both = (TargetSet("all"), TargetSet("misses", detects=0.5))
    one = condition("figure3", "best", *both, overrides=deadline)
    opened = one.opened()
    recorder = Recorder(opened, 1)
    futures = recorder.planning().futures
    seen = try_method(method_named("best"), recorder, futures, futures).evaluated
    sets = run_condition(one).figures["sets"]
    found = sets["all"]["found_by_probability"]
    assert 0.0 < found < sets["all"]["detection_probability"]
    assert found == pytest.approx(seen.found_by_probability(500.0))
    assert sets["misses"]["found_by_probability"] < found
    fresh = run_condition(replace(one, sets=(), targets=50)).figures
    there = recorder.evaluation(50).futures
    again = try_method(method_named("best"), recorder, futures, there).evaluated
    assert fresh["found_by_probability"] == again.found_by_probability(500.0)
    assert (
        run_condition(condition("figure3", "best", targets=50)).figures["found_by_probability"]
        is None
    )
    rows = rows_of(one, {"sets": sets})
    assert [row["found_by_probability"] for row in rows] == [
        found,
        sets["misses"]["found_by_probability"],
    ]


def test_the_truth_of_a_set_is_its_own() -> None:
    slow = TargetSet("slow", truth=("truth.speed_mps={ constant = 5 }",))
    met = targets_of(slow, condition("figure3", "wait"))
    assert len(met.futures) == 4
    length_m = 5 * met.futures.end_s
    assert np.ptp(length_m) < 1e4
    assert met.futures.weight.sum() == pytest.approx(1.0)


def test_ranges_are_taken_at_their_middles() -> None:
    uniform = ("truth.speed_mps={ uniform = [10, 20] }",)
    met = targets_of(TargetSet("five", truth=uniform, points=5), condition("figure3", "wait"))
    assert len(met.futures) == 4 * 5
    one = "AB BC CE"
    ends = np.sort(met.futures.end_s[[route == one for route in met.route]])
    np.testing.assert_allclose(ends[0] / ends, np.array([19, 17, 15, 13, 11]) / 19, rtol=1e-6)


@pytest.mark.parametrize(("points", "taken"), [(2, [10, 20]), (3, [10, 15, 20])])
def test_a_longer_list_is_thinned(points: int, taken: list[float]) -> None:
    listed = ("truth.speed_mps={ list = [10, 15, 20], probabilities = [0.4, 0.2, 0.4] }",)
    met = targets_of(TargetSet("few", truth=listed, points=points), condition("figure3", "wait"))
    ends = np.sort(met.futures.end_s[[route == "AB BC CE" for route in met.route]])
    np.testing.assert_allclose(ends[-1] / ends[::-1], np.array(taken) / 10, rtol=1e-6)
    assert met.futures.weight.sum() == pytest.approx(1.0)


def test_no_such_route() -> None:
    lost = TargetSet("lost", route="AB BC")
    with pytest.raises(InputError, match=r"sets\.lost\.route: no target takes it"):
        targets_of(lost, condition("figure3", "wait"))


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ("rout = 'AB'", r"sets\.a\.rout: is not a known key; did you mean route"),
        ("detects = 0", r"sets\.a\.detects: should not be 0; give a probability"),
        ("parks = 1", r"sets\.a\.parks: should be true or false, not 1"),
        ("points = 0", r"points: should not be 0; give a whole number"),
        ("speed_mps = { uniform = [25, 15] }", r"sets\.a\.truth\.speed_mps"),
    ],
)
def test_bad_sets_are_told_in_one_line(tmp_path: Path, keys: str, told: str) -> None:
    path = tmp_path / "bad.toml"
    text = f'scenario = "figure3"\n[factors]\nmethod = ["wait"]\n[sets.a]\n{keys}\n'
    path.write_text(text)
    with pytest.raises(InputError, match=told) as caught:
        read_experiment(path)
    assert "\n" not in str(caught.value)
