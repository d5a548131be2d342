"""How many targets are driven: the paper's numbers on its nets, fewer in towns, from no clock."""

import itertools
from pathlib import Path

import pytest

from planner.belief.particles import Driving
from planner.mission import sample_sizes
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.recorder import Recorder
from planner.mission.sample_sizes import (
    Row,
    Sizes,
    fresh_targets,
    holdout_particles,
    sizes_for,
)
from support.command_line import TOWN


@pytest.mark.parametrize("name", ["grid5x5", "grid8x8", "figure3"])
def test_at_constant_speed_they_are_as_ever(name: str) -> None:
    opened = open_scenario(name, overrides=["search.particles=300"])
    assert fresh_targets(opened.scenario, opened.network) == 4000
    assert holdout_particles(opened.scenario, opened.network) == 600


def test_in_towns_there_are_fewer(berlin: OpenScenario) -> None:
    assert fresh_targets(berlin.scenario, berlin.network) < 4000
    assert holdout_particles(berlin.scenario, berlin.network) == berlin.scenario.search.particles
    other = open_scenario("berlin", overrides=["truth.driving=constant"])
    assert fresh_targets(other.scenario, other.network) == 4000


def test_there_is_a_number_for_every_net_and_horizon(berlin: OpenScenario) -> None:
    for driving, horizon_s in itertools.product(("constant", "free"), (1.0, 3600.0, 3601.0, 1e9)):
        kind: Driving = "free" if driving == "free" else "constant"
        assert sizes_for(berlin.network, kind, horizon_s).fresh >= 500


def test_the_larger_and_longer_the_fewer() -> None:
    free = [row for row in sample_sizes.TABLE if row.driving == "free"]
    for one, other in itertools.pairwise(free):
        assert (one.edges, one.horizon_s) < (other.edges, other.horizon_s)
        assert one.sizes.fresh > other.sizes.fresh


def test_the_recorder_goes_by_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = (Row("constant", 1e9, 1e9, Sizes(3, 7)), Row("free", 1e9, 1e9, Sizes(1, 4)))
    monkeypatch.setattr(sample_sizes, "TABLE", rows)
    for driving, sizes in (("constant", (15, 7)), ("free", (5, 4))):
        overrides = [f"target.driving={driving}", "search.particles=5", "search.horizon_s=100"]
        recorder = Recorder(open_scenario(TOWN, overrides=overrides), 1)
        found = len(recorder.holdout().futures), len(recorder.evaluation().futures)
        assert found == sizes
        assert len(recorder.evaluation(3).futures) == 3
        said = Recorder(open_scenario(TOWN, overrides=[*overrides, "search.targets=2"]), 1)
        assert len(said.evaluation().futures) == 2


def test_the_page_has_the_table() -> None:
    page = (Path(__file__).parents[2] / "docs" / "concepts.md").read_text(encoding="utf-8")
    cells = [line.split("|")[1:-1] for line in page.splitlines() if line.startswith("| ")]
    fresh = [row[-1].strip() for row in cells if len(row) == 5]
    assert fresh[1:] == [f"{row.sizes.fresh:,}" for row in sample_sizes.TABLE]
