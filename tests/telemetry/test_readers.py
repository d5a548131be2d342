"""Every format gives the same points, and what is wrong with a file is one line."""

import gzip
import sys
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.telemetry.log import TrackLog
from planner.telemetry.read import read_log
from support.recordings import FLIGHT, fcd, gpx, table, write_bin, write_tlog


def read(folder: Path, name: str, text: str) -> TrackLog:
    (folder / name).write_text(text, encoding="utf-8")
    return read_log(folder / name)


def is_the_flight(log: TrackLog, *, exact_s: float = 1e-3) -> None:
    assert len(log) == len(FLIGHT)
    for column, values in (
        (log.lat_deg, [p.lat for p in FLIGHT]),
        (log.lon_deg, [p.lon for p in FLIGHT]),
        (log.height_m, [p.height_m for p in FLIGHT]),
    ):
        np.testing.assert_allclose(column, values, atol=1e-6)
    utc_s = [p.since_1970_s for p in FLIGHT]
    np.testing.assert_allclose(log.utc_s, utc_s, rtol=0, atol=exact_s)


def test_gpx_with_its_segments(tmp_path: Path) -> None:
    log = read(tmp_path, "flown.gpx", gpx([FLIGHT[:4], [], FLIGHT[4:]]))
    is_the_flight(log)
    assert np.flatnonzero(log.begins).tolist() == [0, 4]
    is_the_flight(read(tmp_path, "old.gpx", gpx([FLIGHT], namespace="GPX/1/0")))
    is_the_flight(read(tmp_path, "flown.xml", gpx([FLIGHT])))


def test_tables_with_whatever_separator_and_packed(tmp_path: Path) -> None:
    for name, separator in (("a.csv", ","), ("b.csv", ";"), ("c.CSV", "\t")):
        is_the_flight(read(tmp_path, name, "\ufeff" + table(FLIGHT, separator) + "\n\n"))
    with gzip.open(tmp_path / "d.csv.gz", "wt") as file:
        file.write(table(FLIGHT))
    is_the_flight(read_log(tmp_path / "d.csv.gz"))
    log = read(
        tmp_path, "e.csv", "time,x,y,hold_s\n5,1,2,\n0:00:07,3,4,2.5\n".replace("0:00:0", "")
    )
    assert log.time_s.tolist() == [5.0, 7.0]
    assert not log.is_sampled
    assert (log.x_m[1], log.y_m[1], log.hold_s[1]) == (3.0, 4.0, 2.5)


def test_floating_car_data_of_one_vehicle(tmp_path: Path) -> None:
    points = [(3.0, 1.5, 2.5), (4.0, 2.5, 2.5)]
    log = read(tmp_path, "uav.fcd.xml", fcd(points))
    assert list(zip(log.time_s, log.x_m, log.y_m, strict=True)) == points
    rows = "\n".join(f"{t};uav;{x};{y}" for t, x, y in points)
    log = read(tmp_path, "uav.csv", f"timestep_time;vehicle_id;vehicle_x;vehicle_y\n{rows}\n")
    assert list(zip(log.time_s, log.x_m, log.y_m, strict=True)) == points
    two = fcd(points).replace('id="uav"', 'id="car"', 1)
    with pytest.raises(InputError, match="holds 2 vehicles, 'car' and 'uav' among them"):
        read(tmp_path, "two.xml", two)


def test_logs_of_autopilots(tmp_path: Path) -> None:
    write_tlog(tmp_path / "flown.tlog", FLIGHT)
    is_the_flight(read_log(tmp_path / "flown.tlog"))
    write_bin(tmp_path / "flown.BIN", FLIGHT)
    is_the_flight(read_log(tmp_path / "flown.BIN"), exact_s=1.0)  # leap seconds are the library's
    for name in ("flown.tlog", "flown.bin"):
        (tmp_path / name).write_bytes(b"\xa3\x95 no log at all" * 50)
        with pytest.raises(InputError, match=rf"{name}: (is no log|holds no points)"):
            read_log(tmp_path / name)


def test_without_pymavlink_it_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_tlog(tmp_path / "flown.tlog", FLIGHT)
    monkeypatch.setitem(sys.modules, "pymavlink", None)
    with pytest.raises(InputError, match="pip install pymavlink"):
        read_log(tmp_path / "flown.tlog")


GPX, TABLE = gpx([FLIGHT]), table(FLIGHT)
FAULTS = {
    "empty.gpx": ("", "no element"),
    "cut.gpx": (GPX[:900], "is not XML"),
    "entity.gpx": ('<!DOCTYPE gpx [<!ENTITY a "b">]>' + GPX, "declares a document type"),
    "none.gpx": (gpx([]), "holds no points"),
    "one.gpx": (gpx([FLIGHT[:1]]), "holds one point"),
    "nan.gpx": (GPX.replace('lat="52.4301"', 'lat="NaN"'), 'trkpt 2: lat: "NaN" is no finite'),
    "word.gpx": (GPX.replace(">54.0<", ">high<"), 'trkpt 2: ele: "high" is no finite number'),
    "zone.gpx": (GPX.replace("42.000Z", "42"), "trkpt 2: time: 2026-05-01T12:06:42 does not say"),
    "when.gpx": (
        GPX.replace("2026-05-01T12:06:42.000Z", "soon"),
        "trkpt 2: time: should be a date",
    ),
    "inf.csv": (TABLE.replace("52.4301,", "inf,"), 'line 3: latitude: "inf" is no finite number'),
    "far.csv": ("t,x,y\n1,1,1\n2,1e300,1\n", "line 3: x_m 1e+300 is out of reach"),
    "late.csv": ("t,x,y\n1,1,1\n1e300,2,1\n", "line 3: time_s 1e+300 is out of reach"),
    "high.csv": ("t,x,y,alt\n1,1,1,-1e308\n2,2,1,1e308\n", "line 2: height_m -1e+308 is out"),
    "head.csv": ("a,b\n1,2\n", "line 1: names no column with the place"),
    "when.csv": ("lat,lon\n1,2\n", "line 1: names no column with the time"),
    "twice.csv": ("t,lat,lat,lon\n1,2,2,3\n", "column 'lat' stands in it twice"),
    "mac.csv": ("t,x\ry,y\n1,2,3\n", "line 1: names no column with the place"),
    "nothing.csv": ("", "line 1: names no column"),
    "huge.csv": ("t,x,y\n" + "1" * 200_000 + ",1,1\n", "line 2: is no CSV"),
    "other.kml": ("<kml/>", "is no recorded flight that is known here; give GPX"),
    "other.txt": ("12 13", "is no recorded flight"),
    "few.fcd.xml": ("<fcd-export/>", "holds no points"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_is_wrong_is_one_line(tmp_path: Path, name: str) -> None:
    text, said = FAULTS[name]
    with pytest.raises(InputError) as caught:
        read(tmp_path, name, text)
    assert str(caught.value).startswith(f"{tmp_path / name}: ")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_more_than_memory_should_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("texts", "autopilots"):
        monkeypatch.setattr(f"planner.telemetry.{module}.LARGEST", 700)
    write_tlog(tmp_path / "a.tlog", FLIGHT * 9)
    (tmp_path / "a.csv").write_text(TABLE * 9)
    (tmp_path / "a.gpx").write_text(GPX)
    for name in ("a.tlog", "a.csv", "a.gpx"):
        with pytest.raises(InputError, match="holds more than"):
            read_log(tmp_path / name)
    with pytest.raises(InputError, match="no such file"):
        read_log(tmp_path / "none.gpx")
