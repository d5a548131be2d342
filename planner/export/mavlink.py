"""Missions of MAVLink autopilots: QGroundControl's ``.plan``, Mission Planner's ``.waypoints``.

The mission is the same in both: take off, set one speed, fly the waypoints, come home or stay. A
part of a flight that begins in the air does not take off.
Degrees are latitude first. A ``.waypoints`` file begins with the home position, which a PX4 vehicle
takes for a waypoint at sea level: it is for ArduPilot only.
"""

import json
from collections.abc import Iterator, Sequence
from typing import Any, Literal, NamedTuple

from planner.export.flight_file import FlightFile, Waypoint, whole_holds

Autopilot = Literal["ardupilot", "px4"]
Frame = Literal["relative", "terrain"]
Ring = Sequence[tuple[float, float]]  # latitude and longitude of a polygon's corners

FIRMWARE: dict[Autopilot, int] = {"ardupilot": 3, "px4": 12}  # MAV_AUTOPILOT
QUADROTOR = 2  # MAV_TYPE
FRAMES: dict[Frame, int] = {"relative": 3, "terrain": 10}  # MAV_FRAME
MISSION = 2  # MAV_FRAME of what happens at no place
# MAV_CMD
TAKE_OFF, WAYPOINT, SPEED, RETURN, STAY = 22, 16, 178, 20, 17
AIRSPEED_OR_GROUND = 1  # of SPEED: over ground, as multicopters take it
UNCHANGED = -1.0  # of SPEED: the throttle
DEGREES = 7  # digits: a centimetre


class Item(NamedTuple):
    """One command of a mission."""

    command: int
    frame: int
    parameters: tuple[float | None, ...]  # seven; None: the autopilot's own


def items(flight: FlightFile, autopilot: Autopilot, frame: Frame = "relative") -> Iterator[Item]:
    """Yield the commands of a flight."""
    here, height_m = FRAMES[frame], flight.height_m
    holds: Sequence[float] = [one.hold_s for one in flight.waypoints]
    if autopilot == "ardupilot":
        holds = whole_holds(flight)
    on_ground = flight.launch is None
    if on_ground:
        yield Item(TAKE_OFF, here, (0, 0, 0, None, *_place(flight.home), height_m))
    yield Item(SPEED, MISSION, (AIRSPEED_OR_GROUND, flight.speed_mps, UNCHANGED, 0, 0, 0, 0))
    away = slice(1 if on_ground else 0, -1 if flight.comes_home else None)
    for one, hold_s in zip(flight.waypoints[away], holds[away], strict=True):
        yield Item(WAYPOINT, here, (hold_s, 0, 0, None, *_place(one), height_m))
    if flight.comes_home:
        yield Item(RETURN, MISSION, (0, 0, 0, 0, 0, 0, 0))
    else:
        yield Item(STAY, here, (0, 0, 0, None, *_place(flight.waypoints[-1]), height_m))


def plan_file(
    flight: FlightFile,
    *,
    autopilot: Autopilot = "ardupilot",
    frame: Frame = "relative",
    fence: Sequence[Ring] = (),
    no_fly: Sequence[Ring] = (),
) -> str:
    """Return a flight as QGroundControl's ``.plan``, a JSON text.

    Parameters
    ----------
    fence, no_fly
        Areas to stay within, and to stay out of, which the vehicle itself then watches.
    """
    content: dict[str, Any] = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": {
            "version": 2,
            "firmwareType": FIRMWARE[autopilot],
            "vehicleType": QUADROTOR,
            "globalPlanAltitudeMode": 1 if frame == "relative" else 3,
            "cruiseSpeed": flight.speed_mps,
            "hoverSpeed": flight.speed_mps,
            "plannedHomePosition": [*_place(flight.home), 0],
            "items": [
                {
                    "type": "SimpleItem",
                    "autoContinue": True,
                    "command": item.command,
                    "doJumpId": number,
                    "frame": item.frame,
                    "params": list(item.parameters),
                }
                for number, item in enumerate(items(flight, autopilot, frame), 1)
            ],
        },
        "geoFence": {
            "version": 2,
            "circles": [],
            "polygons": [
                *(_area(ring, True) for ring in fence),
                *(_area(r, False) for r in no_fly),
            ],
        },
        "rallyPoints": {"version": 2, "points": []},
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def waypoints_file(flight: FlightFile, *, frame: Frame = "relative") -> str:
    """Return a flight as ``QGC WPL 110``, the ``.waypoints`` of Mission Planner; ArduPilot only."""
    home = flight.home
    first = (0, 1, 0, WAYPOINT, 0, 0, 0, 0, home.lat_deg, home.lon_deg, 0)
    rows: list[tuple[float, ...]] = [first]
    for number, item in enumerate(items(flight, "ardupilot", frame), 1):
        parameters = [value or 0.0 for value in item.parameters]
        rows.append((number, 0, item.frame, item.command, *parameters))
    return "".join(["QGC WPL 110\n", *map(_row, rows)])


def _row(row: tuple[float, ...]) -> str:
    whole = [f"{value:.0f}" for value in row[:4]]
    parameters = [f"{value:.6g}" for value in row[4:8]]
    lat_deg, lon_deg, height_m = row[8:]
    place = [f"{lat_deg:.8f}", f"{lon_deg:.8f}", f"{height_m:.3f}"]
    return "\t".join([*whole, *parameters, *place, "1\n"])


def _place(one: Waypoint) -> tuple[float, float]:
    return round(one.lat_deg, DEGREES), round(one.lon_deg, DEGREES)


def _area(ring: Ring, inside: bool) -> dict[str, Any]:
    corners = [[round(degrees, DEGREES) for degrees in corner] for corner in ring]
    return {"version": 1, "inclusion": inside, "polygon": corners}
