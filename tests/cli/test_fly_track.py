"""`planner fly --track`: a recorded flight beside its plan, and where the target can still be."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from planner.cli import main
from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.law import FlightLaw
from planner.futures.futures import Futures
from planner.mission.debrief import Wanted, debrief, reading_of
from planner.mission.opening import open_scenario
from planner.mission.recorder import Recorder
from planner.mission.run_folder import open_run
from planner.network.georeference import lonlat
from planner.telemetry.flown import Reading, flown
from planner.telemetry.read import read_log
from support.command_line import Commands, Said
from support.recorded_flights import FOLDER
from support.recordings import SEEN, Point, gpx
from support.town_on_earth import SETS, on_earth

SHORT = ("--set", "search.horizon_s=1800", "--set", "sensor.radius_m=20")
SMALL = ("--method", "rate", "--set", "search.particles=20", "--targets", "200")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.fixture(scope="module")
def town_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in the town, which says where it lies and when the target was seen, and its files."""
    folder = tmp_path_factory.mktemp("town")
    place, out = str(on_earth(folder)), str(folder / "run")
    assert main(["plan", place, *SMALL, *SETS, *SHORT, "-o", out, "--json"]) == 0
    assert main(["export", out, "--tolerance", "0", "--autopilot", "px4", "--json"]) == 0
    return folder / "run"


def rows(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def refused(said: Said, line: str) -> None:
    assert said.code == 2
    assert len(said.err.splitlines()) == 1, said.err
    assert line in said.err


@pytest.mark.parametrize("name", ["flight.gpx", "flight.csv", "flight.fcd.xml"])
def test_an_exported_flight_read_back_has_its_figures(
    run: Commands, town_run: Path, name: str
) -> None:
    told = run("fly", town_run, "--track", town_run / "flight" / name, "--json").json
    stored = json.loads((town_run / "plan.json").read_text())["evaluated"]
    for key in ("as_planned", "as_flown"):
        expected_s = stored["expected_detection_time_s"]
        assert told[key]["expected_detection_time_s"] == pytest.approx(expected_s, abs=1.0)
    assert told["targets"] == stored["targets"]
    assert told["clock"] == ("seconds" if "fcd" in name else "utc")
    assert told["lift_off_s"] == pytest.approx(0.0, abs=1.5)
    assert told["breaks"] == 0
    by = {row["by_s"]: row for row in told["beside"] if row["by_s"] is not None}
    assert {300.0, 600.0, 1200.0, 1800.0} == set(by)
    assert 0.1 < by[300.0]["planned"] < 0.9
    for row in by.values():
        low, high = row["flown_minus_planned_ci95"]
        assert low <= row["flown_minus_planned"] <= high
        assert row["flown_minus_planned"] == pytest.approx(row["flown"] - row["planned"])


@pytest.fixture(scope="module")
def many(town_run: Path) -> Futures:
    """Ten thousand cars in the town, by the kinematic clock."""
    recorder = Recorder(open_run(town_run)[0], 1)
    found = recorder.proposals(recorder.planning().futures)
    assert found is not None
    return found


@pytest.mark.parametrize("name", ["flight.gpx", "flight.csv", "flight.fcd.xml"])
def test_read_back_it_finds_as_many_as_the_plan(town_run: Path, name: str, many: Futures) -> None:
    opened, stored = open_run(town_run)
    log = read_log(town_run / "flight" / name)
    flight = flown(log, opened.network, reading_of(opened, stored, Wanted()))
    found = debrief(flight, stored, many)
    for by_s in range(120, 1200, 60):
        planned = found.planned.found_by_probability(by_s)
        assert found.flown.evaluation.found_by_probability(by_s) == pytest.approx(planned, abs=1e-3)
    assert 0.1 < found.planned.found_by_probability(180.0) < 0.9


def test_a_phone_s_jitter_and_doubled_points_matter_little(
    town_run: Path, tmp_path: Path, many: Futures
) -> None:
    opened, stored = open_run(town_run)
    clean = read_log(town_run / "flight" / "flight.gpx")
    rng, sigma_deg = np.random.default_rng(1), 4.0 / 111_000.0
    columns = (clean.utc_s - SEEN.timestamp(), clean.lat_deg, clean.lon_deg, clean.height_m)
    noisy = [
        Point(round(t), *(rng.normal(lat_lon, sigma_deg) for lat_lon in place), rng.normal(h, 2.0))
        for t, *place, h in zip(*(column.tolist() for column in columns), strict=True)
    ]
    (tmp_path / "phone.gpx").write_text(gpx([noisy]))
    reading = reading_of(opened, stored, Wanted())
    flight = flown(read_log(tmp_path / "phone.gpx"), opened.network, reading)
    assert flight.points > len(flight.track.time_s)  # whole seconds: some are there twice
    assert flight.breaks == 0
    found = debrief(flight, stored, many)
    for by_s in (180.0, 300.0, 600.0):
        planned = found.planned.found_by_probability(by_s)
        assert found.flown.evaluation.found_by_probability(by_s) == pytest.approx(planned, abs=0.02)


def test_a_flight_that_is_late_and_has_a_break(
    run: Commands, town_run: Path, tmp_path: Path
) -> None:
    points = [
        Point(float(row["time_s"]), float(row["lat"]), float(row["lon"]), float(row["height_m"]))
        for row in rows(town_run / "flight" / "flight.csv")
    ]
    second = [p.time_s for p in points]
    every = np.arange(second[0], second[-1], 2.0)
    columns = [np.interp(every, second, [p[k] for p in points]) for k in (1, 2, 3)]
    late = [Point(60.0 + t, *p) for t, *p in zip(every.tolist(), *columns, strict=True)]
    (tmp_path / "late.gpx").write_text(gpx([late[:30], late[90:]]))
    out = tmp_path / "out"
    said = run("fly", town_run, "--track", tmp_path / "late.gpx", "-o", out)
    assert said.code == 0, said.err
    assert {path.name for path in out.iterdir()} == {"flights.csv", "where.csv", "where.png"}
    for words in (
        "1 break, 0:02:02 in all",
        "clock: its times of day, from target.sighted_at on (2026",
        "flown minus",
    ):
        assert words in said.out
    assert "it can still be here" in " ".join(said.out.split())
    assert f"written to {out}" in " ".join(said.out.split())
    assert max(map(len, said.out.splitlines())) <= 120
    refused(run("fly", town_run, "--track", tmp_path / "late.gpx", "-o", out), "--force")
    told = run("fly", town_run, "--track", tmp_path / "late.gpx", "--json").json
    seen = [row for row in rows(out / "flights.csv") if row["found"] == "1"]
    assert len(seen) / 200 == pytest.approx(told["as_flown"]["detection_probability"])
    assert told["as_flown"]["detection_probability"] < told["as_planned"]["detection_probability"]
    assert not (town_run / "flights.csv").exists()


def test_what_is_left_is_what_it_has_not_seen(run: Commands, town_run: Path) -> None:
    track = ("--track", town_run / "flight" / "flight.csv", "--json")
    early, later = (run("fly", town_run, *track, "--at", t).json for t in (0, 1500))
    untouched = run("where", town_run / "run.json", "--at", 0, "--json").json
    assert early["still"]["elsewhere_probability"] == pytest.approx(
        untouched["elsewhere_probability"], abs=0.05
    )
    for told in (early, later):
        still = told["still"]
        total = sum(road["probability"] for road in still["roads"])
        assert total + still["elsewhere_probability"] == pytest.approx(1.0)
    assert later["still"]["time_s"] == 1500.0
    refused(run("fly", town_run, *track, "--at", "2000"), "the search is from 0 to 1800 s")


def test_options_that_do_not_go_together(run: Commands, town_run: Path, tmp_path: Path) -> None:
    refused(run("fly", town_run, "--break-after", "5"), "--break-after: goes with --track")
    refused(run("fly", town_run, "-o", tmp_path), "--output: goes with --track")
    one = ("--route", "a", "--target-speed", "3")
    refused(run("fly", town_run, "--track", "x.gpx", *one), "leave --route out")
    refused(run("fly", town_run, "--track", tmp_path / "x.gpx"), "x.gpx: no such file")
    refused(run("fly", town_run, "--track", "x.gpx", "--sensor-from", "-3"), "metres from 0 on")
    high = ("--track", town_run / "flight" / "flight.gpx", "--sensor-from", "500")
    told = run("fly", town_run, *high, "--json").json
    assert told["heights"] == "never down"
    refused(run("fly", town_run, *high[:3], "130"), "highest point is 120.0 m above its lowest")


BERLIN = (
    "network.exits=[]",
    "target.signals=known",
    'target.start={ "46039050#0" = 0.6, "-190083610" = 0.4 }',
)


def recorded_in_berlin(targets: int) -> list[tuple[float, tuple[float, float]]]:
    opened = open_scenario("berlin", overrides=BERLIN)
    reading = Reading(
        around_m=opened.network.shape_xy_m,
        horizon_s=1800.0,
        law=FlightLaw(15.0),
        sensor_from_m=50.0,
        take_off_s=120.0,
    )
    flight = flown(read_log(FOLDER / "sitl_15.csv.gz"), opened.network, reading)
    assert flight.lift_off_s == 120.0
    start = lonlat(opened.network, flight.track.xy(120.0))
    assert start == pytest.approx([13.52019, 52.43046], abs=1e-4)
    truth = Recorder(opened, 1).evaluation(targets).futures
    found = evaluate([flight.track], truth, Sensor(60.0), Objective(1800.0))
    by_s = (300.0, 600.0, 1200.0)
    return [(found.found_by_probability(s), found.found_by_interval(s)) for s in by_s]


def test_a_flight_of_an_autopilot_has_the_odds_that_were_measured() -> None:
    for (_, (low, high)), measured in zip(recorded_in_berlin(60), (0.33, 0.48, 0.58), strict=True):
        assert low <= measured <= high


@pytest.mark.long
def test_on_as_many_targets_as_were_measured_on_they_are_the_same() -> None:
    shares = [share for share, _ in recorded_in_berlin(400)]
    assert shares == pytest.approx([0.33, 0.48, 0.58], abs=0.01)
