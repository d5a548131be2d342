"""A user's own function that steers the traffic, step by step: signals, speeds, closed streets."""

import importlib
import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from planner.errors import InputError

Step = Callable[[], None]
FORM = "give it as module:function, of a module in this folder or in Python's path"


def control_file(control: str) -> Path:
    """Return the file of a module that steers traffic, named as ``module:function``.

    Raises
    ------
    InputError
        If there is no such module.
    """
    module, colon, function = control.partition(":")
    names = [*module.split("."), function]
    if not colon or not all(name.isidentifier() for name in names):
        raise InputError(f"--control {control}: names no function; {FORM}")
    _look_here_too()
    try:
        found = importlib.util.find_spec(module)
    except Exception as error:  # what the packages around it raise
        raise InputError(f"--control {control}: {_said(error)}; {FORM}") from error
    if found is None or found.origin is None or not Path(found.origin).is_file():
        raise InputError(f"--control {control}: there is no module {module}; {FORM}")
    return Path(found.origin)


def stepper(libsumo: Any, control: str | None) -> Step:
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
    steer, now = _function(control), libsumo.simulation.getTime

    def steered_step() -> None:
        begun_s = now()
        try:
            steer(libsumo)
        except Exception as error:
            raise InputError(
                f"--control {control}: at {begun_s:g} s: {_said(error)}; correct it there"
            ) from error
        if now() != begun_s:
            raise InputError(
                f"--control {control}: takes SUMO on by itself; leave out its simulationStep"
            )
        step()

    return steered_step


def _function(control: str) -> Callable[[Any], object]:
    control_file(control)
    module, _, name = control.partition(":")
    sys.modules.pop(module, None)  # what it has kept is of another run of the traffic
    try:
        found = getattr(importlib.import_module(module), name, None)
    except Exception as error:
        raise InputError(f"--control {control}: {_said(error)}; correct it there") from error
    if not callable(found):
        raise InputError(f"--control {control}: {module} has no function {name}; {FORM}")
    function: Callable[[Any], object] = found
    return function


def _look_here_too() -> None:
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)


def _said(error: Exception) -> str:
    """Return an exception in one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split()).rstrip('.')}"
