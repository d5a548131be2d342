"""What can go wrong, one class per remedy. The command line turns each into one line.

The exit code is then 2; it is 1 if processes of our own have died.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from planner.messages import plain


class PlannerError(Exception):
    """Any fault that a user can mend; its text, one line, says where it lies and what to do."""

    def __str__(self) -> str:
        return plain(super().__str__().replace("\n", " "))


class InputError(PlannerError, ValueError):
    """A file or an argument is missing, broken or contradicts another one."""


class NothingLeftError(InputError):
    """A mission has come to its end: nobody flies any more, or nothing is left to be found."""


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with a scenario; as text, the key and what to do about it."""

    key: str  # dotted, such as target.start.AB; or another place, such as line 3
    text: str  # what is wrong, and the remedy
    unknown: bool = False  # whether there is no such key, so that no value would do

    def __str__(self) -> str:
        return plain(f"{self.key}: {self.text}")

    def renamed(self, old: str, new: str) -> "Fault":
        """Return the same fault of a section, or a table in it, that has another key."""
        text = self.text.replace(f"{old}.", f"{new}.")
        key = new + self.key.removeprefix(old) if self.key.startswith(old) else self.key
        return Fault(key, text, self.unknown)

    def is_about(self, *beginnings: str) -> bool:
        """Return whether its key begins with one of these; a misspelt longer one counts too."""
        return self.key.startswith(beginnings)

    def field_of(self, section: str) -> str:
        """Return the name of the field of a section that it is about."""
        return self.key.removeprefix(f"{section}.").partition(".")[0].partition("[")[0]


class ScenarioError(InputError):
    """A scenario is wrong in one or more places, which are all reported together.

    Parameters
    ----------
    source
        The scenario's file or name.
    faults
        All of them; the error's text has a line for each.
    """

    def __init__(self, source: str, faults: Sequence[Fault]) -> None:
        self.source = source
        self.faults = tuple(faults)
        super().__init__("\n".join(f"{source}: {fault}" for fault in faults))

    def __str__(self) -> str:
        return "\n".join(f"{plain(self.source)}: {fault}" for fault in self.faults)

    def __reduce__(self) -> tuple[type["ScenarioError"], tuple[str, tuple[Fault, ...]]]:
        return type(self), (self.source, self.faults)


def is_short_of_memory(said: object) -> bool:
    """Return whether the system's loader of libraries says that memory is short."""
    return any(words in str(said) for words in ("allocate memory", "failed to map segment"))


class NotApplicableError(PlannerError, ValueError):
    """A method cannot work on this problem, for a reason that its text names."""


class SumoError(PlannerError, RuntimeError):
    """SUMO, netconvert or one of their libraries failed; the text is their own message."""


class LostError(SumoError):
    """A process that drives a particle died each time; the command line ends with 1."""


class OutputError(PlannerError, RuntimeError):
    """A result cannot be written, or would overwrite another run."""
