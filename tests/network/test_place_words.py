"""Places in the words of somebody who rings, each as it is understood or refused."""

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import InputError
from planner.network.georeference import lonlat
from planner.network.place_words import (
    coordinates,
    crossings,
    degrees_of,
    folded,
    heading,
    on_road,
    told,
    where,
)
from planner.network.road_network import RoadNetwork
from support.instances import by_two_letters

UTM33 = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
# Main Street A-B-C-D along x; Side Street crosses at B, and again at D, 900 m on; the two
# carriageways of Long Lane cross at C and K, 20 m apart.
PLACES = {
    "A": (0.0, 0.0),
    "B": (100.0, 0.0),
    "C": (500.0, 0.0),
    "K": (520.0, 0.0),
    "D": (1000.0, 0.0),
    "E": (100.0, 100.0),
    "F": (500.0, 200.0),
    "G": (520.0, 200.0),
    "H": (1000.0, 100.0),
    "I": (0.0, 900.0),
    "J": (100.0, 900.0),
}
NAMES = {
    "AB": "Main Straße",
    "BC": "Main Straße",
    "CK": "Main Straße",
    "KD": "Main Straße",
    "BE": "Side-Street",
    "DH": "Side-Street",
    "CF": "Long Lane",
    "KG": "Long Lane",
    "IJ": "Far Alley",
}


def net(**changed: object) -> RoadNetwork:
    network = by_two_letters(PLACES, " ".join(NAMES))
    streets = tuple(NAMES[name] for name in network.edge_ids)
    return replace(network, edge_street=streets, **changed)  # type: ignore[arg-type]


def on_earth() -> RoadNetwork:
    return net(projection=UTM33, net_offset_m=(-400_000.0, -5_800_000.0))


def at(lat_lon: str) -> tuple[float, float]:
    found = degrees_of(lat_lon)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("text", "lat", "lon"),
    [
        ("52.43,13.52", 52.43, 13.52),
        ("52.43, 13.52", 52.43, 13.52),
        ("52.43 13.52", 52.43, 13.52),
        ("-33.9,-70.5", -33.9, -70.5),
        ("33.9S 70.5W", -33.9, -70.5),
        ("52.43N 13.52E", 52.43, 13.52),
        ("N52.43 E13.52", 52.43, 13.52),
        ("13.52 E, 52.43 N", 52.43, 13.52),
        ("n 52.43, e 13.52", 52.43, 13.52),
        ("52°25.8'N 13°31.2'E", 52.43, 13.52),
        ("52 25.8 N, 13 31.2 E", 52.43, 13.52),
        ("N52 25.8 E13 31.2", 52.43, 13.52),
        ("52°25'48\"N 13°31'12\"E", 52.43, 13.52),
        ("52 25 48 N 13 31 12 E", 52.43, 13.52),
    ],
)
def test_degrees_are_read_however_they_are_written(text: str, lat: float, lon: float) -> None:
    assert at(text) == pytest.approx((lat, lon))


@pytest.mark.parametrize(
    "text", ["52.43", "52.43N 13.52N", "52,43,13,52", "52 75 N 13 31 E", "a,b"]
)
def test_what_is_no_pair_of_degrees_is_none(text: str) -> None:
    assert degrees_of(text) is None


def test_a_place_by_degrees_lies_where_they_are() -> None:
    network = on_earth()
    lon, lat = lonlat(network, np.array([510.0, 100.0])).tolist()
    found = where(f"{lat:.7f},{lon:.7f}", network)
    assert (found.x_m, found.y_m) == pytest.approx((510.0, 100.0), abs=0.05)
    assert told(found, network) == coordinates(network, found.xy_m) == f"{lat:.5f} N {lon:.5f} E"


def test_plus_codes_are_the_middle_of_what_they_name() -> None:
    from openlocationcode import openlocationcode

    network = on_earth()
    lon, lat = lonlat(network, np.array([510.0, 100.0])).tolist()
    code = openlocationcode.encode(lat, lon)
    found = where(code.lower(), network)
    assert (found.x_m, found.y_m) == pytest.approx((510.0, 100.0), abs=15.0)
    assert told(found, network).startswith(f"Plus Code {code}: ")
    with pytest.raises(InputError, match="is a short Plus Code; give it in full"):
        where(code[4:], network)


@pytest.mark.parametrize(
    ("text", "x_m", "y_m", "called"),
    [
        ("Main Straße / Long Lane", 510.0, 0.0, "Main Straße / Long Lane"),  # one crossing
        ("long lane/main strasse", 510.0, 0.0, "Long Lane / Main Straße"),
        ("Main Str. & Long-Lane", 510.0, 0.0, "Main Straße / Long Lane"),
        ("Long Lane at Main Straße", 510.0, 0.0, "Long Lane / Main Straße"),
        ("F", 500.0, 200.0, "node F"),
        ("  F ", 500.0, 200.0, "node F"),
        ("far alley", 50.0, 900.0, "Far Alley"),
        ("IJ", 50.0, 900.0, "edge IJ of Far Alley"),
        ("300, 40", 300.0, 40.0, "x 300 m, y 40 m"),  # there is no projection
    ],
)
def test_names_are_understood(text: str, x_m: float, y_m: float, called: str) -> None:
    found = where(text, net())
    assert (found.x_m, found.y_m) == pytest.approx((x_m, y_m), abs=6.0)
    assert found.called == called
    assert bool(found.edges) == (called.startswith(("edge", "Far")))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty; give 52.43,13.52"),
        ("Mein Straße", '"Mein Straße" is no place of this net; did you mean Main Straße?'),
        (
            "Main Straße / Lang Lane",
            '"Lang Lane" is no street of this net; did you mean Long Lane?',
        ),
        (
            "Main Straße / Far Alley",
            "not cross on this net; Main Straße crosses Long Lane, Side",
        ),
        ("Far Alley / Long Lane", "Far Alley crosses no street with a name"),
        (
            "Main Straße / Side Street",
            "cross at 2 places; give one of them: x 100 m, y 0 m, or",
        ),
        ("A / B / C", "names 3 streets; give two that cross"),
        ("Main Str / main strasse", "names Main Straße twice; give a street that crosses it, or"),
        ("lan", '"lan" is no place of this net; did you mean one of Long Lane?'),
        ("xyzzy", "is no place of this net; give 52.43,13.52 (latitude first), a street"),
    ],
)
def test_what_is_not_understood_says_what_would_be(text: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        where(text, net())
    assert said in str(refused.value)


def test_nodes_near_each_other_are_one_crossing() -> None:
    assert crossings(net(), ["Main Straße"], ["Long Lane"]) == [(510.0, 0.0)]
    assert len(crossings(net(), ["Main Straße"], ["Side-Street"])) == 2


def test_a_place_is_moved_onto_a_road_and_told_if_it_was_far() -> None:
    network = net()
    near, said = on_road("300,20", where("300,20", network), network)
    assert (near.x_m, near.y_m, said) == (300.0, 0.0, "")
    far, said = on_road("300,-45", where("300,-45", network), network)
    assert (far.x_m, far.y_m) == (300.0, 0.0)
    assert said == "moved 45 m to the nearest road, Main Straße: x 300 m, y 0 m"
    with pytest.raises(InputError, match=r"lies 300 m from the nearest road for cars \(Main Str"):
        on_road("300,-300", where("300,-300", network), network)


def test_exchanged_degrees_are_noticed() -> None:
    network = on_earth()
    lon, lat = (round(one, 3) for one in lonlat(network, np.array([510.0, 10.0])).tolist())
    with pytest.raises(InputError, match="nowhere near this net") as refused:
        where(f"{lon},{lat}", network)
    assert f"did you mean {lon} and {lat} the other way round?" in str(refused.value)
    with pytest.raises(InputError, match="give a place on it, latitude first"):
        where("13.52,100", network)


def test_exchanged_degrees_are_noticed_where_both_are_not_far() -> None:
    network = net(projection=UTM33, net_offset_m=(-500_000.0, -1_548_000.0))
    lon, lat = (round(one, 3) for one in lonlat(network, np.array([510.0, 10.0])).tolist())
    with pytest.raises(InputError, match=f"did you mean {lon} and {lat} the other way round"):
        on_road(f"{lon},{lat}", where(f"{lon},{lat}", network), network)
    with pytest.raises(InputError, match="give a place nearby"):
        on_road("15,15", where("15,15", network), network)


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        ("N", 0.0),
        ("ne", 45.0),
        ("NNW", 337.5),
        ("north-east", 45.0),
        ("South West", 225.0),
        ("90", 90.0),
        ("360°", 0.0),
        ("12.5 deg", 12.5),
    ],
)
def test_headings(text: str, degrees: float) -> None:
    assert heading(text) == degrees


@pytest.mark.parametrize("text", ["up", "NEN", "361", "-90", ""])
def test_what_is_no_heading(text: str) -> None:
    with pytest.raises(InputError, match="is no heading"):
        heading(text)


def test_points_of_the_compass_and_loose_names() -> None:
    assert folded("Ernst-Ruska-Ufer") == folded("ernst ruska  UFER")
    assert folded("Wegedornstr.") == folded("Wegedornstraße") == folded("WEGEDORNSTRASSE")
    assert folded("Strand") == "strand"
