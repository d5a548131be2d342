"""The words of a call, as `planner new` and `planner now` take them."""

import argparse
import re
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.arguments import add_permit, add_settings, path
from planner.errors import ScenarioError

if TYPE_CHECKING:
    from datetime import datetime

    from planner.futures.traffic import Permit
    from planner.mission.call import Call
    from planner.mission.opening import OpenScenario

WIDTH = 79  # characters of a line
DETAILS = """\
WHERE is 52.43,13.52 (latitude first; also 52 25.8 N 13 31.2 E), a street, two
streets that cross ("Rudower Chaussee / Wegedornstraße"), a full Plus Code, or a
node or an edge of the net; on a net without a projection x,y in metres.
WHEN is 14:05, -7min, +3min, or 2026-05-01T14:05:00+02:00."""


def add_call(parser: argparse.ArgumentParser) -> None:
    """Add the net and the words of a call."""
    # Such as -7min and -33.9,151.2: no option begins with a digit.
    parser._negative_number_matcher = re.compile(r"-[\d.]")
    parser.add_argument(
        "net",
        metavar="NET",
        help="a .net.xml, a .sumocfg or an OpenStreetMap file; or a scenario, whose net, airspace "
        "and sensor are taken",
    )
    _add_target(parser)
    _add_drone(parser)
    add_settings(parser)
    add_permit(parser)


def _add_target(parser: argparse.ArgumentParser) -> None:
    """Add where and when the target was last seen, and what it is."""
    parser.add_argument(
        "--last-seen", required=True, metavar="WHERE", help="where the target was last seen"
    )
    parser.add_argument("--at", required=True, metavar="WHEN", help="when that was")
    parser.add_argument(
        "--heading", metavar="NE", help="which way it drove: N, NE, ... or degrees (default: any)"
    )
    parser.add_argument(
        "--radius-m",
        type=_metres,
        metavar="R",
        help="within how many metres of there it was (default: 200)",
    )
    parser.add_argument(
        "--target",
        default="driving",
        metavar="PROFILE",
        help="what it is: driving, fleeing, joyride, lorry, lost, parked, or a .toml with keys of "
        "[target] (default: %(default)s)",
    )


def _add_drone(parser: argparse.ArgumentParser) -> None:
    """Add where the drone is, what it is, and from when until when it flies."""
    parser.add_argument(
        "--drone-at",
        required=True,
        action="append",
        metavar="WHERE",
        help="where the drone takes off; repeat it for several places to choose from",
    )
    parser.add_argument(
        "--aircraft",
        type=path,
        metavar="FILE",
        help="a .toml with keys of [uav], or the name of one that comes along (default: "
        "multicopter)",
    )
    parser.add_argument(
        "--ready",
        metavar="WHEN",
        help="when it can take off (default: as soon as there is a plan)",
    )
    parser.add_argument(
        "--until", metavar="WHEN", help="when the search ends (default: with the battery)"
    )
    parser.add_argument(
        "--battery", metavar="25min", help="how long it can be in the air (default: the aircraft's)"
    )


def call_of(arguments: argparse.Namespace, now: "datetime") -> "Call":
    """Return the call as it is understood.

    Raises
    ------
    InputError
        With all words that mean nothing.
    """
    from planner.mission.call import understood
    from planner.mission.call_words import Words

    words = Words(
        net=arguments.net,
        last_seen=arguments.last_seen,
        at=arguments.at,
        drone_at=tuple(arguments.drone_at),
        heading=arguments.heading,
        radius_m=arguments.radius_m,
        target=arguments.target,
        aircraft=arguments.aircraft,
        ready=arguments.ready,
        until=arguments.until,
        battery=arguments.battery,
        settings=tuple(arguments.set),
    )
    return understood(words, now)


def lines_of(call: "Call") -> list[str]:
    """Return what each word was understood as, wrapped beside its name."""
    margin = 2 + max(len(name) for name, _ in call.understood)
    return [
        textwrap.fill(
            f"{name:{margin}}{meant}",
            WIDTH,
            subsequent_indent=margin * " ",
            break_on_hyphens=False,
            break_long_words=False,
        )
        for name, meant in call.understood
    ]


def write_call(call: "Call", file: Path, source: str, permit: "Permit") -> "OpenScenario":
    """Write the scenario of a call, and return it opened.

    Parameters
    ----------
    source
        What faults are reported of.
    permit
        As `permit_of` has it.
    """
    file.write_text(call.text(), encoding="utf-8")
    opened = [_opened(call, site, file, source, permit) for site in range(len(call.sites))]
    return opened[0]


def _opened(call: "Call", site: int, file: Path, source: str, permit: "Permit") -> "OpenScenario":
    """Return the scenario of a call, with the drone at one of its sites."""
    from planner.mission.call import as_said
    from planner.mission.opening import open_scenario
    from planner.scenario.toml_text import toml_text

    overrides = [f"uav.start={toml_text(call.sites[site])}"] if site else []
    try:
        return open_scenario(file, overrides=overrides, permit=permit)
    except ScenarioError as error:
        faults = [as_said(fault, call, site) for fault in error.faults]
        raise ScenarioError(source, faults) from error


def _metres(text: str) -> float:
    try:
        number = float(text.strip().removesuffix("m"))
    except ValueError:
        number = -1.0
    if not 1.0 <= number <= 1e5:
        raise argparse.ArgumentTypeError(f"should be metres from 1 to 100000, not {text!r}")
    return number
