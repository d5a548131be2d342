"""Flights for maps and handhelds: KML with times, and GPX."""

from collections.abc import Sequence
from xml.etree import ElementTree as ET

from planner.export.flight_file import Fix, FlightFile, Waypoint
from planner.messages import plain

KML, GX = "http://www.opengis.net/kml/2.2", "http://www.google.com/kml/ext/2.2"
GPX = "http://www.topografix.com/GPX/1/1"
LINE_COLOUR, LINE_WIDTH = "ff005ed5", "3"  # opacity, blue, green, red


def kml(flight: FlightFile) -> str:
    """Return a flight as KML: its line, a track with times if they are known, its waypoints.

    Longitude comes first. Pilots' apps that fly a line fly it without holding anywhere.
    """
    root = ET.Element("kml", {"xmlns": KML, "xmlns:gx": GX})
    document = ET.SubElement(root, "Document")
    _text(document, "name", flight.name)
    if flight.attribution:
        _text(document, "description", flight.attribution)
    style = ET.SubElement(ET.SubElement(document, "Style", id="flight"), "LineStyle")
    _text(style, "color", LINE_COLOUR)
    _text(style, "width", LINE_WIDTH)
    line = _placemark(document, "planned flight", "#flight")
    shape = ET.SubElement(line, "LineString")
    _text(shape, "tessellate", "1")
    _text(shape, "altitudeMode", "relativeToGround")
    places = [_coordinates(flight, one, ",") for one in flight.waypoints]
    _text(shape, "coordinates", " ".join(places))
    if flight.sighted_at is not None:
        _moving(document, flight)
    folder = ET.SubElement(document, "Folder")
    _text(folder, "name", "waypoints")
    for number, one in enumerate(flight.waypoints):
        _kml_waypoint(folder, flight, number, one)
    return _written(root)


def gpx(flight: FlightFile, fixes: Sequence[Fix] | None = None) -> str:
    """Return a flight as GPX 1.1: a route for handhelds, and a track with all its times.

    Parameters
    ----------
    fixes
        How it flies; None: evenly from waypoint to waypoint, at its height.
    """
    root = ET.Element("gpx", {"xmlns": GPX, "version": "1.1", "creator": "sumo-search-planner"})
    about = ET.SubElement(root, "metadata")
    _text(about, "name", flight.name)
    if flight.attribution:
        _text(about, "desc", flight.attribution)
    route = ET.SubElement(root, "rte")
    _text(route, "name", flight.name)
    for number, one in enumerate(flight.waypoints):
        point = _gpx_point(route, "rtept", flight, _fix(flight, one, one.arrives_s))
        _text(point, "name", str(number))
        if one.street:
            _text(point, "desc", one.street)
    track = ET.SubElement(root, "trk")
    _text(track, "name", f"{flight.name}, planned")
    segment = ET.SubElement(track, "trkseg")
    if fixes is None:
        fixes = [_fix(flight, one, time_s) for one, time_s in flight.stays]
    for fix in fixes:
        _gpx_point(segment, "trkpt", flight, fix)
    return _written(root)


def _moving(document: ET.Element, flight: FlightFile) -> None:
    track = ET.SubElement(_placemark(document, "aircraft"), "gx:Track")
    _text(track, "altitudeMode", "relativeToGround")
    for _, time_s in flight.stays:
        _text(track, "when", flight.utc(time_s) or "")
    for one, _ in flight.stays:
        _text(track, "gx:coord", _coordinates(flight, one, " "))


def _kml_waypoint(folder: ET.Element, flight: FlightFile, number: int, one: Waypoint) -> None:
    place = _placemark(folder, str(number))
    if one.street:
        _text(place, "description", one.street)
    moment = flight.utc(one.arrives_s)
    if moment is not None:
        _text(ET.SubElement(place, "TimeStamp"), "when", moment)
    point = ET.SubElement(place, "Point")
    _text(point, "altitudeMode", "relativeToGround")
    _text(point, "coordinates", _coordinates(flight, one, ","))


def _placemark(parent: ET.Element, name: str, style: str | None = None) -> ET.Element:
    place = ET.SubElement(parent, "Placemark")
    _text(place, "name", name)
    if style is not None:
        _text(place, "styleUrl", style)
    return place


def _fix(flight: FlightFile, one: Waypoint, time_s: float) -> Fix:
    return Fix(time_s, one.lat_deg, one.lon_deg, flight.height_m)


def _gpx_point(parent: ET.Element, tag: str, flight: FlightFile, fix: Fix) -> ET.Element:
    point = ET.SubElement(parent, tag, lat=f"{fix.lat_deg:.7f}", lon=f"{fix.lon_deg:.7f}")
    _text(point, "ele", f"{fix.height_m:.1f}")
    moment = flight.utc(fix.time_s)
    if moment is not None:
        _text(point, "time", moment)
    return point


def _coordinates(flight: FlightFile, one: Waypoint, between: str) -> str:
    return between.join([f"{one.lon_deg:.7f}", f"{one.lat_deg:.7f}", f"{flight.height_m:.1f}"])


def _text(parent: ET.Element, tag: str, text: str) -> None:
    ET.SubElement(parent, tag).text = plain(text)


def _written(root: ET.Element) -> str:
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
