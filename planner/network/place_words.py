"""Places in the words of somebody who rings: coordinates, streets and their crossings, codes, ids.

Nothing is looked up beyond the net itself: streets are those that it names, and a Plus Code is
arithmetic. A word that is understood as nothing is answered with the nearest that is known.
"""

import difflib
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner import compass
from planner.arrays import Floats
from planner.errors import InputError
from planner.messages import as_written
from planner.network.georeference import coordinates, is_georeferenced, xy_of_lonlat
from planner.network.road_network import RoadNetwork
from planner.network.street_names import street_names

FAR_M = 200.0  # from any road: no car was there
MOVED_M = 30.0  # by which a place is moved onto a road before that is said
ONE_CROSSING_M = 60.0  # nodes so near each other are one crossing, of several carriageways
NEAR = 0.6  # how alike, from 0 to 1, a word is to one that was meant
SHOWN = 5  # crossings, or streets, that a message lists
FORMS = (
    '52.43,13.52 (latitude first), a street, two streets as in "A Street / B Street", a Plus Code, '
    "a node or an edge"
)
BETWEEN = re.compile(r"\s*(?:/|&|;|\s+(?:and|corner of|at|x)\s+)\s*")
NUMBER = r"\d+(?:\.\d+)?"
# One of two coordinates: degrees, then minutes and seconds if there are any, and where they point.
ANGLE = re.compile(
    rf"(?P<sign>[+-]?)(?P<first>[NSEWO]?)\s*(?P<deg>{NUMBER})\s*[°d]?\s*"
    rf"(?:(?P<min>{NUMBER})\s*['′m]?\s*)?(?:(?P<sec>{NUMBER})\s*(?:\"|″|''|s)?\s*)?"
    r"(?P<last>[NSEWO]?)",
    re.IGNORECASE,
)
CODE = re.compile(r"[2-9CFGHJMPQRVWX0]{2,8}\+[2-9CFGHJMPQRVWX]*", re.IGNORECASE)


class Where(NamedTuple):
    """A place as it was understood."""

    x_m: float  # metres in the net's frame
    y_m: float
    called: str  # what it is called, as people say it
    edges: tuple[str, ...] = ()  # names, where it is a whole street or edge and not a point

    @property
    def xy_m(self) -> Floats:
        """The place, (2,) metres."""
        return np.array([self.x_m, self.y_m])


def where(text: str, network: RoadNetwork) -> Where:
    """Return the place that a text means on a network.

    On a net without a projection two numbers are x and y in metres.

    Raises
    ------
    InputError
        If it means none, or more than one; the text says which words would do.
    """
    said = " ".join(text.split())
    if not said:
        raise InputError(f"is empty; give {FORMS}")
    found = (
        _named_exactly(said, network)
        or _coordinates(said, network)
        or _plus_code(said, network)
        or _street(said, network)
        or _crossing(said, network)
    )
    if found is None:
        raise InputError(f"{as_written(text)} is no place of this net; {_meant(said, network)}")
    return found


def told(place: Where, network: RoadNetwork) -> str:
    """Return a place in words and coordinates, as somebody checks it."""
    numbers = coordinates(network, place.xy_m)
    return numbers if place.called == numbers else f"{place.called}: {numbers}"


def on_road(text: str, place: Where, network: RoadNetwork) -> tuple[Where, str]:
    """Return a place moved onto the nearest road, and what has to be said of that; mostly "".

    Parameters
    ----------
    text
        The words that meant it.

    Raises
    ------
    InputError
        If it lies farther than `FAR_M` from any road for cars.
    """
    near = network.edge_lines.nearest(place.xy_m)
    road = network.edge_street[near.line] or network.edge_ids[near.line]
    if near.away_m > FAR_M:
        raise InputError(
            f"{told(place, network)} lies {_far(near.away_m)} from the nearest road for cars "
            f"({road}); {_other_way_round(text, network) or 'give a place nearby'}"
        )
    moved = place._replace(x_m=float(near.xy_m[0]), y_m=float(near.xy_m[1]))
    if near.away_m <= MOVED_M:
        return moved, ""
    at = coordinates(network, near.xy_m)
    return moved, f"moved {near.away_m:,.0f} m to the nearest road, {road}: {at}"


def _far(metres: float) -> str:
    return f"{metres:,.0f} m" if metres < 10_000.0 else f"{metres / 1000.0:,.0f} km"


def _other_way_round(text: str, network: RoadNetwork) -> str:
    """Return the question whether two coordinates were exchanged, "" if that would not help."""
    pair = degrees_of(" ".join(text.split()))
    if pair is None or not is_georeferenced(network):
        return ""
    lat, lon = pair
    try:
        turned = xy_of_lonlat(network, np.array([lat, lon]))
    except InputError:
        return ""
    if network.edge_lines.nearest(turned).away_m > FAR_M:
        return ""
    return f"did you mean {as_written(lat)} and {as_written(lon)} the other way round?"


def heading(text: str) -> float:
    """Return the compass heading that a text means, degrees: "NE", "north-east" or "45".

    Raises
    ------
    InputError
        If it means none.
    """
    said = text.strip().casefold()
    number = re.fullmatch(rf"({NUMBER})\s*(?:°|deg|degrees)?", said)
    if number is not None and float(number[1]) <= 360.0:
        return float(number[1]) % 360.0
    for letter, word in compass.WORDS.items():
        said = said.replace(word, letter)
    letters = re.sub(r"[\s-]", "", said).upper()
    if letters in compass.POINTS:
        return compass.POINTS.index(letters) * 360.0 / len(compass.POINTS)
    raise InputError(
        f"{as_written(text)} is no heading; write N, NE, E, ... or degrees from 0 to 360"
    )


# Coordinates


def _coordinates(said: str, network: RoadNetwork) -> Where | None:
    pair = degrees_of(said)
    if pair is None:
        return None
    if not is_georeferenced(network):
        return _at(pair[0], pair[1], network)
    lat, lon = pair
    try:
        x_m, y_m = xy_of_lonlat(network, np.array([lon, lat])).tolist()
    except InputError as error:
        remedy = _other_way_round(said, network) or "give a place on it, latitude first"
        what = f"latitude {as_written(lat)}, longitude {as_written(lon)} is nowhere near this net"
        raise InputError(f"{what}; {remedy}") from error
    return _at(x_m, y_m, network)


def _at(x_m: float, y_m: float, network: RoadNetwork) -> Where:
    return Where(x_m, y_m, coordinates(network, np.array([x_m, y_m])))


def degrees_of(said: str) -> tuple[float, float] | None:
    """Return the latitude and the longitude that a text holds, degrees; None if it holds none.

    Such as "52.43,13.52", "52.43 N 13.52 E", "N52 25.8 E13 31.2" or "52°25'48\\"N 13°31'12\\"E";
    what letters say counts, else latitude is first.
    """
    for cut in _cuts(said):
        one, other = (_angle(part) for part in (said[: cut[0]], said[cut[1] :]))
        if one is None or other is None:
            continue
        (first, first_axis), (second, second_axis) = one, other
        if first_axis and second_axis and first_axis == second_axis:
            continue
        swapped = first_axis == "lon" or second_axis == "lat"
        return (second, first) if swapped else (first, second)
    return None


def _cuts(said: str) -> list[tuple[int, int]]:
    """Return where a text may be parted into two numbers: at commas, at letters, at spaces."""
    marks = [found.span() for found in re.finditer(r"\s*[,;]\s*", said)]
    letters = [(f.end(), f.end()) for f in re.finditer(r"(?<=[\d°'′\"″ ])[NSEWO]", said, re.I)]
    begins = [(f.start(), f.start()) for f in re.finditer(r"(?<=[\d°'′\"″ ])[NSEWO]", said, re.I)]
    spaces = [found.span() for found in re.finditer(r"\s+", said)]
    middle = len(said) / 2.0
    return [*marks, *letters, *begins, *sorted(spaces, key=lambda s: abs(sum(s) / 2 - middle))]


def _angle(text: str) -> tuple[float, str] | None:
    """Return the degrees that a text holds, and the axis that its letter names, "" for none."""
    found = ANGLE.fullmatch(text.strip())
    if found is None or (found["first"] and found["last"]):
        return None
    minutes, seconds = float(found["min"] or 0.0), float(found["sec"] or 0.0)
    if minutes >= 60.0 or seconds >= 60.0:
        return None
    degrees = float(found["deg"]) + minutes / 60.0 + seconds / 3600.0
    letter = (found["first"] or found["last"]).upper()
    axis = "" if not letter else "lat" if letter in "NS" else "lon"
    negative = (found["sign"] == "-") != (letter in ("S", "W"))
    return (-degrees if negative else degrees), axis


def _plus_code(said: str, network: RoadNetwork) -> Where | None:
    if CODE.fullmatch(said) is None:
        return None
    from openlocationcode import openlocationcode

    code = said.upper()
    if not openlocationcode.isFull(code):
        short = openlocationcode.isShort(code)
        raise InputError(
            f"{code} is {'a short Plus Code' if short else 'no Plus Code'}; give it in full, as in "
            "9F4MCGJC+22"
        )
    area = openlocationcode.decode(code)
    x_m, y_m = xy_of_lonlat(network, np.array([area.longitudeCenter, area.latitudeCenter])).tolist()
    return Where(x_m, y_m, f"Plus Code {code}")


# Names


def _named_exactly(said: str, network: RoadNetwork) -> Where | None:
    if said in network.junction_index:
        x_m, y_m = network.junction_xy_m[network.junction_index[said]].tolist()
        return Where(x_m, y_m, f"node {said}")
    if said in network.edge_index:
        edge = network.edge_index[said]
        street = network.edge_street[edge]
        called = f"edge {said}" + (f" of {street}" if street else "")
        return _along([edge], called, network)
    return None


def _street(said: str, network: RoadNetwork) -> Where | None:
    names = _known_as(network).get(folded(said))
    if names is None:
        return None
    edges = [e for e, street in enumerate(network.edge_street) if street in names]
    return _along(edges, names[0], network)


def _along(edges: Sequence[int], called: str, network: RoadNetwork) -> Where:
    """Return a street: its point is the one on it that is nearest to its middle."""
    lines = network.edge_lines
    points = np.concatenate([lines.at(e, np.linspace(0.0, lines.length_m[e], 9)) for e in edges])
    away_m = np.linalg.norm(points - points.mean(axis=0), axis=1)
    x_m, y_m = points[int(np.argmin(away_m))].tolist()
    return Where(x_m, y_m, called, tuple(network.edge_ids[e] for e in edges))


def _crossing(said: str, network: RoadNetwork) -> Where | None:
    parts = [part for part in BETWEEN.split(said) if part]
    if len(parts) < 2:
        return None
    known = _known_as(network)
    if len(parts) > 2:
        raise InputError(f"{as_written(said)} names {len(parts)} streets; give two that cross")
    for part in parts:
        if folded(part) not in known:
            raise InputError(
                f"{as_written(part)} is no street of this net; {_meant(part, network)}"
            )
    one, other = (known[folded(part)] for part in parts)
    if one == other:
        raise InputError(
            f"{as_written(said)} names {one[0]} twice; give a street that crosses it, or "
            f"{one[0]} alone; {_crosses(one, network)}"
        )
    called = f"{one[0]} / {other[0]}"
    places = crossings(network, one, other)
    if len(places) == 1:
        return Where(*places[0], called)
    if places:
        listed = ", or ".join(coordinates(network, np.array(place)) for place in places[:SHOWN])
        raise InputError(f"{called} cross at {len(places)} places; give one of them: {listed}")
    raise InputError(f"{called} do not cross on this net; {_crosses(one, network)}")


def crossings(
    network: RoadNetwork, one: Iterable[str], other: Iterable[str]
) -> list[tuple[float, float]]:
    """Return where two streets cross, metres: one place for all nodes that are one crossing."""
    first, second = {*one}, {*other}
    nodes = [
        node
        for node, names in enumerate(street_names(network).node)
        if first & {*names} and second & {*names}
    ]
    groups: list[list[int]] = []
    for node in nodes:
        near = [group for group in groups if _is_near(network, node, group)]
        groups = [group for group in groups if group not in near]
        groups.append([node, *(member for group in near for member in group)])
    means = [network.node_xy_m[group].mean(axis=0).tolist() for group in groups]
    return sorted((x_m, y_m) for x_m, y_m in means)


def _is_near(network: RoadNetwork, node: int, group: Sequence[int]) -> bool:
    apart_m = np.linalg.norm(network.node_xy_m[group] - network.node_xy_m[node], axis=1)
    return bool(apart_m.min() <= ONE_CROSSING_M)


def _crosses(street: Sequence[str], network: RoadNetwork) -> str:
    met = {name for names in street_names(network).node if {*street} & {*names} for name in names}
    others = sorted(met - {*street})
    if not others:
        return f"{street[0]} crosses no street with a name"
    return f"{street[0]} crosses {', '.join(others[:SHOWN])}{', ...' if others[SHOWN:] else ''}"


@lru_cache(8)
def _known_as(network: RoadNetwork) -> Mapping[str, tuple[str, ...]]:
    """Return the streets' names by what is left of them when they are written loosely."""
    known: dict[str, dict[str, None]] = {}
    for name in network.edge_street:
        if name:
            known.setdefault(folded(name), {})[name] = None
    return {key: tuple(names) for key, names in known.items()}


def folded(name: str) -> str:
    """Return a street's name without what people leave out: case, accents, hyphens, endings."""
    parted = unicodedata.normalize("NFKD", name.casefold())
    plain = "".join(letter for letter in parted if not unicodedata.combining(letter))
    plain = re.sub(r"str\.?(?=\s|-|$)", "strasse", plain)
    return re.sub(r"[\s\-.'’]+", " ", plain).strip()


def _meant(said: str, network: RoadNetwork) -> str:
    known, part = _known_as(network), folded(said)
    near = difflib.get_close_matches(part, known, n=1, cutoff=NEAR)
    if near:
        return f"did you mean {known[near[0]][0]}?"
    begun = [known[name][0] for name in sorted(known) if part and part in name]
    if begun:
        return f"did you mean one of {', '.join(begun[:SHOWN])}{', ...' if begun[SHOWN:] else ''}?"
    ids = (*network.junction_ids, *network.edge_ids)
    near = difflib.get_close_matches(said, ids, n=1, cutoff=NEAR)
    return f"did you mean {near[0]}?" if near else f"give {FORMS}"
