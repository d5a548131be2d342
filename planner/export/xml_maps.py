"""Flights for maps and handhelds: KML with times, and GPX."""

from collections.abc import Sequence
from xml.etree import ElementTree as ET

from planner.export.flight_file import Fix, FlightFile, Waypoint
from planner.messages import plain

KML, GX = "http://www.opengis.net/kml/2.2", "http://www.google.com/kml/ext/2.2"
GPX = "http://www.topografix.com/GPX/1/1"
LINE_COLOUR, LINE_WIDTH = "ff005ed5", "3"  # opacity, blue, green, red


def kml(flights: Sequence[FlightFile]) -> str:
    """Return flights as KML: the line, the true track if its times are known, the waypoints.

    Longitude comes first. Pilots' apps that fly a line fly it without holding anywhere.
    """
    root = ET.Element("kml", {"xmlns": KML, "xmlns:gx": GX})
    document = ET.SubElement(root, "Document")
    _text(document, "name", flights[0].name)
    if flights[0].attribution:
        _text(document, "description", flights[0].attribution)
    style = ET.SubElement(ET.SubElement(document, "Style", id="flight"), "LineStyle")
    _text(style, "color", LINE_COLOUR)
    _text(style, "width", LINE_WIDTH)
    for flight in flights:
        called = "planned flight" if len(flights) == 1 else flight.name
        _kml_flight(document, flight, called)
    return _written(root)


def _kml_flight(document: ET.Element, flight: FlightFile, called: str) -> None:
    line = _placemark(document, called, "#flight")
    shape = ET.SubElement(line, "LineString")
    _text(shape, "tessellate", "1")
    _text(shape, "altitudeMode", "relativeToGround")
    places = [_at(one.lat_deg, one.lon_deg, flight.height_m, ",") for one in flight.waypoints]
    _text(shape, "coordinates", " ".join(places))
    if flight.sighted_at is not None:
        _moving(document, flight)
    folder = ET.SubElement(document, "Folder")
    _text(folder, "name", "waypoints")
    for number, one in enumerate(flight.waypoints):
        _kml_waypoint(folder, flight, number, one)


def gpx(flights: Sequence[FlightFile]) -> str:
    """Return flights as GPX 1.1: routes for handhelds, and true tracks with all their times."""
    root = ET.Element("gpx", {"xmlns": GPX, "version": "1.1", "creator": "sumo-search-planner"})
    about = ET.SubElement(root, "metadata")
    _text(about, "name", flights[0].name)
    if flights[0].attribution:
        _text(about, "desc", flights[0].attribution)
    for flight in flights:  # first all routes, then all tracks
        _gpx_route(root, flight)
    for flight in flights:
        track = ET.SubElement(root, "trk")
        _text(track, "name", f"{flight.name}, planned")
        segment = ET.SubElement(track, "trkseg")
        for fix in flight.fixes:
            _gpx_point(segment, "trkpt", flight, fix)
    return _written(root)


def _gpx_route(root: ET.Element, flight: FlightFile) -> None:
    route = ET.SubElement(root, "rte")
    _text(route, "name", flight.name)
    for number, one in enumerate(flight.waypoints):
        fix = Fix(one.arrives_s, one.lat_deg, one.lon_deg, flight.height_m)
        point = _gpx_point(route, "rtept", flight, fix)
        _text(point, "name", str(number))
        if one.street:
            _text(point, "desc", one.street)


def _moving(document: ET.Element, flight: FlightFile) -> None:
    track = ET.SubElement(_placemark(document, "aircraft"), "gx:Track")
    _text(track, "altitudeMode", "relativeToGround")
    for fix in flight.fixes:
        _text(track, "when", flight.utc(fix.time_s) or "")
    for fix in flight.fixes:
        _text(track, "gx:coord", _at(fix.lat_deg, fix.lon_deg, fix.height_m, " "))


def _kml_waypoint(folder: ET.Element, flight: FlightFile, number: int, one: Waypoint) -> None:
    place = _placemark(folder, str(number))
    if one.street:
        _text(place, "description", one.street)
    moment = flight.utc(one.arrives_s)
    if moment is not None:
        _text(ET.SubElement(place, "TimeStamp"), "when", moment)
    point = ET.SubElement(place, "Point")
    _text(point, "altitudeMode", "relativeToGround")
    _text(point, "coordinates", _at(one.lat_deg, one.lon_deg, flight.height_m, ","))


def _placemark(parent: ET.Element, name: str, style: str | None = None) -> ET.Element:
    place = ET.SubElement(parent, "Placemark")
    _text(place, "name", name)
    if style is not None:
        _text(place, "styleUrl", style)
    return place


def _gpx_point(parent: ET.Element, tag: str, flight: FlightFile, fix: Fix) -> ET.Element:
    point = ET.SubElement(parent, tag, lat=f"{fix.lat_deg:.7f}", lon=f"{fix.lon_deg:.7f}")
    _text(point, "ele", f"{fix.height_m:.1f}")
    moment = flight.utc(fix.time_s)
    if moment is not None:
        _text(point, "time", moment)
    return point


def _at(lat_deg: float, lon_deg: float, height_m: float, between: str) -> str:
    return between.join([f"{lon_deg:.7f}", f"{lat_deg:.7f}", f"{height_m:.1f}"])


def _text(parent: ET.Element, tag: str, text: str) -> None:
    ET.SubElement(parent, tag).text = plain(text)


def _written(root: ET.Element) -> str:
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
