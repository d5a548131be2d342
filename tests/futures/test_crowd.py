"""All vehicles of a realisation, as the session itself shows them."""

from pathlib import Path

import numpy as np
import pytest

from planner.futures.crowd import SAMPLE_S, crowds
from planner.mission.opening import open_scenario
from support.command_line import Commands
from support.queues import grid_scenario
from support.user_traffic import told


def test_a_crowd_is_the_traffic_of_its_realisation(tmp_path: Path) -> None:
    opened = open_scenario(grid_scenario(tmp_path))
    assert opened.traffic is not None
    first, again, other = crowds(opened.network, opened.traffic, (4, 4, 5), 40.0, workers=1)
    np.testing.assert_array_equal(first.x_m, again.x_m)
    assert first.x_m.tolist() != other.x_m.tolist()
    assert first.gone.all()
    assert first.time_s.min() == 0.0
    assert first.time_s.max() == 40.0
    steps = np.diff(first.time_s)[np.diff(first.particle) == 0]
    assert set(steps.tolist()) == {SAMPLE_S}
    # The session has gone on for ten steps of a second.
    there_m = first.positions(10.0)
    there_m = there_m[np.isfinite(there_m[:, 0])]
    shown = [(x_m, y_m) for _, x_m, y_m in told(opened, 4).places_m]
    assert sorted(map(tuple, there_m.tolist())) == sorted(shown)


@pytest.mark.long
def test_cars_that_look_like_the_target_make_flights_late(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = Commands(capsys)
    scenario = grid_scenario(tmp_path)
    alike = ("--set", "sensor.lookalike=1", "--set", "sensor.check_s=20")
    changes = (
        "search.horizon_s=100",
        "search.work=200",
        'uav.start={ node = "B0" }',
        "uav.aircraft=ideal",
    )
    small = ("--method", "rate", *(f"--set={one}" for one in changes), "--targets", 8, "-j", 1)
    run = tmp_path / "run"
    assert command("plan", scenario, *small, *alike, "-o", run).code == 0
    found = command(
        "fly", run, "--alarms", "--sequences", 1, "--targets", 8, "-j", 1, "--json"
    ).json
    assert found["late_s"] > found["without_alarms_s"]
    assert found["found_late"] <= found["found_without_alarms"] <= 1.0
    plain = tmp_path / "plain"
    assert command("plan", scenario, *small, "-o", plain).code == 0
    refused = command("fly", plain, "--alarms")
    assert refused.code == 2
    assert "set sensor.lookalike and sensor.check_s" in refused.err
    half = command("plan", scenario, *small, *alike[:2])
    assert "sensor.check_s: is missing; lookalike and check_s go together" in half.err
