"""What takes one target only."""

from planner.errors import InputError
from planner.mission.opening import OpenScenario


def refuse_several(opened: OpenScenario, what: str) -> None:
    """Do nothing if a scenario has one target.

    Parameters
    ----------
    what
        What takes no more, as people know it.

    Raises
    ------
    InputError
        If it has several.
    """
    many = len(opened.scenario.targets)
    if many > 1:
        raise InputError(
            f"{what}: takes one target so far, and {opened.scenario.name} has {many}; give each a "
            "scenario of its own, with [target]"
        )
