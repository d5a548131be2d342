"""Blocks of an experiment: what they share, what each has of its own, and the rows' columns."""

from pathlib import Path

import pytest

from planner.errors import InputError
from planner.experiments.condition import horizons_s
from planner.experiments.experiment import Experiment
from planner.experiments.experiment_file import read_experiment
from planner.experiments.results import rows_of
from planner.futures.traffic import Permit
from planner.paper.studies import STUDIES

TEXT = """
scenario = "figure3"
targets = 100
replicates = 3
[factors]
"uav.speed_mps" = [50, 100]
[set]
"search.horizon_s" = 3000
[[block]]
name = "plain"
replicates = 1
[block.factors]
method = ["wait", "exhaustive"]
[[block]]
name = "radius"
[block.set]
"search.depth" = 5
[block.factors]
method = ["greedy"]
"sensor.radius_m" = [100, 200]
[[block]]
name = "again"
replicates = 2
[block.factors]
method = ["wait"]
[sets.all]
[sets.one]
route = "AB BC CE"
"""


@pytest.fixture
def blocks(tmp_path: Path) -> Experiment:
    path = tmp_path / "blocks.toml"
    path.write_text(TEXT)
    return read_experiment(path)


def test_blocks_have_their_own_factors_settings_and_seeds(blocks: Experiment) -> None:
    conditions = blocks.conditions()
    # The last block's first seed is the first block's.
    assert len(conditions) == 2 * 2 + 2 * 2 * 3 + 2 * 1
    assert horizons_s(conditions) == {one.id: 3000.0 for one in conditions}
    radius = [c for c in conditions if c.levels["block"] == "radius"]
    assert {c.method for c in radius} == {"greedy"}
    assert {c.overrides[:2] for c in radius} == {("search.horizon_s=3000", "search.depth=5")}
    assert {c.seed for c in radius} == {1, 2, 3}
    assert {c.levels["block"] for c in conditions if c.method == "wait" and c.seed == 1} == {
        "plain"
    }


def test_every_row_has_a_level_of_every_factor(blocks: Experiment) -> None:
    conditions = blocks.conditions()
    assert {tuple(c.levels) for c in conditions} == {("block", "uav.speed_mps", "sensor.radius_m")}
    plain = next(c for c in conditions if c.levels["block"] == "plain")
    assert plain.levels["sensor.radius_m"] == 200.0  # as the scenario has it


def test_a_row_for_each_set_and_one_for_fresh_targets(blocks: Experiment) -> None:
    condition = blocks.conditions()[0]
    figures = {
        "expected_detection_time_s": 1.0,
        "ci95_low_s": 0.5,
        "roads": 3,
        "sets": {"all": {"expected_detection_time_s": 2.0, "routes": {}}, "one": {}},
    }
    rows = rows_of(condition, figures)
    assert [row["targets"] for row in rows] == ["fresh", "all", "one"]
    assert [row["expected_detection_time_s"] for row in rows] == [1.0, 2.0, None]
    assert [row["ci95_low_s"] for row in rows] == [0.5, None, None]
    assert {row["roads"] for row in rows} == {3}


def test_only_keeps_the_blocks_that_have_the_levels(blocks: Experiment) -> None:
    assert {c.method for c in blocks.only(["sensor.radius_m=100"]).conditions()} == {"greedy"}
    assert len(blocks.only(["block=plain", "uav.speed_mps=50"]).conditions()) == 2
    for choices, told in (
        (["sensor.radius_m=7"], r"--only sensor\.radius_m=7: is not among the levels; known: "),
        (["sensor.radus_m=7"], r"no factor 'sensor\.radus_m'; did you mean sensor\.radius_m\?"),
        (["block=plain", "sensor.radius_m=100"], "no block has all of these; choose fewer"),
    ):
        with pytest.raises(InputError, match=told):
            blocks.only(choices)


def test_quick_is_small_in_every_block(blocks: Experiment) -> None:
    quick = blocks.quick()
    assert len(quick.parts) == 3
    assert {c.seed for c in quick.conditions()} == {1, 2}
    assert {one.points for part in quick.parts for one in part.sets} == {2}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('study = "orderz"', "study: orderz is unknown; did you mean orders"),
        ("[block]\nname = 'x'", r"block: should be tables; write \[\[block\]\]"),
        ("[[block]]\nnam = 'x'", r"block\.nam: is not a known key; did you mean name"),
        ("[set]\n'uav.sped_mps' = 3\n[factors]\nmethod=['wait']", "sped_mps"),
        ("set = 3\n[factors]\nmethod=['wait']", "set: should be a table, not 3"),
        ("targets = 0\n[factors]\nmethod=['wait']", "targets: should not be 0"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(f'scenario = "figure3"\n{text}\n')
    with pytest.raises(InputError, match=told) as caught:
        read_experiment(path, STUDIES)
    assert "\n" not in str(caught.value)


def test_what_a_person_permits_goes_to_all_conditions(blocks: Experiment, tmp_path: Path) -> None:
    (tmp_path / "steer.py").write_text("def stand(traci): ...\n")
    allowed = Permit((tmp_path,))
    plain, wider = blocks.conditions(), blocks.permitted(allowed).conditions()
    assert {one.permit for one in wider} == {allowed}
    assert [one.id for one in wider] == [one.id for one in plain]  # it changes no figures
    steered = Permit((), f"{tmp_path / 'steer.py'}:stand")
    others = blocks.permitted(steered).conditions()
    assert {one.id for one in others} & {one.id for one in plain} == set()
    assert others[0].as_dict()["control"]["file"] == "steer.py"
