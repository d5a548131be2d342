"""True vehicles in files of a user's: tracks of a GPS, on the search's clock and in the net."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.truths import is_gps, read_truths
from planner.network.georeference import lonlat
from support.town_on_earth import on_earth

STEP_S, POINTS = 30.0, 12
BEGAN = datetime(2026, 5, 4, 6, 0, tzinfo=UTC)  # that is 8:00 where the target was seen


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> OpenScenario:
    folder = tmp_path_factory.mktemp("truths")
    return open_scenario(on_earth(folder), overrides=["search.horizon_s=240"])


@pytest.fixture(scope="module")
def way_m(town: OpenScenario) -> np.ndarray:
    """Points along the longest road, one for each time."""
    network = town.network
    road = int(np.argmax(network.road_length_m))
    return network.xy(road, np.linspace(0.0, network.road_length_m[road], POINTS))


def utc(k: int) -> str:
    return datetime.fromtimestamp(BEGAN.timestamp() + STEP_S * k, UTC).isoformat()


def gpx(file: Path, town: OpenScenario, way_m: np.ndarray) -> Path:
    points = "".join(
        f'<trkpt lat="{lat:.7f}" lon="{lon:.7f}"><time>{utc(k)}</time></trkpt>'
        for k, (lon, lat) in enumerate(lonlat(town.network, way_m).tolist())
    )
    head = '<gpx xmlns="http://www.topografix.com/GPX/1/1" version="1.1" creator="x">'
    file.write_text(f"{head}<trk><trkseg>{points}</trkseg></trk></gpx>", encoding="utf-8")
    return file


def csv(file: Path, town: OpenScenario, way_m: np.ndarray, *, seconds: bool = True) -> Path:
    rows = enumerate(lonlat(town.network, way_m).tolist())
    times = (f"{STEP_S * k:g}" if seconds else utc(k) for k in range(len(way_m)))
    lines = (f"{t},{lon:.7f},{lat:.7f}" for t, (_, (lon, lat)) in zip(times, rows, strict=True))
    file.write_text("\n".join(["time,lon,lat", *lines]) + "\n", encoding="utf-8")
    return file


def test_a_track_is_a_vehicle_where_and_when_it_drove(
    town: OpenScenario, way_m: np.ndarray, tmp_path: Path
) -> None:
    files = [gpx(tmp_path / "mon.gpx", town, way_m), csv(tmp_path / "tue.csv", town, way_m)]
    assert all(map(is_gps, files))
    by_clock, by_seconds = (
        read_truths([file], town, begin_s=begin_s)[0]
        for file, begin_s in zip(files, (8 * 3600.0 + 60.0, 60.0), strict=True)
    )
    for truth in (by_clock, by_seconds):
        assert len(truth) == 1
        for time_s in (0.0, 45.0, 240.0):
            k = (60.0 + time_s) / STEP_S
            expected = [np.interp(k, np.arange(POINTS), column) for column in way_m.T]
            assert truth.positions(time_s)[0] == pytest.approx(expected, abs=0.1)


def test_time_0_is_the_time_of_day_at_which_the_target_was_seen(
    town: OpenScenario, way_m: np.ndarray, tmp_path: Path
) -> None:
    """The target was seen at 14:05 of another day."""
    with pytest.raises(InputError, match=r"-6:05:00 to .*say when its time 0 was: --begin"):
        read_truths([gpx(tmp_path / "mon.gpx", town, way_m)], town)


def test_what_is_no_track_of_this_search_is_refused(
    town: OpenScenario, way_m: np.ndarray, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    short = csv(tmp_path / "short.csv", town, way_m[:4])
    read_truths([short], town)
    assert "short.csv: ends at 0:01:30, before the search" in caplog.text
    lines = short.read_text().splitlines()
    short.write_text("\n".join([*lines, lines[2]]))
    with pytest.raises(InputError, match="line 6: is not later than the point before"):
        read_truths([short], town)
    with pytest.raises(InputError, match="km away from the search"):
        read_truths([csv(tmp_path / "far.csv", town, way_m + 1e6)], town)
    sumo = tmp_path / "fcd.csv"
    sumo.write_text("timestep_time;vehicle_id\n")
    assert not is_gps(sumo)
    assert not is_gps(tmp_path / "fcd.xml")
