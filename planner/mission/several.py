"""What takes one target only, or one UAV."""

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


def refuse_fleet(opened: OpenScenario, what: str) -> None:
    """Do nothing if a scenario has one UAV.

    Parameters
    ----------
    what
        What takes no more, as people know it, and why.

    Raises
    ------
    InputError
        If it has several.
    """
    if len(opened.scenario.uavs) > 1:
        raise InputError(
            f"{what}, and the plan is for several; plan for one, with [uav] in place of [[uav]]"
        )
