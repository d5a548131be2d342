"""The served page without a browser: who may ask, what may be asked, and that nothing is lost."""

import json
import re
import signal
import socket
import sys
import time
from collections.abc import Iterator, Mapping
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from subprocess import PIPE
from typing import Any

import pytest

from planner.cli import parser_for
from planner.cli.desk import FILES, Desk, words_of
from planner.cli.serve import options_of
from planner.cli.serving import MOST_BYTES, Server
from planner.errors import InputError
from planner.mission.areas import airspace_over
from planner.mission.call_net import net_of
from planner.page.serving import page_of_net
from support import fake_planner
from support.command_line import TOWN, Commands
from support.processes import started
from support.serving import served

WORDS = {"last_seen": "n", "at": "-1min", "drone_at": "nw", "target": "joyride", "heading": ""}
PATIENCE_S = 60.0


class Client:
    """A browser's tab, as far as the server can tell."""

    def __init__(self, server: Server, links: list[str]) -> None:
        self.port, self.links, self.cookie = server.port, links, ""

    def ask(
        self,
        path: str,
        content: Any = None,
        *,
        method: str = "",
        body: bytes | None = None,
        headers: Mapping[str, str | None] = {},
    ) -> tuple[HTTPResponse, str]:
        """Ask, as this page's own script does unless headers say otherwise."""
        sent = json.dumps(content).encode() if body is None and content is not None else body
        told = {"Host": f"127.0.0.1:{self.port}", "Cookie": self.cookie or None}
        if sent is not None:
            told |= {"Origin": f"http://{told['Host']}", "Content-Type": "application/json"}
            told |= {"Content-Length": str(len(sent))}
        connection = HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.putrequest(method or ("GET" if sent is None else "POST"), path, skip_host=True)
        for name, value in {**told, **headers}.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders(sent)
        answer = connection.getresponse()
        text = answer.read().decode()
        connection.close()
        return answer, text

    def status(self, *arguments: Any, **options: Any) -> int:
        return self.ask(*arguments, **options)[0].status

    def enter(self) -> None:
        link = self.links[-1]
        answer, _ = self.ask(link[link.index("/?") :])
        assert (answer.status, answer.getheader("Location")) == (303, "/")
        self.cookie = str(answer.getheader("Set-Cookie")).partition(";")[0]

    def events(self) -> Iterator[dict[str, Any]]:
        """Yield what is told, from the beginning of the last call."""
        with socket.create_connection(("127.0.0.1", self.port), PATIENCE_S) as stream:
            head = f"GET /events HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\nCookie: {self.cookie}"
            stream.sendall(f"{head}\r\n\r\n".encode())
            with stream.makefile("r", encoding="utf-8") as lines:
                for line in lines:
                    if line.startswith("data: "):
                        yield json.loads(line.removeprefix("data: "))

    def told(self, until: str) -> list[dict[str, Any]]:
        """Return what is told up to the first event of a kind."""
        found = []
        for event in self.events():
            found.append(event)
            if event["event"] == until:
                break
        return found


@pytest.fixture(scope="module")
def blank() -> str:
    return page_of_net(net_of(TOWN)[1], "<town>")


@pytest.fixture
def links() -> list[str]:
    return []


@pytest.fixture
def server(blank: str, links: list[str], tmp_path: Path) -> Iterator[Server]:
    (tmp_path / "page").write_text(blank, encoding="utf-8")
    desk = Desk(TOWN, tmp_path, ["--jobs=1"], fake_planner.PROGRAM)
    with served(desk, blank, links) as one:
        yield one


@pytest.fixture
def client(server: Server, links: list[str]) -> Client:
    one = Client(server, links)
    one.enter()
    return one


def test_the_link_opens_once_and_the_cookie_stays(server: Server, links: list[str]) -> None:
    stranger, guest = Client(server, links), Client(server, links)
    assert stranger.status("/") == 403
    assert stranger.status("/?token=" + "x" * 22) == 403
    used = links[-1]
    guest.enter()
    assert links[-1] != used
    assert stranger.status(used[used.index("/?") :]) == 403
    assert guest.status(used[used.index("/?") :]) == 303  # the same browser, once more
    answer, text = guest.ask("/")
    assert answer.status == 200
    assert answer.getheader("Referrer-Policy") == "no-referrer"
    assert "&lt;town&gt;" in text
    again = Client(server, links)
    again.enter()
    assert again.cookie == guest.cookie
    with_wrong = {"Cookie": f"{guest.cookie}x"}
    assert guest.status("/", headers=with_wrong) == 403
    cookie = str(Client(server, links).ask(links[-1][links[-1].index("/?") :])[0].headers)
    assert "HttpOnly; SameSite=Strict" in cookie


def test_other_sites_are_refused(client: Client, caplog: pytest.LogCaptureFixture) -> None:
    port = client.port
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "", None):
        assert client.status("/", headers={"Host": host}) == 403, host
    assert client.status("/", headers={"Host": f"localhost:{port}"}) == 200
    for origin in ("http://evil.example", "null", f"http://localhost:{port}", None):
        assert client.status("/call", WORDS, headers={"Origin": origin}) == 403, origin
    assert client.status("/", headers={"Origin": "http://evil.example"}) == 403
    refused = [record.getMessage() for record in caplog.records]
    assert len(refused) == 11
    assert all("refused" in line and "\n" not in line for line in refused)


def test_bodies_are_small_json(client: Client) -> None:
    big = {"Content-Length": str(MOST_BYTES + 1)}
    assert client.status("/call", body=b"{}", headers=big) == 413
    for length in ("0" * 9 + str(10**9), "9" * 5000):
        assert client.status("/call", body=b"{}", headers={"Content-Length": length}) == 413
    assert client.status("/call", body=b"{}", headers={"Content-Length": None}) == 411
    assert client.status("/call", body=b"{}", headers={"Content-Length": "-2"}) == 411
    assert client.status("/call", body=b"{}", headers={"Content-Type": "text/plain"}) == 415
    for body in (b"{", b"\xff", b"[" * 50_000):
        answer, text = client.ask("/call", body=body)
        assert (answer.status, text) == (400, "the body is not JSON\n")
    assert client.status("/stop", {}) == 409
    assert client.status("/other", {}) == 404
    assert client.status("/", method="DELETE") == 501


@pytest.mark.parametrize(
    "path",
    [
        "/../plan.json",
        "/%2e%2e/plan.json",
        "//etc/passwd",
        "/page",
        "/run.json",
        "/flight/flight.plan",
    ],
)
def test_only_its_own_files_are_reached(client: Client, path: str) -> None:
    client.ask("/call", {**WORDS, "at": "plan"})
    client.told("ended")
    assert client.status("/plan.json") == 200
    assert client.status(path) == 404


def test_words_are_words() -> None:
    assert words_of({**WORDS, "radius_m": " "}) == {k: v for k, v in WORDS.items() if v}
    for content, said in (
        ([], "should be an object"),
        ({"aircraft": "x.toml"}, "is no word of a call"),
        ({**WORDS, "at": 3}, "at should be text"),
        ({**WORDS, "at": "1\n2"}, "at should be text"),
        ({**WORDS, "at": "x" * 201}, "at should be text"),
        ({**WORDS, "at": ""}, "at is missing"),
        ({**WORDS, "target": "/etc/secret.toml"}, "is not a profile"),
    ):
        with pytest.raises(InputError, match=said):
            words_of(content)


def test_a_call_is_planned_and_its_files_are_taken(client: Client, tmp_path: Path) -> None:
    assert [client.status(f"/{name}") for name in FILES] == [404] * 5
    assert client.status("/call", {**WORDS, "at": "plan"}) == 202
    kinds = [event["event"] for event in client.told("ended")]
    assert kinds == ["call", "cloud", "progress", "plan", "done", "ended"]
    argv = json.loads(client.ask("/plan.json")[1])
    (folder,) = tmp_path.glob("call-*")
    assert argv[1:3] == ["now", TOWN]
    assert set(argv[3:]) == {
        *("--last-seen=n", "--at=plan", "--drone-at=nw", "--target=joyride"),
        *("--jobs=1", "-o", str(folder), "--events"),
    }
    answer, text = client.ask("/flight.kml")
    assert text == f"kml of {folder}"
    assert answer.getheader("Content-Disposition") == 'attachment; filename="flight.kml"'
    page = client.ask("/")[1]
    assert json.loads(_block(page, "asked")) == {
        "said": {**{k: v for k, v in WORDS.items() if v}, "at": "plan"},
        "plans": 1,
        "pages": 2,
    }


def test_where_it_may_be_is_shown_before_there_is_a_plan(client: Client) -> None:
    assert client.status("/call", {**WORDS, "at": "guesses"}) == 202
    assert client.told("cloud")[-1]["pages"] == 1
    page = client.ask("/")[1]
    assert ", a guess</h1>" in page
    assert json.loads(_block(page, "asked"))["plans"] == 0
    assert client.status("/page.html") == client.status("/plan.json") == 404
    assert client.status("/stop", {}) == 202
    assert client.told("ended")[-1]["text"] == "stopped"
    assert ", a guess</h1>" not in client.ask("/")[1]


def test_two_tabs_hear_the_same_and_one_call_is_planned(client: Client) -> None:
    assert client.status("/call", {**WORDS, "at": "waits"}) == 202
    first = client.told("plan")  # this tab is closed then
    answer, text = client.ask("/call", WORDS)
    assert (answer.status, text) == (409, "a call is being planned; stop it first\n")
    assert client.told("plan") == first
    assert client.status("/stop", {}) == 202
    assert client.told("ended")[-2]["text"].startswith("the best plan takes off")
    assert client.status("/call", {**WORDS, "at": "plan"}) == 202


def test_a_planner_that_is_killed_leaves_its_plan(client: Client, tmp_path: Path) -> None:
    client.ask("/call", {**WORDS, "at": "dies"})
    ended = client.told("ended")[-1]
    (folder,) = tmp_path.glob("call-*")
    assert ended["text"] == (
        f"the planner was killed (signal 9); plan again; the last plan stands, in {folder}"
    )
    assert client.status("/plan.json") == 200
    client.ask("/call", {**WORDS, "at": "faults"})
    told = client.told("ended")
    assert [event["event"] for event in told] == ["call", "ended"]
    assert told[-1]["text"] == r"a.net.xml: --last-seen: there is no street\x1b[2J of that name"
    assert json.loads(client.ask("/plan.json")[1])[3:5] == ["--last-seen=n", "--at=dies"]


def test_the_command_serves_until_ctrl_c(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "planner", "serve", TOWN, "-o", str(tmp_path / "runs")]
    with started(command, stdout=PIPE, stderr=PIPE) as process:
        assert process.stdout is not None
        link = process.stdout.readline().split()[-1]
        host, _, path = link.removeprefix("http://").partition("/")
        connection = HTTPConnection(host, timeout=PATIENCE_S)
        connection.request("GET", f"/{path}")
        assert connection.getresponse().status == 303
        connection.close()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, err) == (130, "planner: stopped; nothing is half-written\n")
    assert len(re.findall("open http", out)) == 1  # the next link
    assert list(tmp_path.iterdir()) == []


SERVES_A_CALL = """
import sys, time
from planner.cli import desk, main, serving
desk.Desk.__init__.__defaults__ = ((), sys.argv[3:])
serving.Server.serve_forever = lambda self: (self.desk.begin({"at": "tidies"}), time.sleep(60))
main(["serve", sys.argv[1], "-o", sys.argv[2]])
"""


def test_ctrl_c_leaves_time_to_the_planner_to_undo_what_is_half_done(tmp_path: Path) -> None:
    (tmp_path / "page").touch()
    arguments = [TOWN, str(tmp_path), *fake_planner.PROGRAM]
    command = [sys.executable, "-c", SERVES_A_CALL, *arguments]
    with started(command, stdout=PIPE, stderr=PIPE) as process:
        patient_until = time.monotonic() + PATIENCE_S
        while not [*tmp_path.rglob("half-done")] and time.monotonic() < patient_until:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert err.endswith("planner: stopped; nothing is half-written\n")
    assert [*tmp_path.rglob("plan.json")] != []
    assert [*tmp_path.rglob("half-done")] == []


def test_where_it_listens(capsys: pytest.CaptureFixture[str], server: Server) -> None:
    run = Commands(capsys)
    taken = run("serve", TOWN, "--port", server.port)
    assert taken.code == 2
    assert f"127.0.0.1:{server.port}: cannot listen there" in taken.err
    assert run("serve", TOWN, "--port", 70_000).code == 2
    assert "not all of them" in run("serve", TOWN, "--bind", "0.0.0.0").err
    assert "an address such as 127.0.0.1" in run("serve", TOWN, "--bind", "evil.example").err
    assert run("serve", "nowhere.net.xml").code == 2


def test_calls_are_planned_as_the_server_is_told() -> None:
    words = ["--jobs", "1", "--set", "uav.speed_mps=12", "--set", "a=1", "--allow", "x"]
    arguments = parser_for(["serve"]).parse_args(["serve", TOWN, *words])
    said = ["--jobs=1", "--set=uav.speed_mps=12", "--set=a=1", "--allow=x"]
    assert options_of(arguments) == said
    call = ["now", TOWN, "--last-seen", "x", "--at", "-1min", "--drone-at", "y", *said]
    assert parser_for(["now"]).parse_args(call).set == arguments.set


def test_the_net_alone_shows_where_the_drone_may_be() -> None:
    tables, network = net_of(TOWN)
    assert airspace_over(TOWN, tables, network) is None
    square = [[0.0, 0.0], [50.0, 0.0], [50.0, 50.0], [0.0, 50.0]]
    said = {**tables, "airspace": {"no_fly": square}}
    page = page_of_net(network, "", airspace_over(TOWN, said, network))
    (ring,) = json.loads(_block(page, "data"))["areas"]["no_fly"]
    assert sorted(ring[:-1]) == sorted(square)
    for wrong in ({"no_fly": "nowhere.geojson"}, {"no_fly": 3}):
        with pytest.raises(InputError, match="airspace"):
            airspace_over(TOWN, {**tables, "airspace": wrong}, network)


def _block(page: str, name: str) -> str:
    found = re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', page)
    assert found is not None
    return found[1]
