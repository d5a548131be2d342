"""Keys of a scenario that a call sets beside its words, each written KEY=VALUE."""

import copy
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from planner.clock import clock
from planner.errors import Fault
from planner.scenario.source import Tables, apply_override
from planner.scenario.traffic import TrafficSection

OPTION = "--set"
IN_TRAFFIC = "traffic"
BY_THE_CLOCK = ("search.particles", "search.work", "search.targets")


class Settled(NamedTuple):
    """A call's scenario as it is set."""

    tables: Tables
    said: tuple[tuple[str, str], ...]  # what was set, by name
    faults: tuple[Fault, ...]


def settled(
    tables: Tables,
    settings: Sequence[str],
    words: Mapping[str, str],
    traffic: Mapping[str, Any] | None = None,
) -> Settled:
    """Return a scenario's sections with keys set.

    Parameters
    ----------
    words
        The option that says a key, of those that a call's words say.
    traffic
        The section of the net's scenario, for a target that is set to drive in it.
    """
    faults: list[Fault] = []
    given: Tables = {} if traffic is None else {"traffic": dict(traffic)}
    found: Tables = copy.deepcopy({**tables, **given})
    for one in settings:
        key = key_of(one)
        refused = [*_refusals(key, words)]
        faults += refused[:1]
        if not refused:
            apply_override(found, one, faults)
            if not isinstance(found.get(key.partition(".")[0], {}), dict):
                faults.append(Fault(key, "is none of a call's sections; leave it out"))
    said = [("set", " ".join(one.split())) for one in settings]
    drives = [found.get(name) for name in ("target", "truth")]
    is_in_it = any(isinstance(one, dict) and one.get("driving") == IN_TRAFFIC for one in drives)
    if not is_in_it and not any(key_of(one).startswith("traffic") for one in settings):
        found.pop("traffic", None)
    elif traffic is not None:
        section, _ = TrafficSection.attempt(found["traffic"])
        if section is not None:
            said.append(("traffic", f"time 0 of the target is its {clock(section.at_s)}"))
    return Settled(found, tuple(said), tuple(faults))


def key_of(setting: str) -> str:
    """Return the key that a setting sets."""
    return setting.partition("=")[0].strip()


def _refusals(key: str, words: Mapping[str, str]) -> Iterator[Fault]:
    """Yield why a call cannot set a key: its words say it, or the clock decides."""
    for name, option in words.items():
        if _overlap(key, name):
            yield Fault(f"{OPTION} {key}", f"is what {option} says; say it there, or set less")
    for name in BY_THE_CLOCK:
        if _overlap(key, name):
            text = "is chosen while the clock runs; set it for the scenario that is left behind"
            yield Fault(f"{OPTION} {key}", text)


def _overlap(key: str, name: str) -> bool:
    return f"{key}.".startswith(f"{name}.") or name.startswith(f"{key}.")
