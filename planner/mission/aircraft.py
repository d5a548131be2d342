"""The aircraft that a scenario describes, as the flight law takes it."""

import math

from planner.flight.law import NO_WIND, Aircraft, FlightLaw
from planner.scenario.uav import UavSection

UNKNOWN_WIND_MPS = 5.0  # from the worst side, for the way home alone


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


def _blowing(speed_mps: float, from_deg: float) -> tuple[float, float]:
    """Return where the air moves to, east and north, m/s."""
    angle = math.radians(from_deg)
    return -speed_mps * math.sin(angle), -speed_mps * math.cos(angle)
