"""A Dask cluster: which one, who may reach it, and the connection to it."""

import importlib
import importlib.util
import ipaddress
import logging
import os
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from planner.errors import InputError
from planner.interrupts import start_tracker

CONNECT_S = 10.0  # to wait for a scheduler to answer
TLS, TCP = "tls://", "tcp://"
CERTIFICATES = "DASK_DISTRIBUTED__COMM__TLS__CA_FILE, ..__CLIENT__CERT and ..__CLIENT__KEY"


@dataclass(frozen=True)
class Cluster:
    """A cluster that runs, or one that is started on this machine.

    Raises
    ------
    InputError
        If Dask is not installed, or the scheduler is on another machine and anybody on the way
        there could pose as it, or as us.
    """

    address: str | None = None  # of a running scheduler; None: one is started here
    insecure: bool = False  # whether a scheduler elsewhere may be reached without TLS

    def __post_init__(self) -> None:
        if importlib.util.find_spec("distributed") is None:
            raise InputError(
                "--backend dask: is not installed; pip install 'sumo-search-planner[cluster]'"
            )
        if self.address is not None and not self.insecure and not _is_safe(self.address):
            raise InputError(
                f"--address {self.address}: is on another machine, without TLS: whoever reaches a "
                "scheduler can run code on its workers and here; use tls://, a tunnel to "
                "127.0.0.1, or --insecure in a network that you trust"
            )

    @property
    def name(self) -> str:
        """The cluster as messages have it."""
        return "--backend dask" if self.address is None else f"--address {self.address}"

    @contextmanager
    def connected(self, workers: int) -> Iterator[Any]:
        """Give a client of the cluster, which is closed when the block ends.

        Parameters
        ----------
        workers
            Processes of the cluster, if it is started here.

        Raises
        ------
        InputError
            If no scheduler answers at the address.
        """
        dask: Any = importlib.import_module("dask.distributed")
        _silence()
        with ExitStack() as stack:
            if self.address is None:
                if os.name == "posix":
                    start_tracker(importlib.import_module("multiprocessing.resource_tracker"))
                cluster = dask.LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",
                )
                place: Any = stack.enter_context(cluster)
            else:
                place = self.address
                _knock(place)
            yield stack.enter_context(_client(dask.Client, place))


def _silence() -> None:
    """Keep Dask's own log from the terminal; each part of Dask has a level of its own."""
    names = ["distributed", *logging.getLogger().manager.loggerDict]
    for name in names:
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _is_safe(address: str) -> bool:
    """Return whether nobody else can be on the way to a scheduler."""
    if address.startswith(TLS):
        return True
    host = _host_and_port(address)[0]
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _host_and_port(address: str) -> tuple[str, str]:
    host, _, port = address.removeprefix(TLS).removeprefix(TCP).rpartition(":")
    return host.removeprefix("[").removesuffix("]"), port


def _knock(address: str) -> None:
    """Refuse an address that nobody listens at; Dask's own client would say more than a line."""
    host, port = _host_and_port(address)
    if "://" in host or not port.isdecimal():
        return
    try:
        socket.create_connection((host, int(port)), CONNECT_S).close()
    except (OSError, OverflowError, UnicodeError) as error:
        raise _no_answer(address) from error


def _client(client: Any, place: Any) -> Any:
    try:
        return client(place, timeout=CONNECT_S, set_as_default=False)
    except Exception as error:
        # Half-made, it would wait when it is collected, and complain.
        for one in [*client._instances]:
            if one.status == "connecting":
                one.status = "closed"
        raise _refusal(place, error) from error


def _refusal(place: Any, error: Exception) -> Exception:
    """Return what to tell of a connection that failed."""
    if isinstance(error, TypeError):  # what Dask has for TLS without certificates
        return InputError(
            f"--address {place}: needs certificates; name their files to Dask, as {CERTIFICATES}"
        )
    return _no_answer(place) if isinstance(error, OSError | ValueError) else error


def _no_answer(address: Any) -> InputError:
    return InputError(
        f"--address {address}: no Dask scheduler answers there; start one, or leave it out"
    )
