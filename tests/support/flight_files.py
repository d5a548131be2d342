"""Flights to write into files, anywhere on Earth and with awkward names."""

from datetime import datetime, timedelta, timezone

from planner.export.flight_file import FlightFile, Waypoint

ODD = 'Straße "A" <b>&amp;\' ]]> \u2028 0+1=x;,\t東 é'
SEEN = datetime(2026, 5, 1, 14, 5, tzinfo=timezone(timedelta(hours=2)))
STEPS = ((0.0, 0.0, 0.0), (0.004, 0.001, 0.0), (0.004, 0.011, 7.4), (-0.002, 0.009, 0.4))


def flight_at(
    lat_deg: float, lon_deg: float, *, seen: datetime | None = SEEN, comes_home: bool = True
) -> FlightFile:
    """A flight over four places and home again, north and east of a place; asymmetric."""
    places = [(lat_deg + dlat, lon_deg + dlon, hold_s) for dlat, dlon, hold_s in STEPS]
    if comes_home:
        places.append((lat_deg, lon_deg, 0.0))
    waypoints = tuple(
        Waypoint(lat, lon, 300.0 * k, 200.0 * k, 120.0 + 60.25 * k, hold_s, ODD if k else "")
        for k, (lat, lon, hold_s) in enumerate(places)
    )
    return FlightFile(
        name=ODD,
        waypoints=waypoints,
        height_m=100.0,
        speed_mps=15.0,
        comes_home=comes_home,
        sighted_at=seen,
        attribution="© OpenStreetMap contributors",
    )
