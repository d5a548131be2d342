"""A scenario in a user's own traffic: which set rides where, and what is left in the folder."""

from pathlib import Path

import numpy as np
import pytest

from planner.futures.store import PARTICLES, Recording
from planner.mission.opening import open_scenario
from planner.mission.recorder import Recorder, _Set
from planner.parquet import numbers, read_table
from support.queues import grid_scenario


def realisations(recording: Recording) -> set[int]:
    """Return those that a recording's file names."""
    path = recording.path.with_name(PARTICLES)
    return {int(number) for number in numbers(path, read_table(path), "realisation")}


def contents(folder: Path) -> dict[str, tuple[bytes, int]]:
    """Return all that is in a folder, and when it was written."""
    return {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.iterdir()}


@pytest.mark.usefixtures("empty_cache")
def test_truths_ride_where_no_particle_has_been(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (folder := tmp_path / "user").mkdir()
    scenario = grid_scenario(folder)
    before = contents(folder)
    opened = open_scenario(scenario)
    recorder = Recorder(opened, workers=1)
    planning = recorder.planning()
    assert "12 particles rode in 2 realisations" in caplog.text
    assert "of the way that it comes when no other particle rides beside it" in caplog.text
    assert realisations(planning) == {0, 1}
    for name in (("judges",), ("bounding", 3)):
        recipe = recorder._recipe(_Set(opened.prior, 9, name))
        assert set(recipe.particles(opened.network).realisation) == {0, 1}
    assert realisations(recorder.evaluation(4)) == {2, 3}
    assert realisations(recorder.truths(1, seed=4)) <= {2, 3}
    assert contents(folder) == before
    again = recorder.planning().futures
    assert again.fates is not None
    assert again.fates.columns.keys() <= set(
        read_table(planning.path.with_name(PARTICLES)).column_names
    )
    np.testing.assert_array_equal(again.fates.alone_m, planning.futures.fates.alone_m)
