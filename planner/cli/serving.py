"""The server behind the served page: who may ask, what may be asked, and what is answered.

It answers whoever has its cookie, which the link's token is exchanged for, once. Another site's
page has neither cookie nor a right origin, and a name that was made to lead here is no address.
"""

import http.cookies
import ipaddress
import json
import logging
import secrets
import sys
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from planner.cli.desk import FILES, BusyError, Desk, words_of
from planner.errors import InputError
from planner.guard import parsed_json
from planner.messages import as_line
from planner.page.serving import served
from planner.scenario.profiles import shipped_profiles

log = logging.getLogger(__name__)

MOST_BYTES = 64_000  # of a body
LONGEST_LENGTH = 9  # digits that say how long it is; Python takes no more than some thousands
SLOW_S = 20.0  # that a client may take to send what it asks
ALIVE_S = 15.0  # between two signs of life to who listens
PLAIN, HTML, STREAM = (f"text/{kind}; charset=utf-8" for kind in ("plain", "html", "event-stream"))
HEADERS = {
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class _RefusedError(Exception):
    """A request is not answered, for a reason of one line."""

    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


class Server(ThreadingHTTPServer):
    """Serves a desk.

    Parameters
    ----------
    address
        Where, and the port; 0: any that is free.
    blank
        The page while there is no plan.
    on_link
        Told each new link: at first, and when one has been used up.
    """

    daemon_threads = True

    def __init__(
        self,
        address: tuple[str, int],
        desk: Desk,
        blank: str,
        on_link: Callable[[str], object],
    ) -> None:
        super().__init__(address, _Handler)
        self.desk, self.blank = desk, blank
        self.cookie, self.secret = f"planner-{self.port}", secrets.token_urlsafe(32)
        self._on_link, self._tokens = on_link, threading.Lock()
        self._new_link()

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self.server_address[1])

    def _new_link(self) -> None:
        self._token = secrets.token_urlsafe(16)
        self._on_link(f"http://{self.server_address[0]!s}:{self.port}/?token={self._token}")

    def takes(self, token: str) -> bool:
        """Return whether a token is the link's, which is used up by that."""
        with self._tokens:
            is_ours = secrets.compare_digest(token.encode(), self._token.encode())
            if is_ours:
                self._new_link()
        return is_ours

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ARG002
        """Tell in one line what went wrong with a request, unless its browser has just gone."""
        error = sys.exception()
        level = logging.DEBUG if isinstance(error, OSError) else logging.WARNING
        log.log(level, "%s: %s", client_address[0], as_line(repr(error)))


class _Handler(BaseHTTPRequestHandler):
    server: Server
    timeout = SLOW_S

    def do_GET(self) -> None:
        self._answered(self._get)

    def do_POST(self) -> None:
        self._answered(self._post)

    # Who may ask

    def _answered(self, answer: Callable[[str], None]) -> None:
        try:
            self._refuse_strangers()
            path, _, query = self.path.partition("?")
            token = parse_qs(query).get("token", [""])[0]
            if path == "/" and token and self.command == "GET":
                self._let_in(token)
                return
            if not self._is_known():
                raise _RefusedError(
                    HTTPStatus.FORBIDDEN, "open the link that the terminal shows; each opens once"
                )
            answer(path)
        except _RefusedError as refused:
            log.warning(
                "%s: refused %s: %s",
                self.client_address[0],
                as_line(self.requestline)[:80],
                refused,
            )
            self._send(f"{refused}\n", status=refused.status)

    def _refuse_strangers(self) -> None:
        """Refuse what another site's page has the browser ask."""
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        if not _is_address(host, self.server.port):
            raise _RefusedError(HTTPStatus.FORBIDDEN, "the host is not this server's address")
        is_asked_here = origin == f"http://{host}"
        if not is_asked_here and (origin is not None or self.command != "GET"):
            raise _RefusedError(HTTPStatus.FORBIDDEN, "asked from another origin than this page")

    def _let_in(self, token: str) -> None:
        if not (self._is_known() or self.server.takes(token)):
            raise _RefusedError(
                HTTPStatus.FORBIDDEN, "this link has been used; open the one the terminal shows now"
            )
        cookie = f"{self.server.cookie}={self.server.secret}; HttpOnly; SameSite=Strict; Path=/"
        headers = {"Location": "/", "Set-Cookie": cookie}
        self._send("", status=HTTPStatus.SEE_OTHER, headers=headers)

    def _is_known(self) -> bool:
        try:
            cookies = http.cookies.SimpleCookie(self.headers.get("Cookie", ""))
        except http.cookies.CookieError:
            return False
        found = cookies.get(self.server.cookie)
        value = "" if found is None else found.value
        return secrets.compare_digest(value.encode(), self.server.secret.encode())

    # What may be asked

    def _get(self, path: str) -> None:
        if path == "/":
            self._send(self._page(), kind=HTML)
        elif path == "/events":
            self._tell_events()
        elif path.removeprefix("/") in FILES:
            self._send_file(path.removeprefix("/"))
        else:
            raise _RefusedError(HTTPStatus.NOT_FOUND, "there is nothing of that name")

    def _post(self, path: str) -> None:
        if path not in ("/call", "/stop"):
            raise _RefusedError(HTTPStatus.NOT_FOUND, "there is nothing of that name")
        content = self._body()
        if path == "/call":
            self._begin(content)
        elif not self.server.desk.stop():
            raise _RefusedError(HTTPStatus.CONFLICT, "nothing is being planned")
        self._send("", status=HTTPStatus.ACCEPTED)

    def _begin(self, content: Any) -> None:
        try:
            self.server.desk.begin(words_of(content))
        except InputError as error:
            raise _RefusedError(HTTPStatus.BAD_REQUEST, str(error)) from error
        except BusyError as error:
            raise _RefusedError(HTTPStatus.CONFLICT, str(error)) from error
        except OSError as error:  # no memory, no disk
            reason = f"planning cannot begin ({error.strerror}); make room"
            raise _RefusedError(HTTPStatus.INSUFFICIENT_STORAGE, reason) from error

    def _body(self) -> Any:
        """Return what was sent, as JSON."""
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise _RefusedError(HTTPStatus.LENGTH_REQUIRED, "the length of the body is missing")
        if len(length) > LONGEST_LENGTH or int(length) > MOST_BYTES:
            raise _RefusedError(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a body has at most {MOST_BYTES} bytes"
            )
        if self.headers.get_content_type() != "application/json":
            raise _RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "a body should be JSON")
        try:
            return parsed_json(self.rfile.read(int(length)).decode())
        except ValueError:
            raise _RefusedError(HTTPStatus.BAD_REQUEST, "the body is not JSON") from None

    # What is answered

    def _page(self) -> str:
        desk = self.server.desk
        # Known before the page is read, which may be the next one.
        state = {"said": dict(desk.said), "plans": desk.plans, "pages": desk.pages}
        file = desk.page
        text = self.server.blank if file is None else _read(file).decode()
        return served(text, profiles=shipped_profiles(), files=FILES, state=state)

    def _send_file(self, name: str) -> None:
        try:
            file = self.server.desk.file(name)
        except InputError as error:
            raise _RefusedError(HTTPStatus.CONFLICT, str(error)) from error
        if file is None:
            raise _RefusedError(HTTPStatus.NOT_FOUND, "there is no plan yet")
        attached = f'attachment; filename="{name}"'
        headers = {"Content-Disposition": attached}
        self._send(_read(file), kind="application/octet-stream", headers=headers)

    def _tell_events(self) -> None:
        """Tell all of the last call and what comes, until the browser or the desk is closed."""
        self._head(HTTPStatus.OK, STREAM)
        desk = self.server.desk
        number = desk.begun()
        while not desk.is_closed:
            events = desk.heard(number, ALIVE_S)
            number += len(events)
            lines = (f"data: {json.dumps(event)}\n\n" for event in events)
            self.wfile.write("".join(lines).encode() or b":\n\n")
            self.wfile.flush()

    def _send(
        self,
        content: str | bytes,
        *,
        status: HTTPStatus = HTTPStatus.OK,
        kind: str = PLAIN,
        headers: Mapping[str, str] = HEADERS,
    ) -> None:
        sent = content.encode() if isinstance(content, str) else content
        self._head(status, kind, {**headers, "Content-Length": str(len(sent))})
        self.wfile.write(sent)

    def _head(self, status: HTTPStatus, kind: str, headers: Mapping[str, str] = HEADERS) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": kind, **HEADERS, **headers}.items():
            self.send_header(name, value)
        self.end_headers()

    def version_string(self) -> str:
        return "planner"

    def log_message(self, format: str, *arguments: Any) -> None:
        log.debug("%s: %s", self.client_address[0], as_line(format % arguments))


def _read(file: Path) -> bytes:
    """Return a file of a run, which another plan may be about to replace."""
    try:
        return file.read_bytes()
    except OSError as error:
        reason = f"{file.name} cannot be read ({error.strerror}); plan again"
        raise _RefusedError(HTTPStatus.CONFLICT, reason) from error


def _is_address(host: str, port: int) -> bool:
    """Return whether a host is an address of its own, not a name that anybody may have made up."""
    name, _, number = host.rpartition(":")
    if number != str(port):
        return False
    try:
        return name == "localhost" or bool(ipaddress.IPv4Address(name))
    except ValueError:
        return False
