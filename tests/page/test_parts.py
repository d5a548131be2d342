"""What a page is made of: columns, places on the Earth, rows, words."""

import base64
import re
import shlex
import subprocess
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.clock import moment
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.mission.opening import OpenScenario
from planner.network.georeference import lonlat
from planner.page.content import Drawn, page_content
from planner.page.document import HERE, TEXT, tight
from planner.page.earth import Box, earth_content, mgrs_square, utm_zone
from planner.page.earth import band as band_of
from planner.page.frame import MOST, NEVER, Frame, packed
from planner.page.legend import dots
from planner.page.rows import CLIMBS, COMES_DOWN, HOME, HOVERS, rows_of
from planner.page.still import Flown, still
from planner.page.targets import MOST_KNOTS, MOST_TARGETS, drawn_knots, picked
from planner.page.words import Clock, for_posix, for_powershell, odds
from support.page_runs import called, drives, shown

SIGHTED = moment("2026-05-01T23:58:30+05:30")


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<u2").astype(float)


@given(st.lists(st.integers(0, NEVER)))
def test_columns_come_back(numbers: list[int]) -> None:
    assert unpacked(packed(np.array(numbers, dtype=np.int64))).tolist() == numbers


@given(
    st.lists(st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)), min_size=1, max_size=9),
    st.floats(1.0, 1e5),
)
def test_a_frame_is_off_by_half_a_step(places: list[tuple[float, float]], until_s: float) -> None:
    places_m = np.array(places)
    frame = Frame.around(places_m, until_s)
    back = frame.places(places_m) * frame.step_m + (frame.west_m, frame.south_m)
    assert np.abs(back - places_m).max() <= frame.step_m * 0.501 + 1e-6
    assert frame.step_m <= max(np.ptp(places_m, axis=0).max(), 1.0) / MOST * 1.001
    steps = frame.times(np.array([0.0, until_s / 3, until_s, np.inf]))
    assert steps.tolist() == [0, -(-MOST // 3), MOST, NEVER]


def test_targets_move_on_a_page_as_they_do(berlin: OpenScenario) -> None:
    run = shown(berlin)
    drawn = Drawn.of(run)
    content = page_content(run, drawn)["targets"]
    frame, knots = drawn.frame, unpacked(content["knots"]).astype(int)
    again = Futures(
        unpacked(content["t"]) * frame.step_s,
        frame.west_m + unpacked(content["x"]) * frame.step_m,
        frame.south_m + unpacked(content["y"]) * frame.step_m,
        np.concatenate(([0], np.cumsum(knots))),
        run.fresh.weight,
        unpacked(content["gone"]) > 0,
    )
    for time_s in (0.0, 13.7, 60.0, 200.0):
        one, other = run.fresh.positions(time_s), again.positions(time_s)
        off_m = np.hypot(*(one - other).T)
        assert np.nanmax(off_m) <= 0.1 * run.radius_m + 1.0
    assert len(again.time_s) < len(run.fresh.time_s)
    assert content["seen"] == packed(frame.times(run.evaluated.seen_at))


def test_many_targets_are_picked_evenly() -> None:
    assert picked(7).tolist() == [0, 1, 2, 3, 4, 5, 6]
    index = picked(4 * MOST_TARGETS)
    assert len(np.unique(index)) == MOST_TARGETS
    assert set(np.diff(index)) <= {4, 5}


def test_too_many_knots_are_thinned(monkeypatch: pytest.MonkeyPatch, berlin: OpenScenario) -> None:
    futures = drives(berlin, 5, knots=60)
    whole = drawn_knots(futures, 60.0)
    assert len(whole.time_s) < MOST_KNOTS
    monkeypatch.setattr("planner.page.targets.MOST_KNOTS", 20)
    assert len(drawn_knots(futures, 60.0).time_s) <= 20


# On the Earth


def test_a_page_knows_degrees_and_the_grid(berlin: OpenScenario) -> None:
    network = berlin.network
    low_m, high_m = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    box = Box(*low_m.tolist(), *high_m.tolist())
    earth = earth_content(network, box, box)
    assert earth is not None
    places_m = np.random.default_rng(1).uniform(low_m, high_m, (50, 2))
    u, v = ((places_m - earth["middle"]) / earth["half"]).T
    terms = [(i, j) for i in range(4) for j in range(4 - i)]
    for axis, name in enumerate(("lon", "lat")):
        found = sum(k * u**i * v**j for k, (i, j) in zip(earth[name], terms, strict=True))
        assert np.abs(found - lonlat(network, places_m)[:, axis]).max() < 3e-6
    assert earth["north"] == pytest.approx(1.18, abs=0.02)  # grid north is west of the true one
    grid = earth["grid"]
    assert (grid["zone"], grid["squares"]) == ("33U", "UU/VU")
    to_utm = pyproj.Transformer.from_crs(4326, 32633, always_xy=True)
    for line in grid["lines"]:
        degrees = lonlat(network, np.array(line["xy"]))
        off_m = np.array(to_utm.transform(*degrees.T))[line["axis"]] - 1000 * float(line["km"])
        assert np.abs(off_m).max() < 0.2
        assert float(line["km"]) * 1000 % grid["step_m"] == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("lon", "lat", "square"),
    [
        (-157.916861, 21.309433, "4QFJ"),  # Honolulu, the example of the standard
        (13.6, 52.43, "33UVU"),
        (151.2153, -33.8568, "56HLH"),
        (5.32, 60.39, "32VKN"),  # Bergen, in the wide zone of Norway
        (15.63, 78.22, "33XWG"),  # Longyearbyen
    ],
)
def test_squares_have_their_letters(lon: float, lat: float, square: str) -> None:
    zone = utm_zone(lon, lat)
    metres = pyproj.Proj(proj="utm", zone=zone, south=lat < 0, datum="WGS84")(lon, lat)
    assert f"{zone}{band_of(lat)}{mgrs_square(zone, *metres)}" == square


# Rows


def test_a_flight_off_the_roads_is_told_by_its_streets(berlin: OpenScenario) -> None:
    network = berlin.network
    road = int(np.argmax(network.road_length_m))
    a, b, c = network.xy(np.full(3, road), network.road_length_m[road] * np.array([0.3, 0.4, 0.5]))
    home = a + np.array([0.0, 900.0])
    x_m, y_m = np.array([home, a, a, b, c, home]).T
    track = Track(np.array([0.0, 60.0, 80.0, 90.0, 100.0, 160.0]), x_m, y_m, np.zeros((0, 2)))
    rows = rows_of(track, (), network, home_m=tuple(home), radius_m=60.0)
    names = [row.name for row in rows]
    assert names[0].startswith("across to ")
    assert names[1:] == [HOVERS, names[2], HOME]
    assert not names[2].startswith("across")
    assert [row.end_s for row in rows] == [
        60.0,
        80.0,
        100.0,
        160.0,
    ]
    assert rows[0].bearing_deg == pytest.approx(180.0)
    assert rows[2].length_m == pytest.approx(np.hypot(*(b - a)) + np.hypot(*(c - b)))


def test_what_it_does_in_one_place_before_and_after_it_sees_is_no_hovering(
    berlin: OpenScenario,
) -> None:
    home = berlin.network.shape_xy_m[0]
    x_m, y_m = np.array([home, home, home, home + 500.0, home, home]).T
    times_s = np.array([0.0, 40.0, 50.0, 100.0, 150.0, 210.0])
    track = Track(times_s, x_m, y_m, np.array([[40.0, 150.0]]))
    rows = rows_of(track, (), berlin.network, home_m=tuple(home), radius_m=60.0)
    assert [row.name for row in rows if row.length_m == 0.0] == [CLIMBS, HOVERS, COMES_DOWN]


# Words


def test_times_are_those_of_the_place() -> None:
    clock = Clock(SIGHTED)
    assert (clock.at(0.0), clock.at(90.0), clock.short(90.0)) == ("23:58:30", "00:00:00", "00:00")
    assert clock.as_dict() == {"sighted_ms": SIGHTED.timestamp() * 1000, "offset_min": 330}
    assert (Clock().at(3700.0), Clock().short(600.0), Clock().short(30.0)) == (
        "1:01:40",
        "10 min",
        "30 s",
    )
    assert Clock().as_dict() is None


@given(st.floats(0.0, 3000.0), st.floats(1.0, 40_000.0), st.booleans())
def test_the_headline_has_few_round_times(from_s: float, lasts_s: float, clocked: bool) -> None:
    clock = Clock(SIGHTED if clocked else None)
    times_s = clock.round_times_s(from_s, from_s + lasts_s)
    assert len(times_s) <= 6
    assert all(from_s < time_s <= from_s + lasts_s for time_s in times_s)
    assert times_s == sorted(set(times_s))
    for time_s in times_s:
        if clocked:
            assert (SIGHTED + timedelta(seconds=time_s)).second == 0
        else:
            assert time_s % 60.0 == 0.0


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (0.0, "0 %"),
        (1e-4, "<1 %"),
        (0.445, "45 %"),
        (0.5, "50 %"),
        (0.9999, ">99 %"),
        (1.0, "100 %"),
    ],
)
def test_odds_are_whole_per_cents(share: float, said: str) -> None:
    assert odds(share) == said


NASTY = [
    "$(touch x);'\".net.xml",
    "$(touch x);'\"\n.net.xml",
    "`id`'' \\ %PATH% \u2019;\u201b.xml",
    "-rf",
]


@pytest.mark.parametrize("name", NASTY)
def test_a_shell_takes_a_name_as_it_is(name: str) -> None:
    quoted = for_posix(name)
    assert quoted is not None
    done = subprocess.run(["sh", "-c", f"printf %s {quoted}"], capture_output=True, check=True)
    assert done.stdout.decode() == name.replace("-rf", "./-rf")


def powershell_words(line: str) -> list[str]:
    """Read single-quoted texts as PowerShell does: it takes five characters for such a quote."""
    words, k = [], 0
    quotes = "'\u2018\u2019\u201a\u201b"
    while k < len(line):
        assert line[k] in quotes, f"{line[k:]} is outside quotes"
        k, word = k + 1, ""
        while True:
            if line[k] in quotes and line[k + 1 : k + 2] and line[k + 1] in quotes:
                word, k = word + line[k], k + 2
            elif line[k] in quotes:
                k += 1
                break
            else:
                word, k = word + line[k], k + 1
        words.append(word)
    return words


@pytest.mark.parametrize("name", NASTY)
def test_powershell_takes_a_name_as_it_is(name: str) -> None:
    quoted = for_powershell(name)
    assert quoted is not None
    assert powershell_words(quoted) == [name.replace("-rf", "./-rf")]


@pytest.mark.parametrize("name", ["\x1b[201~rm -rf ~\n.net.xml", "a\u202eb.xml", "a\rb.xml"])
def test_no_command_has_a_name_that_a_terminal_obeys(berlin: OpenScenario, name: str) -> None:
    assert for_posix(name) is for_powershell(name) is None
    run = shown(called(berlin, net=name), 3)
    assert page_content(run, Drawn.of(run))["call"] is None


def test_a_net_without_a_projection_has_metres(berlin: OpenScenario) -> None:
    plane = replace(berlin, network=replace(berlin.network, projection=None))
    run = shown(called(plane, net="town.net.xml"), 3)
    content = page_content(run, Drawn.of(run))
    assert content["earth"] is None
    assert content["call"]["rest"][0] == "--drone-at=600.0,700.0"


def test_a_command_is_numbers_but_for_the_net(berlin: OpenScenario) -> None:
    run = shown(called(berlin, net=NASTY[0], title="$(touch x)"), 3)
    call = page_content(run, Drawn.of(run))["call"]
    assert shlex.split(call["sh"]) == [NASTY[0]]
    assert call["rest"] == ["--drone-at=52.43046,13.52019", "--battery=25min"]


def test_legs_are_numbered_in_the_still_picture_where_there_is_room() -> None:
    begins_m = np.array([[0.0, 0.0], [1.0, 1.0], [500.0, 500.0], [5000.0, 0.0]])
    picture = still(
        Box(-500.0, -500.0, 1000.0, 1000.0),
        roads=[],
        targets_m=np.zeros((0, 2)),
        flights=[Flown(Track([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [[0.0, 1.0]]), begins_m)],
        label="map",
    )
    assert re.findall(r"<text [^>]*>(\d+)</text>", picture) == ["1", "3"]


def test_targets_look_alike_in_the_legend_and_the_still_picture() -> None:
    """Of many targets the looks begin anew, in both at the same one."""
    many = 6
    box, xy_m = Box(0.0, 0.0, 100.0, 100.0), np.full((many, 2), 50.0)
    picture = still(box, roads=[], targets_m=xy_m, target=np.arange(many), flights=[], label="")
    there = re.findall(r'class="targets ?(t\d)?"', picture)
    shapes = dots({number: f"target {number}" for number in range(many)}).split("</svg>")[:-1]
    listed = [(re.findall(r'class="(t\d)"', shape) or [""])[0] for shape in shapes]
    assert there == listed == ["", "t1", "t2", "t3", "", "t1"]
    assert 'class="t1"' in dots({1: "blue"})  # the other one is found


# Scripts

SIGNS = (
    ">>>",
    "===",
    "!==",
    "...",
    "**",
    "=>",
    "==",
    "!=",
    "<=",
    ">=",
    "&&",
    "||",
    "??",
    "++",
    "--",
)
SIGNS += ("+=", "-=", "*=", "/=", ">>", "<<", "?.", "//", "/*")
TOKEN = re.compile(r"[\w$]+(?:\.\d+)?|" + "|".join(map(re.escape, SIGNS)) + r"|\S")


def tokens(script: str) -> list[str]:
    """A script's tokens: the longest signs first, as a browser reads them, and whole texts."""
    parts = re.split(TEXT, script)
    found = [[part] if k % 2 else TOKEN.findall(part) for k, part in enumerate(parts)]
    return [token for some in found for token in some]


@pytest.mark.parametrize("file", sorted(HERE.glob("*.js")), ids=lambda file: file.name)
def test_a_tight_script_has_the_same_tokens(file: Path) -> None:
    lines = (line.strip() for line in file.read_text(encoding="utf-8").splitlines())
    script = "\n".join(line for line in lines if not line.startswith("//"))
    assert tokens(tight(script)) == tokens(script)
    assert len(tight(script)) < 0.95 * len(script)


def test_signs_that_would_become_one_stay_apart() -> None:
    for script in ("a - -b", "a + +b", "a - --b", 'a + " - b "', "`${a} - b`"):
        assert tokens(tight(script)) == tokens(script)
    assert tight("a + b  =>  c ? d : [ e ] - 1") == "a+b=>c?d:[e]-1"
