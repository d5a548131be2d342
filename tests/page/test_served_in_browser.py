"""The served page in a browser: a call by tapping the map; pictures of it are kept."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from planner.cli.desk import Desk
from planner.mission.call_net import net_of
from planner.page.serving import page_of_net
from support import fake_planner
from support.browser import Browser, opened
from support.command_line import TOWN
from support.serving import served

PICTURES = Path(__file__).parents[2] / ".pytest_cache" / "pages"
FIELD = "return document.getElementById('ask').elements[arguments[0]].value"
SAY = "document.getElementById('ask').elements[arguments[0]].value = arguments[1]"
CLICK = "document.querySelector(arguments[0]).click()"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with opened() as one:
        PICTURES.mkdir(parents=True, exist_ok=True)
        yield one


@pytest.mark.slow
def test_a_call_by_tapping(browser: Browser, tmp_path: Path) -> None:
    blank, links = page_of_net(net_of(TOWN)[1], "a town"), list[str]()
    (tmp_path / "page").write_text(blank.replace("<h1>", "<h1 id='new'>"), encoding="utf-8")
    with served(Desk(TOWN, tmp_path, (), fake_planner.PROGRAM), blank, links):
        for wide in (390, 1280):
            browser.look(links[-1], wide=wide, high=800)
            assert browser.script("return document.documentElement.scrollWidth") == wide
            assert browser.script("return location.search") == ""
            browser.picture(PICTURES / f"served-{wide}.png")
        browser.tap(400, 300)
        assert browser.script(FIELD, "last_seen").count(",") == 1
        assert browser.script(FIELD, "heading") == ""
        browser.drag((400, 300), (460, 300))
        assert browser.script(FIELD, "heading") == "90"
        seen = browser.script(FIELD, "last_seen")
        browser.script(CLICK, "[value=drone_at]")
        browser.tap(300, 500)
        assert browser.script(FIELD, "last_seen") == seen != browser.script(FIELD, "drone_at")
        browser.script(SAY, "at", "waits")
        browser.script(CLICK, "#plan")
        browser.until(
            "document.getElementById('new') && document.querySelector('#screen').innerText"
        )
        assert not browser.script("return document.getElementById('files').hidden")
        assert browser.text("#screen") == "found by 14:20: 23 %"
        assert browser.script(FIELD, "heading") == "90"
        browser.until("!document.getElementById('stop').hidden")
        browser.script(CLICK, "#stop")
        browser.until("document.getElementById('stop').hidden")
        assert browser.text("#told") == "the best plan takes off 14:07"
        browser.script(SAY, "at", "faults")
        browser.script(CLICK, "#plan")
        browser.until("document.getElementById('told').textContent.includes('no street')")
        assert browser.complaints() == []
    browser.until("document.getElementById('told').textContent.startsWith('no word')")


@pytest.mark.long
def test_a_call_in_a_town(browser: Browser, tmp_path: Path) -> None:
    """The program itself plans here, to the end: minutes."""
    links = list[str]()
    blank = page_of_net(net_of("berlin")[1], "Berlin")
    with served(Desk("berlin", tmp_path), blank, links) as server:
        browser.look(links[-1], wide=1280, high=800)
        browser.tap(400, 400)
        browser.drag((400, 400), (460, 360))
        browser.script(CLICK, "[value=drone_at]")
        browser.tap(300, 500)
        browser.script(CLICK, "#plan")
        browser.until("document.querySelector('.legs tbody tr')", within_s=1200)
        browser.picture(PICTURES / "served-plan.png")
        browser.script(CLICK, "#stop")
        browser.until("document.getElementById('stop').hidden", within_s=600)
        assert "takes off" in browser.text("#told")
        browser.press("End")
        assert browser.text("#found") in browser.text("#odds")
        fetched = "return fetch('/flight.plan').then((answer) => answer.text())"
        assert '"fileType": "Plan"' in browser.script(fetched)
        browser.picture(PICTURES / "served-done.png")
        browser.look(f"http://127.0.0.1:{server.port}/", wide=390, high=800)
        browser.until("!document.getElementById('files').hidden")
        assert browser.script("return document.documentElement.scrollWidth") == 390
        browser.picture(PICTURES / "served-done-390.png")
        assert browser.complaints() == []
