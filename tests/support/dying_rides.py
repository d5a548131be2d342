"""A worker's rides, of which some die on the way."""

import os
import signal
from pathlib import Path

from planner.futures import rides
from planner.futures.rides import Ride, Session, drive_session


def dying(session: Session, *, k: int, times: int, counter: Path) -> list[Ride]:
    """Drive a session in which a vehicle's process is killed a number of times.

    Parameters
    ----------
    counter
        A file that grows by a byte each time.
    """
    ride = rides._ride

    def deadly(libsumo: object, driven: Session, vehicle: int) -> Ride:
        if vehicle == k and counter.stat().st_size < times:
            with counter.open("ab") as file:
                file.write(b"+")
            os.kill(os.getpid(), signal.SIGKILL)
        return ride(libsumo, driven, vehicle)

    rides._ride = deadly
    try:
        return drive_session(session)
    finally:
        rides._ride = ride


def threads_and_modules(session: Session) -> tuple[int, set[str]]:
    """Drive a session; return how many threads its process has, and what it has imported."""
    import sys

    drive_session(session)
    return len([*Path("/proc/self/task").iterdir()]), {name.split(".")[0] for name in sys.modules}


def blocked() -> str:
    """Tell what a process of a pool does with Ctrl-C."""
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    heard = signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    return f"{'ignored' if ignored else 'handled'}, {'heard again' if heard else 'blocked'}"
