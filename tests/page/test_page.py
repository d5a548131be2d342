"""A page as a file: one document, safe whatever names it holds, small, the same each time."""

import base64
import hashlib
import json
import re
import time
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from planner.mission.opening import OpenScenario
from planner.page import document
from planner.page.content import POINTS
from planner.page.document import reloading, settled
from planner.page.guess import page_of_guess
from planner.page.page import page
from planner.page.shown import Shown
from planner.page.words import odds
from support.page_runs import called, drives, shown

EVIL = "</script><img src=x onerror=\"document.title='owned'\"><!--<script>\u2028\u202e&amp;'"
HERE = Path(document.__file__).parent


class Elements(HTMLParser):
    """Which elements a page has, their attributes and the text in each."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.inside: dict[str, list[str]] = {}
        self._open = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._open = tag if tag != "script" else dict(attrs).get("type") or "script"
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        self._open = f"after {tag}"

    def handle_data(self, data: str) -> None:
        self.inside.setdefault(self._open, []).append(data)

    def text(self, tag: str) -> str:
        return "".join(self.inside[tag])

    @property
    def data(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.text("application/json"))
        return found


@pytest.fixture(scope="module")
def run(berlin: OpenScenario) -> Shown:
    return shown(called(berlin))


@pytest.fixture(scope="module")
def text(run: Shown) -> str:
    return page(run)


def test_only_its_own_script_and_style_may_run(text: str) -> None:
    elements = Elements(text)
    (policy,) = [a["content"] for t, a in elements.found if a.get("http-equiv")]
    assert policy is not None
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    for kind in ("script", "style"):
        digest = hashlib.sha256(elements.text(kind).encode()).digest()
        assert rules.pop(f"{kind}-src") == f"'sha256-{base64.b64encode(digest).decode()}'"
    assert rules == dict.fromkeys(("default-src", "base-uri", "form-action"), "'none'")
    assert not any("style" in a or any(k.startswith("on") for k in a) for _, a in elements.found)


def test_it_needs_nothing_else(text: str) -> None:
    elements = Elements(text)
    assert "://" not in text
    assert {tag for tag, _ in elements.found} & {"link", "img", "iframe", "object", "base"} == set()
    assert not any({"src", "href"} & attributes.keys() for _, attributes in elements.found)
    assert not re.search(r"fetch\(|XMLHttp|WebSocket|eval\(|innerHTML|document\.write", text)


def test_the_script_finds_its_elements(text: str) -> None:
    elements = Elements(text)
    ids = [attributes["id"] for _, attributes in elements.found if "id" in attributes]
    assert len(set(ids)) == len(ids)
    used = re.findall(r"(?:\$|getElementById)\(\"(\w+)\"\)", elements.text("script"))
    clicks = re.search(r"const clicks=\{(.*?)\};", elements.text("script"), re.DOTALL)
    assert clicks is not None
    used += re.findall(r"(?:^|,)\s*(\w+):", clicks[1])
    assert len(used) > 10
    assert set(used) <= set(ids)


def test_the_same_run_gives_the_same_page(run: Shown, text: str) -> None:
    again = replace(run)  # without what the first one derived
    assert page(again) == text


def test_names_are_text_and_nothing_else(berlin: OpenScenario) -> None:
    names = called(berlin, title=EVIL, street=EVIL, net=f"{EVIL[:40]}.net.xml")
    run = shown(replace(names, network=replace(names.network, attribution=EVIL)), 5)
    plain, elements = Elements(page(shown(berlin, 5))), Elements(page(run))
    assert [tag for tag, _ in elements.found] == [tag for tag, _ in plain.found]
    shown_as = EVIL.replace("\u2028", "\\u2028").replace("\u202e", "\\u202e")
    assert shown_as in elements.text("title")
    assert any(label[0].startswith(shown_as) for label in elements.data["labels"])
    assert "<" not in elements.text("application/json")
    assert "\u2028" not in page(run)


def test_without_a_script_there_are_odds_a_picture_and_legs(run: Shown, text: str) -> None:
    picture = text[text.index("<svg id") : text.index("</svg>") + 6]
    paths = {path.get("class"): path.get("d") for path in ElementTree.fromstring(picture)}
    assert set(paths) == {"roads", "targets", "flight", "uav", None}
    assert all(paths.pop(name) for name in ("roads", "targets", "flight", "uav"))
    assert ">1</text>" in picture  # legs are numbered
    head = text[text.index('<ul id="odds">') : text.index("</ul>")]
    assert f"<b>{odds(run.evaluated.detection_probability)}</b>" in head
    assert "by 14:" in head  # in the zone of the sighting
    rows = re.findall(r"<tr><td>(\d+)</td>", text)
    assert len(rows) == len(run.rows[0]) == len(Elements(text).data["uavs"][0]["legs"])
    assert re.search(r"<td>14:\d\d:\d\d\n14:\d\d:\d\d</td><td>52\.4\d{4},\n13\.5\d{4}</td>", text)


def test_its_curves_end_with_the_odds_of_the_plan(run: Shown, text: str) -> None:
    curves = Elements(text).data["curves"]
    assert len(curves) == len(run.curves) == 3
    assert all(len(curve) == POINTS + 1 and curve == sorted(curve) for curve in curves)
    mine, _, limit = curves
    assert mine[-1] == pytest.approx(run.evaluated.detection_probability, abs=1e-6)
    assert 0.0 < mine[-1] <= limit[-1]
    assert all(np.array(mine) <= np.array(limit))


def test_a_guess_is_a_page_before_there_is_a_plan(berlin: OpenScenario) -> None:
    text = page_of_guess(called(berlin, title=EVIL), drives(berlin, 40))
    elements = Elements(text)
    assert EVIL[:9] in elements.text("title")
    assert "no plan yet" in elements.text("b")
    assert {len(elements.data["curves"]), len(elements.data["uavs"])} == {0, 1}
    assert '<path class="targets" d="M' in text
    again = reloading(text)
    assert again.index('http-equiv="refresh"') < again.index("<title>")
    assert settled(again) == settled(text) == text


@pytest.mark.slow
def test_a_thousand_targets_and_five_thousand_roads_are_little(luxembourg: OpenScenario) -> None:
    assert len(luxembourg.network.edge_ids) > 5000
    run = shown(luxembourg, 1000, knots=300)
    begun_s = time.process_time()
    size = len(page(run).encode())
    assert time.process_time() - begun_s < 2.0
    assert size < 3_000_000


def test_script_and_style_are_small(text: str) -> None:
    elements = Elements(text)
    assert len(elements.text("script")) + len(elements.text("style")) < 30_000


COLOURS = re.compile(r"--(\w+):#([0-9a-f]{3,6})")


def luminance(colour: str) -> float:
    whole = "".join(c * 2 for c in colour) if len(colour) == 3 else colour
    parts = np.array([int(whole[k : k + 2], 16) for k in (0, 2, 4)]) / 255.0
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def contrast(one: str, other: str) -> float:
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def test_texts_and_marks_stand_out_in_light_and_dark() -> None:
    style = (HERE / "style.css").read_text(encoding="utf-8")
    light, dark = (
        dict(COLOURS.findall(block)) for block in re.findall(r":root\{(.*?)\}", style)[:2]
    )
    for colours in (light, light | dark):
        for back in ("bg", "card"):
            for name in ("fg", "dim", "acc", "bad"):
                assert contrast(colours[name], colours[back]) >= 4.5, name
        for name in ("dot", "uav", "seen", "c1", "c2", "c3", "c4", "c5"):
            assert contrast(colours[name], colours["bg"]) >= 3.0, name
