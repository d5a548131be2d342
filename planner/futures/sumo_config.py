"""A SUMO configuration, read and not obeyed: which of its options are taken, and which left out."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from planner.errors import InputError
from planner.xml_guard import xml_elements

LARGEST = 16 << 20  # bytes

FILES = {  # by all their names; the options are taken, and what they name is read as inputs are
    "net-file": ("net-file", "net", "n"),
    "route-files": ("route-files", "routes", "r"),
    "additional-files": ("additional-files", "additional", "a"),
    "weight-files": ("weight-files", "weights", "w"),
}
OTHER_NAMES = {
    "b": "begin",
    "measure": "weight-attribute",
    "x": "weight-attribute",
    "carfollow.model": "default.carfollowmodel",
    "railsignal.moving-block": "railsignal-moving-block",
    "taxi.vclasses": "device.taxi.vclasses",
    "with-taz": "device.rerouting.with-taz",
}
# What decides how vehicles and persons move, and nothing else: options, families of options that
# begin alike, and devices, of vehicles and of persons.
NAMES = (
    *("begin", "step-length", "step-method.ballistic", "extrapolate-departpos"),
    *("lateral-resolution", "no-internal-links", "keep-after-arrival", "slope-centered"),
    *("scale", "scale-suffix", "max-num-vehicles", "max-num-persons", "random-depart-offset"),
    *("ignore-junction-blocker", "ignore-route-errors", "ignore-accidents", "max-depart-delay"),
    *("sloppy-insert", "eager-insert", "emergency-insert", "insertion-checks"),
    *("waiting-time-memory", "startup-wait-threshold", "time-to-impatience"),
    *("parking.maneuver", "use-stop-ended", "use-stop-started", "ride.stop-tolerance"),
    *("weight-attribute", "junction-taz", "routing-algorithm", "replay-rerouting"),
    *("railway.max-train-length", "railsignal-moving-block"),
)
FAMILIES = (
    *("collision", "intermodal-collision", "time-to-teleport", "lanechange", "tls", "railsignal"),
    *("default", "overhead-wire", "pedestrian", "mapmatch", "weights", "persontrip"),
)
DEVICES = (
    *("rerouting", "battery", "stationfinder", "taxi", "glosa", "bluelight", "driverstate"),
    *("toc", "elechybrid", "friction"),
)
TAKEN = re.compile(
    rf"{'|'.join(map(re.escape, NAMES))}|"
    rf"({'|'.join(FAMILIES)}|(person-)?device\.({'|'.join(DEVICES)}))(\.[\w-]+)*"
)
WRITES = re.compile(r".*\b(output|files?|threads|wkt|wkt\.geo|py)")  # among these families

REFUSED = re.compile(r"mesosim=(true|yes|on|t|x|1)|pedestrian\.model=remote", re.IGNORECASE)
WHY = {
    "mesosim": "another traffic, without the places of vehicles on the road",
    "pedestrian.model": "computed by a program on the network",
}


@dataclass(frozen=True)
class SumoConfig:
    """What a configuration says, as far as it is taken."""

    options: tuple[tuple[str, str], ...]
    files: dict[str, tuple[Path, ...]]  # by the options of `FILES`
    left_out: tuple[str, ...]  # names of options


def read_config(path: Path) -> SumoConfig:
    """Return what is taken of a configuration.

    Raises
    ------
    InputError
        If it cannot be read, or wants what cannot be had.
    """
    by_name = {other: name for name, others in FILES.items() for other in others}
    options: dict[str, str] = {}
    files: dict[str, tuple[Path, ...]] = {}
    left_out: dict[str, None] = {}
    for said, value in _options(path):
        name = by_name.get(said) or OTHER_NAMES.get(said, said)
        if REFUSED.fullmatch(f"{name}={value}"):
            raise InputError(f"{path}: {name} = {value} is {WHY[name]}; take it out")
        if name in FILES:
            files[name] = tuple(
                path.parent / one.strip() for one in value.split(",") if one.strip()
            )
        elif TAKEN.fullmatch(name) and not WRITES.fullmatch(name):
            options[name] = _plain(value, name, path)
        else:
            left_out[said] = None
    return SumoConfig(tuple(options.items()), files, tuple(left_out))


def _options(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the options of a configuration with their values, as SUMO finds them."""
    for element in xml_elements(path, LARGEST):
        value = element.get("value", element.get("v", (element.text or "").strip()))
        if value or "value" in element.attrib or "v" in element.attrib:
            yield str(element.tag), value


def _plain(value: str, name: str, path: Path) -> str:
    """Return a value that SUMO takes as it stands."""
    if "$" in value or not value.isprintable():  # it puts the environment's variables there
        raise InputError(f"{path}: {name} is {value!r}; write it without $ and special characters")
    return value
