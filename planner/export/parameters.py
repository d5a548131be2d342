"""The parameters of an autopilot that the times of a flight rest on, and those of a vehicle.

ArduPilot's from 4.7 on have other names and units than before; a vehicle has either.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path

from planner.errors import InputError
from planner.export.mavlink import Autopilot
from planner.flight.law import FlightLaw
from planner.guard import read_text

LARGEST = 1 << 20  # bytes of a file: all parameters of a vehicle are some 40 kB
LEAN_DEG = ((10.0, 30), (15.0, 45))  # speeds in m/s that recorded flights reached at a lean limit
NEAR = 1e-4  # as a share: files hold single precision


@dataclass(frozen=True)
class Parameter:
    """One of an autopilot's, by all its names."""

    names: tuple[tuple[str, float], ...]  # the name today first, and its unit as a part of ours
    value: float  # that the times rest on, in m, m/s, m/s2 or degrees
    unit: str
    what: str
    at_least: bool = False  # more does no harm

    @property
    def line(self) -> str:
        """It as pilots set it, under its usual name and under others."""
        name, share = self.names[0]
        others = "".join(f" (or {other} {self.value / part:g})" for other, part in self.names[1:])
        least = " or more" if self.at_least else ""
        return f"{name:<16}{self.value / share:>6g} {self.unit}{least}{others}: {self.what}"

    def fault(self, vehicle: Mapping[str, float]) -> str | None:
        """Return how a vehicle's differs, in one line; None: it does not."""
        said = [(name, part) for name, part in self.names if name in vehicle]
        if not said:
            names = " and ".join(name for name, _ in self.names)
            return f"{names}: not in it; {self.what}: set {self._wanted(self.names[0][1])}"
        name, part = said[0]
        found = vehicle[name]
        off = found * part - self.value
        if abs(off) <= NEAR * self.value or (self.at_least and off > 0.0):
            return None
        return f"{name}: is {found:g}, not {self._wanted(part)}; set it: {self.what}"

    def _wanted(self, part: float) -> str:
        unit = f" {self.unit}" if part == self.names[0][1] else ""
        return f"{self.value / part:g}{unit}" + " or more" * self.at_least


def parameters(law: FlightLaw, autopilot: Autopilot) -> list[Parameter]:
    """Return what an autopilot has to be set to; what the aircraft does at once has none.

    Nor has an aircraft that cannot hover: these are those of multicopters.
    """
    if not law.can_hover:
        return []
    found = _px4(law) if autopilot == "px4" else _ardupilot(law)
    return [one for one in found if math.isfinite(one.value)]


def lean_note(law: FlightLaw) -> str:
    """Return what is not known of the lean limit; empty: it is known."""
    if _lean_deg(law) < inf:
        return ""
    return (
        f"At {law.speed_mps:g} m/s it may have to lean by more than {LEAN_DEG[-1][1]} degrees: no "
        "recorded flight was so fast; try it."
    )


def _lean_deg(law: FlightLaw) -> float:
    return next((degrees for mps, degrees in LEAN_DEG if law.speed_mps <= mps), inf)


def _ardupilot(law: FlightLaw) -> Iterator[Parameter]:
    cm, speed, climb, sink = 0.01, "speed between waypoints", "climb", "descent"
    rate, lean = "acceleration", "lean limit"
    home = "height of the way home"
    yield Parameter((("WPNAV_SPEED", cm), ("WP_SPD", 1.0)), law.speed_mps, "cm/s", speed)
    yield Parameter(
        (("WPNAV_ACCEL", cm), ("WP_ACC", 1.0)), law.acceleration_mps2, "cm/s2", rate, True
    )
    yield Parameter((("WPNAV_SPEED_UP", cm), ("WP_SPD_UP", 1.0)), law.climb_mps, "cm/s", climb)
    yield Parameter((("WPNAV_SPEED_DN", cm), ("WP_SPD_DN", 1.0)), law.descend_mps, "cm/s", sink)
    yield Parameter(
        (("ANGLE_MAX", 0.01), ("ATC_ANGLE_MAX", 1.0)), _lean_deg(law), "cdeg", lean, True
    )
    yield Parameter((("RTL_ALT", cm), ("RTL_ALT_M", 1.0)), law.altitude_m, "cm", home)


def _px4(law: FlightLaw) -> Iterator[Parameter]:
    def of(name: str, value: float, unit: str, what: str, at_least: bool = False) -> Parameter:
        return Parameter(((name, 1.0),), value, unit, what, at_least)

    yield of("MPC_XY_CRUISE", law.speed_mps, "m/s", "speed between waypoints")
    yield of("MPC_ACC_HOR", law.acceleration_mps2, "m/s2", "acceleration", True)
    yield of("MPC_Z_V_AUTO_UP", law.climb_mps, "m/s", "climb")
    yield of("MPC_Z_V_AUTO_DN", law.descend_mps, "m/s", "descent")
    yield of("MPC_TILTMAX_AIR", _lean_deg(law), "deg", "lean limit", True)
    yield of("RTL_RETURN_ALT", law.altitude_m, "m", "height of the way home")


def differences(path: Path, wanted: Sequence[Parameter]) -> list[str]:
    """Return how the parameters of a vehicle differ from those wanted, a line for each.

    Parameters
    ----------
    path
        A ``.param``, ``.parm`` or ``.params`` file, as ground stations write it.

    Raises
    ------
    InputError
        If it cannot be read, is no such file, or is that of another autopilot.
    """
    vehicle = read_parameters(path)
    if not wanted:
        raise InputError(
            "--params: only parameters of multicopters are known, and this aircraft cannot hover; "
            "leave it out"
        )
    if not any(name in vehicle for one in wanted for name, _ in one.names):
        names = ", ".join(one.names[0][0] for one in wanted)
        raise InputError(
            f"{path}: has none of {names}; give all parameters of the vehicle, and its --autopilot"
        )
    return [fault for one in wanted if (fault := one.fault(vehicle)) is not None]


def read_parameters(path: Path) -> dict[str, float]:
    """Return the parameters in a file by name.

    Lines are ``NAME,VALUE`` or ``NAME VALUE`` (Mission Planner, MAVProxy), or vehicle, component,
    name, value and type (QGroundControl); what follows a ``#`` is a remark.

    Raises
    ------
    InputError
        If it cannot be read, or a line is none of these.
    """
    found: dict[str, float] = {}
    for number, line in enumerate(read_text(path, LARGEST).splitlines(), 1):
        words = line.split("#", 1)[0].replace(",", " ").split()
        if not words:
            continue
        name, value = _named(words)
        if name is None or not math.isfinite(value):
            raise InputError(
                f"{path}: line {number}: is no parameter and its value; give a file as a ground "
                "station saves it"
            )
        if found.setdefault(name, value) != value:
            raise InputError(f"{path}: line {number}: {name} stands twice; leave one of them")
    return found


def _named(words: list[str]) -> tuple[str | None, float]:
    name, value = words[2:4] if len(words) == 5 else words[:2] if len(words) == 2 else ("", "")
    if not (name.isascii() and name.replace("_", "").isalnum() and name[0].isalpha()):
        return None, 0.0
    try:
        return name.upper(), float(value)
    except ValueError:
        return None, 0.0
