"""The aircraft that a scenario describes, as the flight law takes it."""

import math
from collections.abc import Iterator

from planner.errors import Fault
from planner.flight.law import NO_WIND, Aircraft, FlightLaw
from planner.scenario.uav import UavSection

UNKNOWN_WIND_MPS = 5.0  # from the worst side, for the way home alone
FASTEST_MPS = 20.0  # that ArduCopter takes as its speed; it says nothing of more


def aircraft_of(uav: UavSection) -> Aircraft | None:
    """Return a scenario's aircraft; None if it is the paper's, of which nothing is said."""
    if not uav.is_real:
        return None
    wind = uav.wind
    law = FlightLaw(
        speed_mps=uav.speed_mps,
        acceleration_mps2=uav.acceleration_mps2 or math.inf,
        corner_m=uav.corner_m or math.inf,
        climb_mps=uav.climb_mps or math.inf,
        descend_mps=uav.descend_mps or math.inf,
        altitude_m=uav.altitude_m,
        min_speed_mps=0.0 if uav.can_hover else uav.min_speed_mps or 0.0,
        wind_mps=NO_WIND if wind is None else _blowing(wind.speed_mps, wind.from_deg),
    )
    return Aircraft(law, uav.kept_s, UNKNOWN_WIND_MPS if wind is None else wind.speed_mps)


def never_flown(uav: UavSection) -> Iterator[Fault]:
    """Yield why no flight of an aircraft can be written for an autopilot, whatever its plan is."""
    if aircraft_of(uav) is None:
        yield Fault(
            "uav",
            "the plan is for an ideal aircraft, which no real one keeps up with; plan with --set "
            "uav.aircraft=multicopter, or have it timed anew: --aircraft multicopter, or a file",
        )
    elif uav.altitude_m <= 0.0:
        yield Fault("uav.altitude_m", "is 0, on the ground; give the height to fly at")


def not_kept(law: FlightLaw, *, climbs: bool) -> Iterator[Fault]:
    """Yield what of an aircraft's flight law an autopilot does not keep to, with the remedy.

    Parameters
    ----------
    climbs
        Whether it begins on the ground.
    """
    at_once = [
        (law.acceleration_mps2, "acceleration_mps2", "is at its speed"),
        (law.climb_mps, "climb_mps", "is at its height"),
    ][: 2 if climbs else 1]
    for rate, key, what in at_once:
        if rate == math.inf:
            text = f"is not given, and no aircraft {what} at once; give it"
            yield Fault(f"uav.{key}", text)
    if law.speed_mps > FASTEST_MPS:
        yield Fault(
            "uav.speed_mps",
            f"{law.speed_mps:g} m/s is more than the {FASTEST_MPS:g} m/s that autopilots keep to, "
            "though they take it without a word; give the speed that is flown",
        )


def _blowing(speed_mps: float, from_deg: float) -> tuple[float, float]:
    """Return where the air moves to, east and north, m/s."""
    angle = math.radians(from_deg)
    return -speed_mps * math.sin(angle), -speed_mps * math.cos(angle)
