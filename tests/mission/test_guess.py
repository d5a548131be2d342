"""What the kinematic clock is worth on a scenario's own recording."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from planner.futures.futures import Futures
from planner.futures.kinematic import kinematic_futures
from planner.mission import guess
from planner.mission.guess import planning_clock_error, planning_guess, reach_m, told_reach
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.recorder import Recorder
from planner.network.signals import Signals, signal_cycle_s, signals_of
from support.command_line import TOWN, Commands
from support.queues import grid_scenario

FEW = ["search.particles=8", "search.horizon_s=310"]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


def opened(*overrides: str) -> OpenScenario:
    return open_scenario(TOWN, overrides=[*FEW, *overrides])


@pytest.mark.slow
@pytest.mark.parametrize("driving", ["free", "constant"])
def test_the_command_tells_how_far_the_clock_is_off(run: Commands, driving: str) -> None:
    options = [f'target.driving="{driving}"', *FEW]
    options = [word for option in options for word in ("--set", option)]
    found = run("futures", TOWN, *options, "--json").json["clock"]
    assert found["particles"] == 8
    assert found["at_180_s_m"] < 15.0
    assert found["at_300_s_m"] < 45.0
    told = run("futures", TOWN, *options)
    assert "a guess, before SUMO drives: 90 % of the particles are within 0." in told.err
    said = told.out
    assert f"the kinematic clock (a guess): {found['at_180_s_m']:.0f} m off at 180 s" in said


def test_the_reach_is_that_of_nine_in_ten() -> None:
    ends = 100.0 * np.arange(1, 12)  # of eleven particles from one place
    cloud = Futures(
        time_s=np.tile([0.0, 600.0], 11),
        x_m=np.zeros(22),
        y_m=np.stack([np.zeros(11), ends], axis=1).ravel(),
        first_knot=np.arange(0, 24, 2),
        weight=np.full(11, 1 / 11),
        gone=np.ones(11, bool),
    )
    assert reach_m(cloud, 600.0) == pytest.approx((1000.0, 1.0))
    assert reach_m(cloud, 300.0) == pytest.approx((500.0, 1.0))
    assert "90 % of the particles are within" in told_reach(cloud, 700.0)
    assert "within 0.5 km at 5 min, 1.0 km at 10 min of the middle" in told_reach(cloud, 700.0)
    assert "within 0.1 km at 1 min of the middle" in told_reach(cloud, 60.0)
    assert "all particles are gone" in told_reach(cloud.take(np.arange(0)), 600.0)


def test_the_reach_is_told_of_those_on_the_map_and_how_many_they_are() -> None:
    cloud = Futures(
        time_s=np.array([0.0, 600.0, 0.0, 400.0, 0.0, 400.0, 0.0, 400.0]),
        x_m=np.array([0.0, 600.0] + 3 * [0.0, 4000.0]),
        y_m=np.zeros(8),
        first_knot=np.arange(0, 10, 2),
        weight=np.full(4, 1 / 4),
        gone=np.ones(4, bool),
    )
    assert reach_m(cloud, 600.0) == pytest.approx((600.0, 0.25))
    said = told_reach(cloud, 700.0)
    assert "90 % of the particles that are on the map then are within" in said
    assert "0.6 km at 10 min (25 %) of the middle" in said
    assert "at 5 min (100 % of all are on it), " in said


def test_abstract_nets_have_no_clock(run: Commands) -> None:
    few = ["--set", "search.particles=4"]
    assert "kinematic" not in run("futures", "grid5x5", *few).out
    assert "clock" not in run("futures", "grid5x5", *few, "--json").json


def test_the_particles_are_those_that_are_recorded() -> None:
    recorder = Recorder(opened(), workers=1)
    particles, recording = recorder.planning_particles(), recorder.planning()
    edge_ids = np.array(recorder.opened.network.edge_ids)
    names = [" ".join(edge_ids[particles.route(k)]) for k in range(8)]
    assert list(recording.route) == names
    assert list(recording.speed_mps) == [particles.speeds(k)[0] for k in range(8)]


def test_what_is_calibrated_on_is_not_measured_on(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = Recorder(opened('target.driving="free"'), workers=1)
    recorded = recorder.planning().futures
    signals = signals_of(recorder.opened.network)
    actuated = dataclasses.replace(signals, actuated=np.ones(len(signals.minor), bool))
    monkeypatch.setattr(guess, "signals_of", lambda _: actuated)
    looked_at: list[int] = []

    def counted(network: object, particles: object, known: object, *, signals: Signals) -> None:
        looked_at.append(len(particles))  # type: ignore[arg-type]
        assert len(particles) == len(known)  # type: ignore[arg-type]

    monkeypatch.setattr(guess, "calibrated", counted)
    error = planning_clock_error(recorder, recorded)
    assert error is not None
    assert (looked_at, error.particles) == ([4], 4)


def test_a_net_whose_signals_cannot_be_read_has_none(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    whole = opened()
    recorded = Recorder(whole, workers=1).planning().futures
    text = whole.network.path.read_text(encoding="utf-8")
    broken = tmp_path / "broken.net.xml"
    broken.write_text(text.replace('duration="', 'duration="long'), encoding="utf-8")
    network = dataclasses.replace(whole.network, path=broken, sha256="f" * 64, source=None)
    recorder = Recorder(dataclasses.replace(whole, network=network), workers=1)
    assert planning_clock_error(recorder, recorded) is None
    assert "no kinematic clock: " in caplog.text


def test_in_traffic_signals_stand_as_at_the_traffics_own_time(tmp_path: Path) -> None:
    folder = grid_scenario(tmp_path)

    def at(time_s: float) -> Futures:
        overrides = [f"traffic.at={time_s}", "search.horizon_s=200"]
        found = planning_guess(Recorder(open_scenario(folder, overrides=overrides)))
        assert found is not None
        return found

    recorder = Recorder(open_scenario(folder, overrides=["search.horizon_s=200"]))
    network = recorder.opened.network
    first, later, again = at(30), at(52), at(30 + signal_cycle_s(network))
    particles = dataclasses.replace(recorder.planning_particles(), phase_s=np.full(len(first), 52))
    expected = kinematic_futures(network, particles, signals_of(network), horizon_s=200.0)
    assert np.array_equal(later.time_s, expected.time_s)
    assert not np.allclose(first.driven_m(200.0), later.driven_m(200.0))
    assert np.array_equal(first.time_s, again.time_s)
