"""Many possible targets that no SUMO has driven, for planners to search on.

The kinematic clock moves ten thousand of them in about a second. It proposes, SUMO decides: what
is chosen, and every figure that is told, comes from recordings.
"""

import logging
from collections.abc import Callable

import numpy as np

from planner.belief.particles import Particles
from planner.belief.recipe import Recipe
from planner.errors import InputError
from planner.futures.calibrate import calibrated
from planner.futures.futures import Futures
from planner.futures.kinematic import Calibration, kinematic_futures
from planner.mission.opening import OpenScenario
from planner.mission.traffic import on_its_clock
from planner.network.road_network import RoadNetwork
from planner.network.signals import Signals, signals_of

log = logging.getLogger(__name__)

PROPOSALS = 10_000
FITTED = 200  # recorded particles that the clock is fitted to


def proposals(
    opened: OpenScenario,
    recipe: Recipe,
    planning: Callable[[], Particles],
    recorded: Futures | None,
) -> Futures | None:
    """Return what a recipe draws, moved by the kinematic clock; None where there is no clock.

    Parameters
    ----------
    planning
        Returns the particles that were recorded.
    recorded
        What SUMO made of them, if it has; where signals are actuated, the clock is fitted to some
        of them.
    """
    network = opened.network
    if network.is_abstract:
        return None
    try:
        signals = signals_of(network)
    except InputError as error:
        log.warning("searched on SUMO's recordings alone, as there is no clock: %s", error)
        return None
    drawn = on_its_clock(recipe.particles(network), opened.traffic)
    fitted = None
    if recorded is not None and signals.actuated.any() and drawn.driving != "constant":
        known = on_its_clock(planning(), opened.traffic)
        fitted = _fitted(network, signals, known, recorded)
    return kinematic_futures(
        network, drawn, signals, horizon_s=recipe.horizon_s, calibration=fitted
    )


def _fitted(
    network: RoadNetwork, signals: Signals, particles: Particles, recorded: Futures
) -> Calibration | None:
    """Return the driver that is fitted to some recordings; None if these are of others."""
    if len(particles) != len(recorded) or len(recorded) == 0:
        return None
    some = np.arange(min(FITTED, len(recorded)))
    return calibrated(network, particles.take(some), recorded.take(some), signals=signals)
