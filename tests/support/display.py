"""A screen that nobody sees, and a hand that closes windows on it."""

import ctypes
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

SIZE = "1200x950x24"
CLIENT_MESSAGE = 33  # of X11's events


@dataclass(frozen=True)
class Screen:
    """A running display and the file that holds its pixels."""

    name: str  # what DISPLAY is set to
    pixels: Path

    def shot(self) -> np.ndarray:
        """What is on it now, (height, width, 3) of red, green, blue from 0 to 255."""
        content = self.pixels.read_bytes()  # X window dump: a header, colours, then rows
        header = np.frombuffer(content, ">u4", 25)
        first, width, height, row, colours = (int(header[k]) for k in (0, 4, 5, 12, 19))
        rows = np.frombuffer(content, np.uint8, height * row, first + 12 * colours)
        return rows.reshape(height, -1, 4)[:, :width, 2::-1]

    def count(self, red: int, green: int, blue: int) -> int:
        """How many pixels have exactly this colour."""
        return int(np.all(self.shot() == (red, green, blue), axis=2).sum())

    def close_windows(self, title: str) -> int:
        """Ask all windows whose title holds a text to close, as their cross does; how many."""
        return _close(self.name, title)


@contextmanager
def screen(folder: Path) -> Iterator[Screen]:
    """A display of its own, whose pixels lie in a folder, or skip where Xvfb is missing."""
    program = shutil.which("Xvfb")
    if program is None:
        pytest.skip("Xvfb is not installed (apt-get install xvfb)")
    options = ["-displayfd", "1", "-screen", "0", SIZE, "-fbdir", str(folder), "-nolisten", "tcp"]
    with subprocess.Popen(
        [program, *options], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as server:
        assert server.stdout is not None
        try:
            yield Screen(f":{server.stdout.readline().strip()}", folder / "Xvfb_screen0")
        finally:
            server.terminate()


class _Message(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("message_type", ctypes.c_ulong),
        ("format", ctypes.c_int),
        ("data", ctypes.c_long * 5),
        ("room", ctypes.c_long * 24),  # an event of X11 may be as large
    ]


# What X11 does where a window has gone meanwhile; its own way is to end the process.
_ignores = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(lambda *_: 0)


def _close(name: str, title: str) -> int:
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XSetErrorHandler(_ignores)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XDefaultRootWindow.restype = x11.XInternAtom.restype = ctypes.c_ulong
    display = ctypes.c_void_p(x11.XOpenDisplay(name.encode()))
    delete = x11.XInternAtom(display, b"WM_DELETE_WINDOW", 0)
    protocols = x11.XInternAtom(display, b"WM_PROTOCOLS", 0)
    closed = 0
    for window in _windows(x11, display):
        said = ctypes.c_char_p()
        x11.XFetchName(display, ctypes.c_ulong(window), ctypes.byref(said))
        if title.encode() in (said.value or b""):
            data = (ctypes.c_long * 5)(delete)
            message = _Message(CLIENT_MESSAGE, 0, 1, None, window, protocols, 32, data)
            where = ctypes.c_ulong(window)
            x11.XSendEvent(display, where, 0, ctypes.c_long(0), ctypes.byref(message))
            closed += 1
    x11.XCloseDisplay(display)
    return closed


def _windows(x11: ctypes.CDLL, display: ctypes.c_void_p) -> list[int]:
    """The windows right on the screen."""
    root = ctypes.c_ulong(x11.XDefaultRootWindow(display))
    found, many = ctypes.POINTER(ctypes.c_ulong)(), ctypes.c_uint()
    ignored = ctypes.c_ulong()
    unused = ctypes.byref(ignored)
    x11.XQueryTree(display, root, unused, unused, ctypes.byref(found), ctypes.byref(many))
    return found[: many.value]
