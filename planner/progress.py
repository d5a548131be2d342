"""How long work reports how far it has come."""

from typing import Protocol


class Progress(Protocol):
    """A callback that long work calls as it gets on; it may be called any number of times."""

    def __call__(self, done: int, total: int, note: str = "", /) -> None:
        """Report progress.

        Parameters
        ----------
        done
            Units of work done so far.
        total
            Units of work in all, as far as is known now; it may change from call to call.
        note
            What else is worth knowing, such as the best value so far.
        """


def silent(done: int, total: int, note: str = "", /) -> None:
    """Report to nobody."""
