"""What can go wrong, one class per remedy. The command line turns each into one line and exit 2."""

from collections.abc import Sequence


class PlannerError(Exception):
    """Any fault that a user can mend; its text says where it lies and what to do."""


class InputError(PlannerError, ValueError):
    """A file or an argument is missing, broken or contradicts another one."""


class ScenarioError(InputError):
    """A scenario is wrong in one or more places, all of which are told together.

    Parameters
    ----------
    source
        The scenario's file or name.
    faults
        One line per fault: its key, what is wrong, the remedy.
    """

    def __init__(self, source: str, faults: Sequence[str]) -> None:
        self.source = source
        self.faults = tuple(faults)
        super().__init__("\n".join(f"{source}: {fault}" for fault in faults))

    def __reduce__(self) -> tuple[type["ScenarioError"], tuple[str, tuple[str, ...]]]:
        return type(self), (self.source, self.faults)


class NotApplicableError(PlannerError, ValueError):
    """A method cannot work on this problem, for a reason that its text names."""


class SumoError(PlannerError, RuntimeError):
    """SUMO, netconvert or one of their libraries failed; the text is their own message."""


class OutputError(PlannerError, RuntimeError):
    """A result cannot be written, or would overwrite another run."""
