"""Which Dask cluster may be reached, and how it is told that none is."""

import importlib.util
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from planner.errors import InputError
from planner.futures.cluster import Cluster
from planner.futures.on_cluster import OnCluster
from support.command_line import Commands

SAFE = (
    "tcp://127.0.0.1:8786",
    "127.0.0.1:8786",
    "127.9.8.7:8786",
    "localhost:8786",
    "tcp://localhost:8786",
    "tcp://[::1]:8786",
    "tls://example.org:8786",
)
UNSAFE = (
    "tcp://example.org:8786",
    "example.org:8786",
    "10.0.0.7:8786",
    "tcp://[2001:db8::1]:8786",
    "tcp://0.0.0.0:8786",
    "tcp://127.0.0.1.example.org:8786",
    "tcp://localhost.example.org:8786",
    "tcp://127.0.0.1:1@example.org:8786",
    "ws://127.0.0.1:8786",
    "ucx://example.org:8786",
    "nonsense",
)


@pytest.mark.parametrize("address", SAFE)
def test_this_machine_and_tls_are_taken(address: str) -> None:
    assert Cluster(address).address == address


@pytest.mark.parametrize("address", UNSAFE)
def test_another_machine_without_tls_is_refused(address: str) -> None:
    with pytest.raises(InputError, match=r"without TLS: whoever reaches .* run code .*--insecure"):
        Cluster(address)
    assert Cluster(address, insecure=True).address == address


def test_one_that_is_started_here_needs_no_address() -> None:
    assert Cluster().address is None


def test_without_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(
        InputError, match=r"--backend dask: is not installed; pip install .*cluster"
    ):
        Cluster()


@contextmanager
def silent_port() -> Iterator[int]:
    """A port that nobody listens at."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield taken.getsockname()[1]


def test_no_scheduler() -> None:
    pytest.importorskip("distributed")
    with silent_port() as port:
        nowhere = OnCluster(Cluster(f"tcp://127.0.0.1:{port}"))
        with pytest.raises(InputError, match=rf"--address tcp://127.0.0.1:{port}: no Dask sched"):
            nowhere.size(None)


def test_tls_without_certificates() -> None:
    pytest.importorskip("distributed")
    with socket.create_server(("127.0.0.1", 0)) as someone:
        address = f"tls://127.0.0.1:{someone.getsockname()[1]}"
        with pytest.raises(
            InputError, match=rf"--address {address}: needs certificates; .*CA_FILE"
        ):
            OnCluster(Cluster(address)).size(None)


# On the command line

FAR = ("--backend", "dask", "--address", "tcp://example.org:8786")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("futures", "figure1", *FAR), "--address tcp://example.org:8786: is on another machine"),
        (("plan", "figure1", *FAR), "--address tcp://example.org:8786: is on another machine"),
        (("experiment", "section3", *FAR), "--address tcp://example.org:8786: is on another"),
        (("futures", "figure1", "--address", "localhost:1"), "goes with --backend dask"),
        (("plan", "figure1", "--insecure"), "goes with --backend dask"),
        (("plan", "figure1", "--backend", "dask", "--insecure"), "goes with --address"),
    ],
)
def test_options_that_are_refused(
    words: tuple[str, ...], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    refused = Commands(capsys)(*words, "-o", tmp_path / "out")
    assert refused.code == 2
    assert told in refused.err
    assert refused.err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_the_command_tells_of_a_missing_scheduler_in_a_line(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    with silent_port() as port:
        there = ("--backend", "dask", "--address", f"127.0.0.1:{port}")
        command = [sys.executable, "-m", "planner", "futures", "figure1", "-s", "99", *there]
        environment = {"PLANNER_CACHE": str(tmp_path), "PATH": ""}
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"--address 127.0.0.1:{port}: no Dask scheduler answers there" in done.stderr
