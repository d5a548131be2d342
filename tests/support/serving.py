"""The server of the page, in a thread of its own."""

import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager

from planner.cli.desk import Desk
from planner.cli.serving import Server


@contextmanager
def served(desk: Desk, blank: str, links: list[str]) -> Iterator[Server]:
    """Serve a desk in the block; links are added as they come."""
    with Server(("127.0.0.1", 0), desk, blank, links.append) as server, closing(desk):
        threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
        try:
            yield server
        finally:
            server.shutdown()
