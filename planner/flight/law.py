"""How long an aircraft takes along a line of waypoints: the flight law.

It climbs to its height above the first waypoint, accelerates and brakes evenly, takes corners as
fast as lets it pass within a distance of them, stands still where it hovers, and drifts with the
wind: its airspeed is given, its speed over ground follows. The corner speed is that of junction
deviation in machine tools: on the arc that touches both legs and passes ``corner_m`` from the
corner, at no more than the aircraft's acceleration.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Floats, Frozen, freeze
from planner.checked import number, set_fields
from planner.errors import InputError

STRAIGHT = 0.99999  # sine of half the angle between two legs, beyond which there is no corner
NO_WIND = (0.0, 0.0)
HOMEWARD = 1.5  # stops to turn for home: braking there, and accelerating and braking on the way
LONGEST_TURN = 7.0 * math.pi / 3.0  # the angle flown to turn back on the spot, if it cannot hover


@dataclass(frozen=True)
class FlightLaw:
    """What decides how long an aircraft takes; infinite rates are those of the ideal one."""

    speed_mps: float  # through the air
    acceleration_mps2: float = math.inf
    corner_m: float = math.inf  # how far from a corner it may pass
    climb_mps: float = math.inf
    descend_mps: float = math.inf
    altitude_m: float = 0.0  # above where it takes off
    min_speed_mps: float = 0.0  # through the air; above 0 it cannot hover
    wind_mps: tuple[float, float] = NO_WIND  # where the air moves to, east and north

    def __post_init__(self) -> None:
        rates = ("acceleration_mps2", "corner_m", "climb_mps", "descend_mps")
        found = {name: number(name, getattr(self, name), above=0.0, ends=False) for name in rates}
        found["speed_mps"] = number("speed_mps", self.speed_mps, above=0.0)
        for name in ("altitude_m", "min_speed_mps"):
            found[name] = number(name, getattr(self, name), least=0.0)
        if found["min_speed_mps"] > found["speed_mps"]:
            raise InputError("min_speed_mps: is more than speed_mps; give a lower one")
        if found["min_speed_mps"] and math.isinf(self.acceleration_mps2 * self.corner_m):
            raise InputError("min_speed_mps: goes with acceleration_mps2 and corner_m; give them")
        east, north = (number("wind_mps", one) for one in self.wind_mps)
        set_fields(self, {**found, "wind_mps": (east, north)})

    @property
    def can_hover(self) -> bool:
        """Whether it can stand still in the air, and so stop at a corner."""
        return self.min_speed_mps == 0.0

    @property
    def least_ground_mps(self) -> float:
        """The greatest speed over ground that it may have, whatever it does, in some direction."""
        return self.min_speed_mps + math.hypot(*self.wind_mps)

    @property
    def least_radius_m(self) -> float:
        """The radius of the tightest turn that it can fly in all directions."""
        return self.least_ground_mps**2 / self.acceleration_mps2

    @property
    def turn_radius_m(self) -> float:
        """The radius of the tightest turn that it can fly at its speed in all directions."""
        return (self.speed_mps + math.hypot(*self.wind_mps)) ** 2 / self.acceleration_mps2

    @property
    def climb_s(self) -> float:
        """Seconds from lift-off to its height."""
        return self.altitude_m / self.climb_mps

    @property
    def descend_s(self) -> float:
        """Seconds from its height to the ground."""
        return self.altitude_m / self.descend_mps

    def ground_speed_mps(self, east: float, north: float) -> float:
        """Return its speed over ground in a direction, a unit vector; 0 if it cannot hold it."""
        along = self.wind_mps[0] * east + self.wind_mps[1] * north
        across = self.wind_mps[1] * east - self.wind_mps[0] * north
        if abs(across) >= self.speed_mps:
            return 0.0
        return max(0.0, along + math.sqrt(self.speed_mps**2 - across**2))

    def corner_speed_mps(self, cosine: float) -> float:
        """Return how fast it may take a corner.

        Parameters
        ----------
        cosine
            Of the angle by which it turns there: 1 is straight on, -1 straight back.
        """
        half = math.sqrt(max(0.0, (1.0 + cosine) / 2.0))
        if half > STRAIGHT or math.isinf(self.acceleration_mps2 * self.corner_m):
            return math.inf
        return math.sqrt(self.acceleration_mps2 * self.corner_m * half / (1.0 - half))

    def corner_loss_s(self, before: Floats, after: Floats) -> Floats:
        """Return by how much corners delay it against full speed on both legs, (...) seconds.

        That is exact where both legs are long enough to brake and to accelerate on.

        Parameters
        ----------
        before, after
            (..., 2) the directions of two legs, unit vectors; 0, 0: it is at rest there.
        """
        if math.isinf(self.acceleration_mps2):
            return np.zeros(np.shape(before)[:-1])
        half = np.sqrt(np.maximum(0.0, (1.0 + np.sum(before * after, axis=-1)) / 2.0))
        corner = np.divide(half, 1.0 - half, out=np.full_like(half, np.inf), where=half <= STRAIGHT)
        passes = np.sqrt(self.acceleration_mps2 * self.corner_m * corner)
        tops = [self.over_ground_mps(way) for way in (before, after)]
        passes = np.minimum(passes, np.minimum(*tops))
        halves = [
            np.divide((top - passes) ** 2, top, out=np.zeros_like(top), where=top > 0.0)
            for top in tops
        ]
        return np.asarray(np.add(*halves) / (2.0 * self.acceleration_mps2))

    def over_ground_mps(self, ways: Floats) -> Floats:
        """Return the speeds over ground in directions, (..., 2) unit vectors; 0, 0: at rest, 0."""
        east, north = self.wind_mps
        along = east * ways[..., 0] + north * ways[..., 1]
        across = north * ways[..., 0] - east * ways[..., 1]
        speeds = along + np.sqrt(np.maximum(0.0, self.speed_mps**2 - across**2))
        can = ways.any(axis=-1) & (np.abs(across) < self.speed_mps)
        return np.where(can, np.maximum(0.0, speeds), 0.0)


@dataclass(frozen=True)
class Aircraft:
    """A real aircraft: how it flies, and what it has to keep for the way home."""

    law: FlightLaw
    reserve_s: float = 0.0  # of its time in the air, that is left when it lands
    headwind_mps: float = 0.0  # against which it has to come home

    def __post_init__(self) -> None:
        names = ("reserve_s", "headwind_mps")
        set_fields(self, {name: number(name, getattr(self, name), least=0.0) for name in names})

    @property
    def in_air(self) -> "Aircraft":
        """The same once it is at its height."""
        return replace(self, law=replace(self.law, climb_mps=math.inf))


@dataclass(frozen=True, eq=False)
class TimedFlight(Frozen):
    """When an aircraft is at its waypoints; W of them, at its height from the first to the last."""

    arrives_s: Floats  # (W,) seconds after the first waypoint
    leaves_s: Floats  # (W,) after hovering there
    passes_mps: Floats  # (W,) speed over ground there
    cruises_mps: Floats  # (W - 1,) greatest speed over ground between two waypoints

    def __post_init__(self) -> None:
        names = ("arrives_s", "leaves_s", "passes_mps", "cruises_mps")
        freeze(self, **dict.fromkeys(names, np.float64))


def homeward_s(
    away_m: Floats,
    law: FlightLaw,
    headwind_mps: float,
    corners: Floats | float = 0.0,
    *,
    turns: bool = False,
) -> Floats:
    """Return the seconds of flight home from distances, with so many corners on the way.

    Parameters
    ----------
    turns
        Whether it turns for home even above it.
    """
    over_ground = law.speed_mps - headwind_mps
    flies_s = away_m / over_ground if over_ground > 0.0 else np.where(away_m > 0.0, math.inf, 0.0)
    corner_s = law.speed_mps / law.acceleration_mps2
    turns_s = HOMEWARD * corner_s
    if not law.can_hover and over_ground > 0.0:
        turns_s = corner_s = corner_s + LONGEST_TURN * law.turn_radius_m / over_ground
    away_s = np.where((away_m > 0.0) | turns, turns_s, 0.0)
    return np.asarray(flies_s + away_s + corners * corner_s)


def timed(xy_m: Floats, hold_s: Floats, law: FlightLaw) -> TimedFlight:
    """Return when an aircraft is at the waypoints of a line.

    It starts and ends at rest, or at full speed if it cannot hover.

    Parameters
    ----------
    xy_m
        (W, 2) metres; no two neighbours at one place.
    hold_s
        (W,) seconds that it hovers at each; at a stop it comes to rest.
    """
    steps = np.diff(xy_m, axis=0)
    length_m = np.hypot(steps[:, 0], steps[:, 1])
    direction = (steps / length_m[:, None]).tolist()
    top = [law.ground_speed_mps(*unit) for unit in direction]
    passes = _passing_speeds(direction, length_m.tolist(), top, hold_s.tolist(), law)
    clock_s, arrives_s, leaves_s, cruises = 0.0, [0.0], [float(hold_s[0])], []
    for leg, metres in enumerate(length_m.tolist()):
        seconds, cruise = _leg(metres, (passes[leg], passes[leg + 1]), top[leg], law)
        clock_s = leaves_s[-1] + seconds
        arrives_s.append(clock_s)
        leaves_s.append(clock_s + float(hold_s[leg + 1]))
        cruises.append(cruise)
    return TimedFlight(np.array(arrives_s), np.array(leaves_s), np.array(passes), np.array(cruises))


def _passing_speeds(
    direction: list[list[float]],
    length_m: list[float],
    top: list[float],
    hold_s: list[float],
    law: FlightLaw,
) -> list[float]:
    """Return the speed at each waypoint: no corner too fast, none out of reach of its neighbours.

    With endless acceleration an aircraft is as fast as it likes at once, and rest costs nothing.
    """
    last, rate = len(length_m), law.acceleration_mps2
    passes = [0.0] * (last + 1)
    if not law.can_hover and last > 0:
        passes[0], passes[-1] = top[0], top[-1]
    for i in range(1, last):
        if hold_s[i] <= 0.0:
            (ax, ay), (bx, by) = direction[i - 1], direction[i]
            passes[i] = min(top[i - 1], top[i], law.corner_speed_mps(ax * bx + ay * by))
    for i in range(1, last + 1):
        passes[i] = min(passes[i], math.sqrt(passes[i - 1] ** 2 + 2 * rate * length_m[i - 1]))
    for i in range(last - 1, -1, -1):
        passes[i] = min(passes[i], math.sqrt(passes[i + 1] ** 2 + 2 * rate * length_m[i]))
    return passes


def _leg(
    length_m: float, ends_mps: tuple[float, float], top_mps: float, law: FlightLaw
) -> tuple[float, float]:
    """Return how long a leg takes, seconds, and the greatest speed on it: a trapezoid."""
    rate = law.acceleration_mps2
    if math.isinf(rate):
        return (length_m / top_mps if top_mps > 0.0 else math.inf), top_mps
    if top_mps <= 0.0:
        return math.inf, 0.0
    first, second = ends_mps
    peak = min(top_mps, math.sqrt((2 * rate * length_m + first**2 + second**2) / 2))
    changing_m = (2 * peak**2 - first**2 - second**2) / (2 * rate)
    changing_s = (2 * peak - first - second) / rate
    return changing_s + max(0.0, length_m - changing_m) / peak, peak
