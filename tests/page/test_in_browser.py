"""A page in a browser: what a person sees, presses and reads; pictures of it are kept."""

import argparse
import re
import shlex
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import shapely

from page.test_page import EVIL
from planner.cli.call_arguments import add_call, call_of
from planner.clock import moment
from planner.flight.airspace import Airspace
from planner.mission.opening import OpenScenario
from planner.page.document import digest, reloading
from planner.page.guess import page_of_guess
from planner.page.page import page
from planner.page.shown import Shown
from planner.page.words import odds
from support.browser import Browser, opened
from support.page_runs import called, drives, shown

PICTURES = Path(__file__).parents[2] / ".pytest_cache" / "pages"
A_MINUTE_LATER = moment("2026-05-01T14:08:00+05:30")  # than take-off, where pages open
WIDTHS = {"phone": 390, "desktop": 1280}
COLOURS = """
const map = document.getElementById("map"), seen = new Set();
const copy = new OffscreenCanvas(map.width, map.height).getContext("2d");
copy.drawImage(map, 0, 0);
const bits = copy.getImageData(0, 0, map.width, map.height).data;
for (let k = 0; k < bits.length; k += 4) seen.add(bits[k] + "," + bits[k + 1] + "," + bits[k + 2]);
return [...seen];
"""
TURNED = "return +document.getElementById('time').value"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with opened() as one:
        one.driver.execute_cdp_cmd("Emulation.setTimezoneOverride", {"timezoneId": "Asia/Tokyo"})
        yield one


@pytest.fixture(scope="module")
def run(berlin: OpenScenario) -> Shown:
    areas = Airspace(no_fly=shapely.box(900, 300, 1100, 500), fence=shapely.box(0, 0, 3000, 2000))
    return shown(replace(called(berlin), airspace=areas), 200)


@pytest.fixture(scope="module")
def file(run: Shown, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("page") / "page.html"
    file.write_text(page(run), encoding="utf-8")
    PICTURES.mkdir(parents=True, exist_ok=True)
    return file


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("kind", WIDTHS)
def test_it_shows_without_complaint(
    browser: Browser, file: Path, run: Shown, kind: str, dark: bool
) -> None:
    browser.look(file, wide=WIDTHS[kind], high=800, dark=dark)
    assert browser.complaints() == []
    assert browser.script("return document.documentElement.scrollWidth") == WIDTHS[kind]
    drone, target = ("255,140,59", "98,188,236") if dark else ("200,82,0", "0,114,178")
    area = "255,138,128" if dark else "179,38,30"
    assert {drone, target, area} <= set(browser.script(COLOURS))
    browser.picture(PICTURES / f"{kind}-{'dark' if dark else 'light'}.png")
    browser.press("End")
    assert browser.text("#found") == odds(run.evaluated.detection_probability)
    assert browser.text("#clock") == run.clock.at(run.until_s)  # whatever the reader's zone
    assert browser.complaints() == []


def test_keys_and_clicks_move_it(browser: Browser, file: Path, run: Shown) -> None:
    browser.look(file, wide=1280, high=800)
    start_s, rows = run.plan.take_off_s, run.rows[0]
    assert browser.script(TURNED) == start_s
    for key, more, after_s in (
        ("ArrowRight", {}, start_s + 10),
        ("ArrowRight", {"shiftKey": True}, start_s + 70),
        ("ArrowLeft", {"shiftKey": True}, start_s + 10),
        ("p", {}, start_s),
        ("n", {}, rows[1].start_s),
        ("Home", {}, 0),
    ):
        browser.press(key, **more)
        assert browser.script(TURNED) == round(after_s), key
    browser.script("document.querySelectorAll('.legs tbody button')[2].click()")
    assert browser.script(TURNED) == round(rows[2].start_s)
    assert browser.text("tr.here").split("\t")[0].strip() == "3"
    assert rows[2].name in browser.text("#doing")
    assert rows[2].name in browser.text("#state")
    browser.press(" ")
    assert browser.script("return document.getElementById('play').ariaLabel") == "Pause"
    browser.press(" ")
    browser.script("document.getElementById('map').focus()")
    browser.press("Enter")
    assert not browser.script("return document.getElementById('call').hidden")
    browser.press("Escape")
    for key in ("+", "-", "w", "a", "s", "d", "0", "g", "[", "]"):
        browser.press(key)
    assert browser.complaints() == []


def test_the_list_of_legs_is_one_stop_with_arrows_inside(browser: Browser, file: Path) -> None:
    browser.look(file, wide=1280, high=800)
    stop = (
        "return [...document.querySelectorAll('.legs button')]"
        ".filter((b) => b.tabIndex === 0).map((b) => b.innerText)"
    )
    here = "return document.activeElement.innerText"
    last = str(browser.script("return document.querySelectorAll('.legs button').length"))
    now_s = browser.script(TURNED)
    browser.script("document.querySelector('.legs button').focus()")
    for key, leg in (("ArrowDown", "2"), ("End", last), ("ArrowDown", last), ("Home", "1")):
        browser.press(key)
        assert browser.script(here) == leg, key
        assert browser.script(stop) == [leg]
    assert browser.script(TURNED) == now_s  # the list's keys are not those of time
    browser.driver.switch_to.active_element.send_keys("\ue004")  # Tab
    assert browser.script("return document.activeElement.tagName") == "SUMMARY"


def test_a_tap_gives_coordinates_and_a_command(browser: Browser, file: Path) -> None:
    browser.look(file, wide=1280, high=800)
    browser.tap(400, 400)
    lat, lon = map(float, browser.text("#place").split(", "))
    assert 52.41 < lat < 52.45
    assert 13.50 < lon < 13.56
    assert browser.text("code").startswith(
        f"planner now 'sumo:tools/game/DRT/osm.net.xml' --last-seen={lat:.5f},{lon:.5f} "
        "--at=2026-05-01T14:07:00+05:30 --drone-at="
    )
    parser = argparse.ArgumentParser()
    add_call(parser)
    meant = call_of(parser.parse_args(shlex.split(browser.text("code"))[2:]), A_MINUTE_LATER)
    said = dict(meant.understood)
    assert said["last seen"].startswith(f"{lat:.5f} N {lon:.5f} E")
    assert said["seen at"].endswith("60 s ago")
    assert "--heading" not in browser.text("code")
    browser.drag((400, 400), (460, 400))
    (to_deg,) = re.findall(r"--heading=(\d+)", browser.text("code"))
    assert abs(int(to_deg) - 90) <= 2  # north is nearly up
    assert browser.text("#place") == f"{lat:.5f}, {lon:.5f}"
    browser.picture(PICTURES / "tapped.png")
    browser.press("Escape")
    assert browser.script("return document.getElementById('call').hidden")


def test_it_tells_of_every_drone(browser: Browser, run: Shown, tmp_path: Path) -> None:
    plan = replace(run.plan, tracks=2 * run.plan.tracks, legs=2 * run.plan.legs)
    file = tmp_path / "two.html"
    scenario = replace(run.opened.scenario, others=(run.opened.scenario.uav,))
    two = replace(run.opened, scenario=scenario, other_airspaces=(None,))
    file.write_text(page(replace(run, opened=two, plan=plan)), encoding="utf-8")
    browser.look(file, wide=390, high=800)
    browser.script("document.querySelectorAll('.legs')[1].rows[3].click()")
    for number, line in enumerate(browser.text("#doing").split("drone ")[1:], 1):
        assert line.startswith(f"{number}: 3 {run.rows[0][2].name}")
    assert f"drone 2: 3 {run.rows[0][2].name}" in browser.text("#state")
    assert browser.complaints() == []
    browser.picture(PICTURES / "two.png")


def test_paper_has_the_grid(browser: Browser, file: Path) -> None:
    browser.look(file, wide=1280, high=800)
    browser.pdf(PICTURES / "paper.pdf")
    browser.script("dispatchEvent(new Event('beforeprint'))")
    assert "11,99,165" in browser.script(COLOURS)
    browser.script("dispatchEvent(new Event('afterprint'))")
    assert "11,99,165" not in browser.script(COLOURS)
    assert browser.complaints() == []


def test_other_peoples_words_show_as_text(
    browser: Browser, berlin: OpenScenario, tmp_path: Path
) -> None:
    names = called(berlin, title=EVIL, street=EVIL, net="$(touch x);'\".net.xml")
    run = shown(replace(names, network=replace(names.network, attribution=EVIL)), 5)
    file = tmp_path / "evil.html"
    file.write_text(page(run), encoding="utf-8")
    browser.look(file, wide=1280, high=800)
    browser.press("End")
    browser.tap(400, 400)
    assert browser.complaints() == []
    assert "<img src=x" in browser.text("h1")
    assert browser.script("return document.querySelectorAll('img, iframe').length") == 0
    assert browser.script("return document.title").startswith("</script>")
    assert "'$(touch x);'\\''\".net.xml'" in browser.text("code")
    assert "<img src=x" in browser.text(".legs tr:nth-child(2) td:nth-child(2)")


def test_without_a_script_it_is_still_read(browser: Browser, file: Path, run: Shown) -> None:
    browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        browser.look(file, wide=390, high=800)
        browser.picture(PICTURES / "still.png")
        shown_now = browser.driver.find_elements("css selector", "#still, .legs, #odds, #bar, #map")
        kinds = {one.tag_name: one.is_displayed() for one in shown_now}
        text = browser.driver.find_element("css selector", "#odds").text
        ids = ("methods", "still")
        places = {one: browser.driver.find_element("id", one).location["y"] for one in ids}
    finally:
        browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    assert kinds == {"svg": True, "table": True, "ul": True, "div": False, "canvas": False}
    assert re.search(odds(run.evaluated.detection_probability), text)
    assert places["methods"] < places["still"]  # on a phone figures come before the map


def test_it_follows_the_clock_while_the_flight_lasts(
    browser: Browser, berlin: OpenScenario, tmp_path: Path
) -> None:
    ago = browser.script("return new Date(Date.now() - 400000).toISOString().slice(0, 19)")
    file = tmp_path / "now.html"
    file.write_text(page(shown(called(berlin, sighted_at=f"{ago}+00:00"), 5)), encoding="utf-8")
    browser.look(file, wide=390, high=800)
    assert 399 <= browser.script(TURNED) <= 460
    assert browser.script("return document.getElementById('live').ariaPressed") == "true"


def test_an_open_page_turns_into_a_better_one_and_keeps_what_is_looked_at(
    browser: Browser, berlin: OpenScenario, run: Shown, tmp_path: Path
) -> None:
    file = tmp_path / "page.html"
    text = reloading(page_of_guess(called(berlin), drives(berlin, 50)))
    file.write_text(in_a_hurry(text), encoding="utf-8")
    for kind, wide in WIDTHS.items():
        browser.look(file, wide=wide, high=800)
        assert browser.script("return document.documentElement.scrollWidth") == wide
        browser.picture(PICTURES / f"guess-{kind}.png")
    assert "no plan yet" in browser.text("#odds")
    assert not browser.script("return document.getElementById('curve').checkVisibility()")
    browser.script("window.isOld = true")
    browser.press("ArrowRight", shiftKey=True)
    browser.press("+")
    at_s = browser.script(TURNED)
    browser.until("!window.isOld")
    assert browser.script(TURNED) == at_s
    file.write_text(page(run), encoding="utf-8")
    browser.until("document.querySelector('.legs')")
    assert browser.script(TURNED) == at_s
    browser.script("window.isOld = true")
    time.sleep(0.7)
    assert browser.script("return window.isOld")  # it is final
    assert browser.complaints() == []


def in_a_hurry(text: str) -> str:
    """Return a page that looks for a better one more often, which its policy allows."""
    text = text.replace("}, 3000);", "}, 300);")
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    return re.sub(r"script-src '[^']*'", f"script-src '{digest(script)}'", text, count=1)
