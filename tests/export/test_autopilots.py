"""MAVSDK, which ground stations use, imports the missions for both autopilots."""

import re
import runpy
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from planner.export.mavlink import plan_file, waypoints_file
from support.flight_files import flight_at

BEAT_S = 0.2
TRIES_S = 20.0
DOCUMENTED = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")


def beat(port: int, firmware: int, stop: threading.Event) -> None:
    """Say now and then that there is a vehicle, as an autopilot does."""
    from pymavlink import mavutil

    address = f"udpout:127.0.0.1:{port}"
    link = mavutil.mavlink_connection(address, source_system=1, source_component=1)
    while not stop.wait(BEAT_S):
        link.mav.heartbeat_send(2, firmware, 0, 0, 3)
    link.close()


@contextmanager
def heard(firmware: int) -> Iterator[str]:
    """The address at which a vehicle is heard meanwhile."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    stop = threading.Event()
    vehicle = threading.Thread(target=beat, args=(port, firmware, stop), daemon=True)
    vehicle.start()
    try:
        yield f"udpin://127.0.0.1:{port}"
    finally:
        stop.set()
        vehicle.join()


@pytest.fixture(params=[3, 12], ids=["ardupilot", "px4"])
def importer(request: pytest.FixtureRequest) -> Iterator[tuple[str, Any]]:
    """The vehicle's name, and MAVSDK's raw missions while a vehicle of that kind is there."""
    from mavsdk import ComponentType, Configuration, Mavsdk
    from mavsdk.plugins.mission_raw import MissionRaw

    kind = ComponentType.GROUND_STATION
    sdk = Mavsdk(Configuration.create_with_component_type(kind))
    with heard(request.param) as address:
        try:
            sdk.add_any_connection(address)
            yield request.node.callspec.id, MissionRaw(sdk.first_autopilot(TRIES_S))
        finally:
            sdk.destroy()


def test_a_ground_station_loads_it_as_the_documentation_says(tmp_path: Path) -> None:
    (code,) = re.findall(r"```python\n(from mavsdk.*?)```", DOCUMENTED, re.DOTALL)
    program, file = tmp_path / "station.py", tmp_path / "flight.plan"
    file.write_text(plan_file(flight_at(-33.9, 18.4)), encoding="utf-8")
    before, uploads = code.split("raw.upload", 1)  # nothing is there that would take it
    with heard(3) as address:
        here = before.replace("udpin://0.0.0.0:14540", address)
        program.write_text(here.replace("runs/berlin/flight/flight.plan", str(file)))
        found = runpy.run_path(str(program))
        found["sdk"].destroy()
    assert address in program.read_text()
    assert len(found["mission"].mission_items) >= 6
    for what, items in re.findall(r"raw\.(\w+)\(mission\.(\w+)\)", "raw.upload" + uploads):
        assert callable(getattr(found["raw"], what))
        assert hasattr(found["mission"], items)


def test_it_imports_the_plan(importer: tuple[str, Any], tmp_path: Path) -> None:
    autopilot, raw = importer
    flight = flight_at(-33.9, 18.4)
    fence = [[(-34.0, 18.0), (-34.0, 19.0), (-33.0, 18.5)]]
    text = plan_file(flight, autopilot=autopilot, fence=fence)  # type: ignore[arg-type]
    (tmp_path / "f.plan").write_text(text, encoding="utf-8")
    read = raw.import_qgroundcontrol_mission(str(tmp_path / "f.plan"))
    flown = read.mission_items[-6:]  # for ArduPilot it puts home before them
    assert [item.command for item in flown] == [22, 178, 16, 16, 16, 20]
    assert len(read.geofence_items) == 3
    for item, one in zip(flown[2:5], flight.waypoints[1:], strict=False):
        assert item.x / 1e7 == pytest.approx(one.lat_deg, abs=1e-7)
        assert item.y / 1e7 == pytest.approx(one.lon_deg, abs=1e-7)
        assert (item.frame, item.z) in {(3, 100.0), (6, 100.0)}


def test_it_imports_a_part_that_begins_in_the_air(
    importer: tuple[str, Any], tmp_path: Path
) -> None:
    autopilot, raw = importer
    _, part = flight_at(-33.9, 18.4).parts(3)
    text = plan_file(part, autopilot=autopilot)  # type: ignore[arg-type]
    (tmp_path / "f.plan").write_text(text, encoding="utf-8")
    read = raw.import_qgroundcontrol_mission(str(tmp_path / "f.plan"))
    assert [item.command for item in read.mission_items[-4:]] == [178, 16, 16, 20]


def test_it_imports_the_waypoints_of_ardupilot(importer: tuple[str, Any], tmp_path: Path) -> None:
    autopilot, raw = importer
    if autopilot == "px4":
        return  # there line 0 is a place to fly to: the file is not for it, and says so
    (tmp_path / "f.waypoints").write_text(waypoints_file(flight_at(52.4, -13.5)))
    read = raw.import_mission_planner_mission(str(tmp_path / "f.waypoints"))
    assert [item.command for item in read.mission_items][-6:] == [22, 178, 16, 16, 16, 20]
