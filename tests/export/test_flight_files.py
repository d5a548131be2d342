"""Flight files are read back by other people's programs, to a centimetre and a hundredth second."""

import csv
import io
import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

import geojson as geojson_package
import gpxpy
import pytest
from fastkml import kml as fastkml
from fastkml.validator import validate
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree
from pymavlink import mavwp

from planner.errors import InputError
from planner.export.flight_file import Fix, FlightFile, Waypoint, whole_holds
from planner.export.mavlink import items, plan_file, waypoints_file
from planner.export.tables import cell, csv_table, fcd, geojson
from planner.export.xml_maps import gpx, kml
from planner.messages import plain
from support.flight_files import ODD, SEEN, flight_at

CENTIMETRE = 1e-7  # degrees
EVERYWHERE = (st.floats(-80, 80), st.floats(-179, 179))
WRITERS = (plan_file, waypoints_file, kml, gpx, geojson, csv_table, fcd)


def same_places(found: list[tuple[float, float]], flight: FlightFile) -> bool:
    wanted = [(one.lat_deg, one.lon_deg) for one in flight.waypoints]
    return len(found) == len(wanted) and all(
        abs(a - c) < CENTIMETRE and abs(b - d) < CENTIMETRE
        for (a, b), (c, d) in zip(found, wanted, strict=True)
    )


@settings(max_examples=20, deadline=None)
@given(*EVERYWHERE)
def test_gpx_on_all_hemispheres(lat_deg: float, lon_deg: float) -> None:
    flight = flight_at(lat_deg, lon_deg)
    read = gpxpy.parse(gpx([flight]))
    route = read.routes[0]
    assert same_places([(p.latitude, p.longitude) for p in route.points], flight)
    moments = [p.time for p in read.tracks[0].segments[0].points]
    for moment, (_, time_s) in zip(moments, flight.stays, strict=True):
        assert moment is not None
        assert abs((moment - SEEN).total_seconds() - time_s) <= 0.01


@settings(max_examples=20, deadline=None)
@given(*EVERYWHERE)
def test_geojson_on_all_hemispheres(lat_deg: float, lon_deg: float) -> None:
    flight = flight_at(lat_deg, lon_deg)
    read = geojson_package.loads(geojson([flight]))
    assert read.is_valid, read.errors()
    exact = json.loads(geojson([flight]))  # that package rounds to a decimetre
    line = exact["features"][0]["geometry"]["coordinates"]
    assert same_places([(lat, lon) for lon, lat, _ in line], flight)
    assert read["features"][2]["properties"]["street"] == ODD


@settings(max_examples=15, deadline=None)
@given(*EVERYWHERE)
def test_waypoints_are_latitude_first_with_home_in_line_0(lat_deg: float, lon_deg: float) -> None:
    rows = [line.split("\t") for line in waypoints_file(flight_at(lat_deg, lon_deg)).splitlines()]
    assert rows[0] == ["QGC WPL 110"]
    assert all(len(row) == 12 for row in rows[1:])
    assert abs(float(rows[1][8]) - lat_deg) < CENTIMETRE
    assert abs(float(rows[1][9]) - lon_deg) < CENTIMETRE


def test_pymavlink_reads_the_waypoints(tmp_path: Path) -> None:
    flight = flight_at(-33.9, 18.4)
    (tmp_path / "f.waypoints").write_text(waypoints_file(flight), encoding="utf-8")
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(tmp_path / "f.waypoints")) == 7  # home, take-off, speed, 3 places, home
    flown = [loader.wp(i) for i in range(loader.count()) if loader.wp(i).command == 16]
    home, *places = [(one.x, one.y) for one in flown]
    assert same_places([home, *places, home], flight)
    assert loader.wp(2).param2 == 15.0
    assert [one.frame for one in flown] == [0, 3, 3, 3]


def test_fastkml_and_its_schemas_accept_the_map(tmp_path: Path) -> None:
    flight = flight_at(52.4, -13.5)
    (tmp_path / "f.kml").write_text(kml([flight]), encoding="utf-8")
    assert validate(file_to_validate=tmp_path / "f.kml")
    document: Any = next(iter(fastkml.KML.parse(tmp_path / "f.kml").features))
    named = {one.name: one for one in document.features}
    line, track = named["planned flight"].geometry, named["aircraft"].kml_geometry
    assert same_places([(lat, lon) for lon, lat, _ in line.coords], flight)
    for item, (one, time_s) in zip(track.track_items, flight.stays, strict=True):
        assert abs((item.when.dt - SEEN).total_seconds() - time_s) <= 0.01
        assert abs(item.coord.x - one.lon_deg) < CENTIMETRE
    assert [one.description for one in named["waypoints"].features][1] == plain(ODD)


CHARACTERS = st.text(st.characters(codec="utf-8"), max_size=12) | st.sampled_from(
    [ODD, "=1+1", "-x", "a,b", 'say "no"', "\x00\x1b[2J", "]]>", "--", "<b>&amp;", "\u2028", "\r\n"]
)


@settings(max_examples=30, deadline=None)
@given(CHARACTERS)
def test_names_of_whatever_characters(name: str) -> None:
    plain_flight = flight_at(-33.9, 18.4)
    named = tuple(replace(one, street=name) for one in plain_flight.waypoints)
    flight = replace(plain_flight, name=name, waypoints=named, attribution=name)
    json.loads(plan_file(flight))
    assert waypoints_file(flight) == waypoints_file(plain_flight)
    read = json.loads(geojson([flight]))["features"]
    assert [one["properties"].get("street", one["properties"].get("name")) for one in read] == [
        name
    ] * len(read)
    (tab,) = {row[-1] for row in list(csv.reader(io.StringIO(csv_table([flight]), newline="")))[1:]}
    assert tab == cell(name)
    assert not tab.startswith(("=", "+", "-", "@"))
    route = gpxpy.parse(gpx([flight])).routes[0]
    assert (route.points[1].description or "").strip() == plain(name).strip()
    for text in (kml([flight]), gpx([flight]), fcd([flight])):
        etree.fromstring(text.encode())


@settings(max_examples=20, deadline=None)
@given(*EVERYWHERE)
def test_missions_on_all_hemispheres(lat_deg: float, lon_deg: float) -> None:
    flight = flight_at(lat_deg, lon_deg)
    mission = json.loads(plan_file(flight))["mission"]
    flown = [tuple(one["params"][4:6]) for one in mission["items"] if one["command"] == 16]
    home = tuple(mission["plannedHomePosition"][:2])
    assert same_places([home, *flown, home], flight)


@settings(max_examples=10, deadline=None)
@given(*EVERYWHERE)
def test_maps_on_all_hemispheres(lat_deg: float, lon_deg: float) -> None:
    flight = flight_at(lat_deg, lon_deg)
    space = "{http://www.opengis.net/kml/2.2}"
    root = etree.fromstring(kml([flight]).encode())
    told = [
        [*map(float, place.split(","))]
        for place in root.iter(f"{space}coordinates")
        for place in (place.text or "").split()
    ]
    line = told[: len(flight.waypoints)]
    assert same_places([(lat, lon) for lon, lat, _ in line], flight)


def test_tracks_are_the_true_way_with_its_heights() -> None:
    flight = flight_at(10.0, 20.0)
    way = tuple(Fix(100.0 + 0.5 * k, 10.0 + 1e-4 * k, 20.0, min(100.0, 25.0 * k)) for k in range(9))
    flown = replace(flight, way=way)
    points = gpxpy.parse(gpx([flown])).tracks[0].segments[0].points
    assert [point.elevation for point in points] == [fix.height_m for fix in way]
    for point, fix in zip(points, way, strict=True):
        assert point.time is not None
        assert (point.time - SEEN).total_seconds() == pytest.approx(fix.time_s, abs=0.01)
        assert point.latitude == pytest.approx(fix.lat_deg, abs=CENTIMETRE)
    text = kml([flown])
    assert text.count("<gx:coord>") == text.count("<when>") - len(flight.waypoints) == len(way)
    assert "<gx:coord>20.0000000 10.0002000 50.0</gx:coord>" in text


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 40), st.integers(2, 12), st.booleans())
def test_parts_begin_where_the_last_one_ended(many: int, most: int, comes_home: bool) -> None:
    places = tuple(
        Waypoint(50.0 + k / 1000, 8.0 - k / 500, 0.0, 0.0, 100.0 * k, float(k % 3 == 1))
        for k in range(many)
    )
    flight = replace(flight_at(50.0, 8.0, comes_home=comes_home), waypoints=places)
    parts = flight.parts(most)
    assert all(2 <= len(part.waypoints) <= most for part in parts)
    assert [part.launch for part in parts] == [None, *[places[0]] * (len(parts) - 1)]
    assert [part.comes_home for part in parts] == [False] * (len(parts) - 1) + [comes_home]
    for before, after in pairwise(parts):
        end, begin = before.waypoints[-1], after.waypoints[0]
        assert (end.lat_deg, end.lon_deg) == (begin.lat_deg, begin.lon_deg)
        assert (begin.arrives_s, begin.hold_s) == (end.arrives_s + end.hold_s, 0.0)
    joined = [one for part in parts for one in part.waypoints[1:]]
    assert [places[0], *joined] == [*places]
    if len(parts) > 1:
        assert parts[0].name == f"{flight.name}, part 1 of {len(parts)}"


def test_pymavlink_reads_each_part(tmp_path: Path) -> None:
    flight = flight_at(-33.9, 18.4)
    first, last = flight.parts(3)
    for part, commands in ((first, [16, 22, 178, 16, 16, 17]), (last, [16, 178, 16, 16, 20])):
        (tmp_path / "f.waypoints").write_text(waypoints_file(part), encoding="utf-8")
        loader = mavwp.MAVWPLoader()
        assert loader.load(str(tmp_path / "f.waypoints")) == len(commands)
        assert [loader.wp(k).command for k in range(loader.count())] == commands
        assert loader.wp(0).x == pytest.approx(-33.9)  # home is where it took off


def test_no_speed_is_changed_on_the_way() -> None:
    commands = [item.command for item in items(flight_at(1.0, 2.0), "ardupilot")]
    assert commands.count(178) == 1
    assert commands.index(178) < commands.index(16)


def test_without_a_time_of_day_none_is_invented() -> None:
    flight = flight_at(52.4, 13.5, seen=None)
    for write in (kml, gpx, geojson, csv_table):
        said = write([flight])
        assert "1970" not in said
        assert "T14:" not in said
    assert flight.utc(5.0) is None


def test_times_are_utc_whatever_the_zone_of_the_sighting() -> None:
    assert flight_at(0, 0).utc(0.0) == "2026-05-01T12:05:00.000Z"
    assert flight_at(0, 0).utc(59.9996) == "2026-05-01T12:06:00.000Z"
    moved = SEEN.astimezone(UTC) + timedelta()
    assert flight_at(0, 0, seen=moved).utc(1.25) == "2026-05-01T12:05:01.250Z"


@pytest.mark.parametrize(("autopilot", "firmware"), [("ardupilot", 3), ("px4", 12)])
def test_a_plan_has_what_ground_stations_ask_for(autopilot: Any, firmware: int) -> None:
    fence = [[(52.0, 13.0), (52.0, 14.0), (53.0, 13.5)]]
    text = plan_file(flight_at(52.4, 13.5), autopilot=autopilot, fence=fence, no_fly=fence)
    read = json.loads(text, parse_constant=lambda name: pytest.fail(name))
    mission = read["mission"]
    assert (read["fileType"], mission["version"], mission["firmwareType"]) == ("Plan", 2, firmware)
    assert [one["inclusion"] for one in read["geoFence"]["polygons"]] == [True, False]
    assert read["rallyPoints"] == {"version": 2, "points": []}
    commands = [item["command"] for item in mission["items"]]
    assert commands == [22, 178, 16, 16, 16, 20]
    assert all(len(item["params"]) == 7 for item in mission["items"])
    assert mission["items"][0]["params"][3] is None  # whichever way it points
    assert len(mission["plannedHomePosition"]) == 3
    assert "fenceAction" not in text  # which released ground stations do not know
    assert {item["type"] for item in mission["items"]} == {"SimpleItem"}


def test_a_flight_that_lands_nowhere_stays_at_its_end() -> None:
    last = list(items(flight_at(1.0, 2.0, comes_home=False), "px4"))[-1]
    assert (last.command, last.parameters[4:6]) == (17, (0.998, 2.009))


def test_terrain_is_another_frame() -> None:
    assert {item.frame for item in items(flight_at(1.0, 2.0), "px4", "terrain")} == {2, 10}


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(0, 30), min_size=2, max_size=20))
def test_whole_seconds_of_holding_are_made_up_for(holds: list[float]) -> None:
    places = tuple(Waypoint(0.0, 0.0, 0.0, 0.0, 0.0, hold_s) for hold_s in holds)
    flight = FlightFile(name="", waypoints=places, height_m=1.0, speed_mps=1.0, comes_home=False)
    whole = whole_holds(flight)
    held, wanted = 0, 0.0
    for one, hold_s in zip(whole, holds, strict=True):
        held, wanted = held + one, wanted + hold_s
        assert one == 0 or hold_s > 0.0
        assert abs(held - wanted) <= 0.5 + max(0.0, held - wanted if hold_s == 0.0 else 0.0)


def test_px4_holds_fractions_and_ardupilot_does_not() -> None:
    flight = flight_at(1.0, 2.0)
    assert [item.parameters[0] for item in items(flight, "px4")][2:5] == [0.0, 7.4, 0.4]
    assert [item.parameters[0] for item in items(flight, "ardupilot")][2:5] == [0, 7, 1]


def test_spreadsheets_see_no_formulas() -> None:
    assert [cell(text) for text in ("=1+1", "+1", "-x", "@a", "Allee")] == [
        "'=1+1",
        "'+1",
        "'-x",
        "'@a",
        "Allee",
    ]
    rows = list(csv.DictReader(io.StringIO(csv_table([flight_at(10.0, 20.0)]))))
    assert [row["street"] for row in rows][1] == ODD
    assert float(rows[2]["hold_s"]) == 7.4


def test_sumo_schema_and_places_of_the_floating_car_data(tmp_path: Path) -> None:
    from sumolib import xml

    flight = flight_at(10.0, 20.0)
    (tmp_path / "uav.xml").write_text(fcd([flight]), encoding="utf-8")
    import sumo

    schema = etree.XMLSchema(
        etree.parse(str(Path(sumo.SUMO_HOME) / "data" / "xsd" / "fcd_file.xsd"))
    )
    assert schema.validate(etree.parse(str(tmp_path / "uav.xml"))), schema.error_log
    steps = list(xml.parse(str(tmp_path / "uav.xml"), "timestep"))
    assert float(steps[0].time) == 120.0
    assert float(steps[-1].time) == 361.0
    assert float(steps[60].vehicle[0].x) == pytest.approx(300.0 * 60.0 / 60.25, abs=0.01)


@pytest.mark.parametrize("write", WRITERS)
def test_the_same_flight_gives_the_same_bytes(write: Any) -> None:
    one, again = flight_at(52.4, 13.5), flight_at(52.4, 13.5)
    if write in (plan_file, waypoints_file):
        assert write(one) == write(again)
    else:
        assert write([one]) == write([again])


def test_places_that_are_nowhere_are_refused() -> None:
    with pytest.raises(InputError, match="lat_deg"):
        flight_at(95.0, 0.0)
    with pytest.raises(InputError, match="two places"):
        FlightFile(name="", waypoints=(), height_m=1.0, speed_mps=1.0, comes_home=False)


def test_a_moment_is_kept_to_the_millisecond() -> None:
    moment = datetime.fromisoformat(flight_at(0, 0).utc(0.1234) or "")
    assert moment.microsecond == 123000
