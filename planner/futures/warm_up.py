"""A session of traffic up to the target's time 0, step by step, and what the traffic is then."""

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

from planner.errors import InputError
from planner.futures.traffic import Traffic

Step = Callable[[], None]


class Warm(NamedTuple):
    """What the traffic is like at the target's time 0."""

    vehicles: int  # in the net
    halting: int  # of these
    waiting: int  # to enter the net
    waited: int  # to enter it, when half of the warm-up was over


def stepper(libsumo: Any, traffic: Traffic) -> Step:
    """Return what makes SUMO take one step, steered as the user has it; forks may call it on.

    Raises
    ------
    InputError
        If there is no such function; the step raises it where that function fails.
    """
    if traffic.control is None:
        step: Step = libsumo.simulationStep
        return step
    module, _, name = traffic.control.partition(":")
    try:
        control = getattr(importlib.import_module(module), name)
    except Exception as error:
        raise InputError(f"--control {traffic.control}: cannot be had ({error})") from error

    def steered() -> None:
        try:
            control(libsumo)
        except Exception as error:
            raise InputError(f"--control {traffic.control}: failed ({error})") from error
        libsumo.simulationStep()

    return steered


def warm_up(libsumo: Any, traffic: Traffic, step: Step) -> Warm:
    """Take a loaded session on to the target's time 0; return what the traffic is like then."""
    begin_s = libsumo.simulation.getTime()
    halfway_s, waited = (begin_s + traffic.at_s) / 2, 0
    while (now_s := libsumo.simulation.getTime()) < traffic.at_s:
        if now_s <= halfway_s:
            waited = len(libsumo.simulation.getPendingVehicles())
        step()
    names = libsumo.vehicle.getIDList()
    halting = sum(libsumo.vehicle.getSpeed(name) < 0.1 for name in names)
    return Warm(len(names), halting, len(libsumo.simulation.getPendingVehicles()), waited)
