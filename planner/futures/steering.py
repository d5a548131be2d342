"""A user's own function that steers the traffic, step by step: signals, speeds, closed streets."""

from collections.abc import Callable
from typing import Any

from planner.errors import InputError
from planner.user_code import UserFunction

Step = Callable[[], None]
ASKED = "def function(traci): ..."


def control_of(text: str) -> UserFunction:
    """Return the function that steers traffic, named as ``module:function`` or by its file.

    Raises
    ------
    InputError
        If there is no such file.
    """
    try:
        return UserFunction.named(text)
    except InputError as error:
        raise InputError(f"--control {text}: {error}") from error


def stepper(libsumo: Any, control: UserFunction | None) -> Step:
    """Return what takes SUMO one step on, first steered as the user has it; forks call it too.

    The function is called with libsumo, which stands for TraCI; it sets what it likes, and leaves
    the step to us. What it keeps in its module is there in the next step; each fork has a copy.

    Raises
    ------
    InputError
        If there is no such function; the step raises it where the function fails.
    """
    step: Step = libsumo.simulationStep
    if control is None:
        return step
    steer, now = _loaded(control, libsumo), libsumo.simulation.getTime

    def steered_step() -> None:
        begun_s = now()
        try:
            steer(libsumo)
        except Exception as error:
            raise InputError(
                f"--control {control.name}: at {begun_s:g} s: {control.said(error)}; correct it "
                "there"
            ) from error
        if now() != begun_s:
            raise InputError(
                f"--control {control.name}: takes SUMO on by itself; leave out its simulationStep"
            )
        step()

    return steered_step


def _loaded(control: UserFunction, libsumo: Any) -> Callable[[Any], object]:
    control.forget()  # what it has kept is of another run of the traffic
    try:
        return control.load(ASKED, libsumo)
    except InputError as error:
        raise InputError(f"--control {error}") from error
