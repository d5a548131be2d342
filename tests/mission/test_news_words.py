"""News in words: what each line means, and what is said of one that means nothing."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import InputError
from planner.mission.news_values import Setting, time_of
from planner.mission.news_words import heard, sentence
from planner.scenario.news import FoundNews, NothingNews, ReportNews, SearchedNews
from support.instances import grid

NET = grid(3, 3, road_m=5000.0)
NODE, EDGE = NET.node_ids[4], NET.edge_ids[0]
SEEN = datetime(2026, 5, 1, 14, 0, tzinfo=UTC)
HERE = Setting(NET, SEEN, 1500.0)


def meant(line: dict[str, Any] | str, setting: Setting = HERE) -> Any:
    (one,) = heard(sentence(line) if isinstance(line, str) else line, setting).news
    return one


def test_a_sentence_is_a_report() -> None:
    one = meant(f"seen at {NODE} at 14:20, 70 % sure, within 300 m")
    assert isinstance(one, ReportNews)
    assert (one.at_s, one.heard_s, one.sure, one.radius_m) == (1200.0, 1500.0, 0.7, 300.0)
    x_m, y_m = NET.node_xy_m[4].tolist()
    assert (one.place.x_m, one.place.y_m) == (x_m, y_m)
    assert meant(f"{NODE} at -5min, 70%") == one.model_copy(update={"radius_m": 200.0})


def test_a_sentence_says_where_nothing_was() -> None:
    one = meant(f"nothing at {NODE} from 14:10 to 14:20, 80 %")
    assert isinstance(one, NothingNews)
    assert (one.from_s, one.to_s, one.sure, one.radius_m) == (600.0, 1200.0, 0.8, 200.0)


def test_a_street_is_news_of_its_edges() -> None:
    one = meant({"kind": "report", "place": EDGE, "at": 600, "sure": 0.5})
    assert (one.edges, one.place, one.radius_m) == ((EDGE,), None, 30.0)


def test_a_search_is_told_by_its_waypoints() -> None:
    way = [[0, 0, 0], [100, 5000, 0]]
    one = meant({"kind": "searched", "waypoints": way, "radius_m": 200, "detects": 0.6})
    assert isinstance(one, SearchedNews)
    assert np.array_equal(one.waypoints, way)


def test_lines_about_the_uav_add_up() -> None:
    delay = heard({"kind": "delay", "lasts": "2min"}, HERE)
    uav = heard({"kind": "uav", "place": {"x_m": 3, "y_m": 4}, "battery": "9min"}, HERE)
    standing = delay.then(uav).then(delay).standing_at(1500.0)
    assert (standing.late_s, standing.xy_m, standing.left_s) == (240.0, (3.0, 4.0), 540.0)


@pytest.mark.parametrize(
    ("said", "seconds"),
    [(90, 90.0), ("0:20:00", 1200.0), ("14:20", 1200.0), ("-5min", 1200.0), ("now", 1500.0)],
)
def test_times(said: Any, seconds: float) -> None:
    assert time_of("at", said, HERE) == seconds


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("somewhere", "is no news that is understood; write"),
        (f"seen at {NODE} at noon, 70 %", "is no time; write 14:05"),
        (f"seen at {NODE} at 14:20, 170 %", "sure: should be a probability; write 0.7"),
        ("seen at Nowhere at 14:20, 70 %", "is no place of this net"),
        ({"kind": "rumour"}, "kind: .* is no kind of news"),
        ({"kind": "delay", "last": 3}, "last: is no key of news of kind delay; did you mean lasts"),
        ({"kind": "delay"}, "lasts: is missing"),
        ({"kind": "uav"}, "says neither its place nor its battery"),
        ({"kind": "searched", "radius_m": 5}, "waypoints: is missing"),
        ({"kind": "report", "place": NODE, "sure": 1}, "at: is missing"),
        ({"kind": "report", "place": 7, "at": 1, "sure": 1}, "place: should be a place in words"),
        ({"kind": "report", "place": NODE, "at": 1, "sure": 1, "insist": 1}, "insist: should be"),
        ({"kind": "found", "target": -1}, "target: should be at least 0, not -1; give which"),
        ({"kind": "found", "target": 3}, "target: 3 is none of the targets; there is one"),
        ({"kind": "found", "target": "a"}, "target: should be a whole number, .*; give which"),
        ({"kind": ["report"]}, "kind: .* is no kind of news"),
        ({"kind": "uav", "place": {"x_m": "abc", "y_m": 1}}, "place.x_m: should be a number"),
        ({"kind": "uav", "place": {"x_m": None, "y_m": 1}}, "place.x_m: should be a number"),
        (f"seen at {NODE} at 14:20, 1..2 % sure", "is no news that is understood"),
        ({"kind": "report", "place": NODE, "at": 1, "sure": "1.2.3 %"}, "sure: should be a prob"),
        ({"kind": "report", "place": NODE, "at": 1, "sure": "."}, "sure: should be a prob"),
        ({"kind": "report", "place": NODE, "at": 1, "sure": 1, "radius_m": []}, "radius_m: should"),
        ({"kind": "delay", "lasts": float("inf")}, "lasts: should be a number"),
        (f"seen at {NODE} at 14:30, 70 %", "at: 0:30:00 is still to come, as it is 0:25:00 now"),
        (f"nothing at {NODE} from 14:20 to 14:30, 70 %", "to: 0:30:00 is still to come"),
        (
            {"kind": "searched", "waypoints": [[0, 0, 0], [9999, 0, 0]], "radius_m": 5},
            "waypoints: 2:46:39 is still to come",
        ),
        (
            {"kind": "searched", "waypoints": [[5, 0, 0], [1, 0, 0]], "radius_m": 5},
            "waypoints: go back in time",
        ),
        (
            {
                "kind": "searched",
                "waypoints": [[0, 0, 0], [9, 0, 0]],
                "sensor_on": [[5, 1]],
                "radius_m": 5,
            },
            "sensor_on: goes back in time",
        ),
    ],
)
def test_what_means_nothing_is_refused(line: Any, fault: str) -> None:
    with pytest.raises(InputError, match=fault) as caught:
        meant(line)
    assert "\n" not in str(caught.value)


def test_a_time_of_day_needs_one_for_time_0() -> None:
    with pytest.raises(InputError, match=r"target\.sighted_at"):
        time_of("at", "14:20", Setting(NET, None, 1500.0, Path()))


def test_several_targets_have_names() -> None:
    two = HERE._replace(targets=("target 1", "blue"))
    for said in ("blue", 2, "2"):
        one = heard({"kind": "found", "target": said}, two)
        assert one.news == (FoundNews(kind="found", target=1),)
        assert one.said == ("found: blue",)
    with pytest.raises(InputError, match="target: is missing; give which it is: target 1, blue"):
        heard({"kind": "found"}, two)
    with pytest.raises(InputError, match='"bleu" is none of the targets; '):
        heard({"kind": "found", "target": "bleu"}, two)
    with pytest.raises(InputError, match=r"0 is none of the targets; .*, or 1 to 2"):
        heard({"kind": "found", "target": 0}, two)


def test_a_sentence_names_the_target_that_was_seen() -> None:
    two = HERE._replace(targets=("target 1", "blue"))
    (one,) = heard(sentence(f"blue seen at {NODE} at 1200, 70 %"), two).news
    (two_by_number,) = heard(sentence(f"2 seen {NODE} at 1200, 70 %"), two).news
    assert one == two_by_number
    assert isinstance(one, ReportNews)
    assert one.target == 1
    with pytest.raises(InputError, match="target: is missing; give which it is: target 1, blue"):
        heard(sentence(f"seen at {NODE} at 1200, 70 %"), two)
    with pytest.raises(InputError, match='"green" is none of the targets; '):
        heard(sentence(f"green seen at {NODE} at 1200, 70 %"), two)


def test_the_name_of_the_only_target_may_be_said() -> None:
    alone = HERE._replace(targets=("blue",))
    said = (f"blue seen at {NODE} at 1200, 70 %", f"seen at {NODE} at 1200, 70 %")
    assert heard(sentence(said[0]), alone) == heard(sentence(said[1]), alone)


@pytest.mark.parametrize(
    ("said", "target", "place"),
    [
        ("seen at Seen Street", None, "Seen Street"),
        ("seen at An den Seen 5", None, "An den Seen 5"),
        ("seen An den Seen 5", None, "An den Seen 5"),
        ("at An den Seen 5", None, "An den Seen 5"),
        ("An den Seen 5", None, "An den Seen 5"),
        ("Seen at Seen", None, "Seen"),
        ("blue seen at An den Seen 5", "blue", "An den Seen 5"),
        ("Blue Seen At Seen Street", "Blue", "Seen Street"),
        ("blue van seen Seen Street", "blue van", "Seen Street"),
        ("seenland seen at A", "seenland", "A"),
    ],
)
def test_a_place_may_be_called_as_the_verb_is(said: str, target: str | None, place: str) -> None:
    found = sentence(f"{said} at 14:20, 70 %")
    assert (found.get("target"), found["place"], found["at"]) == (target, place, "14:20")
