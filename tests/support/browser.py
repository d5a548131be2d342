"""Headless Chromium, which `tools/test.sh` installs where it can; tests without it are skipped."""

import base64
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
MISSING = "chromium and chromium-driver are not installed: sudo apt-get install them"
FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"),
    *("--hide-scrollbars", "--lang=en"),
)
PRESS = """
const [key, more] = arguments;
document.activeElement.dispatchEvent(
  new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true, ...more })
);
"""
DRAG = """
const map = document.getElementById("map"), [[x, y], [u, v]] = arguments;
map.setPointerCapture = () => {};
const say = (kind, clientX, clientY) =>
  map.dispatchEvent(new PointerEvent(kind, { pointerId: 1, bubbles: true, clientX, clientY }));
say("pointerdown", x, y);
if (u !== x || v !== y) say("pointermove", u, v);
say("pointerup", u, v);
"""


class Browser:
    """One window, and what its pages say."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def look(
        self, page: Path | str, *, wide: int, high: int, scale: int = 1, dark: bool = False
    ) -> None:
        """Open a page, a file or an address, in a window of a size, in pixels of the page."""
        size = {"width": wide, "height": high, "deviceScaleFactor": scale, "mobile": wide < 600}
        self._say("Emulation.setDeviceMetricsOverride", size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._say("Emulation.setEmulatedMedia", {"features": [scheme]})
        self.driver.get(page if isinstance(page, str) else page.resolve().as_uri())

    def until(self, condition: str, *, within_s: float = 20.0) -> None:
        """Wait until an expression of the page's script is true, and fail if it does not get so."""
        ends_s = time.monotonic() + within_s
        while not self.script(f"return Boolean({condition})"):
            assert time.monotonic() < ends_s, f"{condition}: {self.text('body')[:2000]}"
            time.sleep(0.1)

    def script(self, text: str, *arguments: Any) -> Any:
        """Run a script in the page and return what it returns."""
        return self.driver.execute_script(text, *arguments)

    def text(self, selector: str) -> str:
        """Return the text of an element."""
        return str(self.script("return document.querySelector(arguments[0]).innerText", selector))

    def press(self, key: str, **more: bool) -> None:
        """Press a key on what has the focus."""
        self.script(PRESS, key, more)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag from one place on the map to another, in pixels of the window."""
        self.script(DRAG, start, end)

    def tap(self, x: float, y: float) -> None:
        """Tap a place on the map, in pixels of the window."""
        self.drag((x, y), (x, y))

    def complaints(self) -> list[str]:
        """Return what has been said on the console since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def picture(self, path: Path) -> None:
        """Save what the window shows."""
        path.write_bytes(base64.b64decode(self.driver.get_screenshot_as_base64()))

    def pdf(self, path: Path) -> None:
        """Save the page as it is printed."""
        printed = self._say("Page.printToPDF", {"printBackground": True})
        path.write_bytes(base64.b64decode(printed["data"]))

    def _say(self, command: str, options: Mapping[str, Any]) -> Any:
        return self.driver.execute_cdp_cmd(command, dict(options))


@contextmanager
def opened(*flags: str) -> Iterator[Browser]:
    """Open a browser, or skip the test where there is none."""
    if CHROMIUM is None or DRIVER is None:
        pytest.skip(MISSING)
    webdriver = pytest.importorskip("selenium.webdriver")
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, *flags):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.ChromeService(executable_path=DRIVER)
    driver = webdriver.Chrome(options=options, service=service)
    try:
        yield Browser(driver)
    finally:
        driver.quit()
