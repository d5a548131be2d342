"""How long this process has spent on compiling: no part of what a search takes.

`planner.jit` keeps the account, where the compiler is loaded at all.
"""


class Account:
    """Seconds spent so far; compilations that cause others count once."""

    def __init__(self) -> None:
        self.spent_s = 0.0
        self._depth, self._begun_s = 0, 0.0

    def begin(self, now_s: float) -> None:
        """Take note that a compilation begins."""
        if self._depth == 0:
            self._begun_s = now_s
        self._depth += 1

    def end(self, now_s: float) -> None:
        """Take note that one ends."""
        self._depth -= 1
        if self._depth == 0:
            self.spent_s += now_s - self._begun_s


COMPILING = Account()
