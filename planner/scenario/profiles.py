"""Profiles and mixtures of targets, written out: what `[target]` says with all it refers to."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from planner.errors import Fault, InputError
from planner.guard import read_toml
from planner.messages import as_written, suggestion

SHIPPED = Path(__file__).with_name("profiles")
# Said of the target as a whole, and the same in all components of a mixture.
OF_ALL = (
    "name",
    "driving",
    "signals",
    "probability_present",
    "hidden",
    "caution",
    "last_seen_ago_s",
    "last_seen_window_s",
)

Table = dict[str, Any]


def shipped_profiles() -> tuple[str, ...]:
    """Return the names of the profiles that come with the package, sorted."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.toml")))


def written_out(key: str, table: Mapping[str, Any], folder: Path, faults: list[Fault]) -> Table:
    """Return a target's table without a profile, each component of its mixture with all its keys.

    A component has the keys of the whole, then those of its profile, then its own. One that is
    itself a mixture is its parts, which share its weight; the first one stands in its place.

    Parameters
    ----------
    key
        Under which faults are reported; they are added to ``faults``.
    folder
        Where the paths of profiles start.
    """
    whole = _with_profile(key, table, folder, faults)
    components = whole.pop("mix", None)
    if components is None:
        return whole
    if not isinstance(components, list) or not all(isinstance(one, dict) for one in components):
        faults.append(Fault(f"{key}.mix", "should be tables; write [[target.mix]] for each"))
        return whole
    mix, more = [], []
    for i, own in enumerate(components):
        here = f"{key}.mix[{i}]"
        said, *others = _parts(written_out(here, own, folder, faults))
        faults += _of_all_faults(here, said, whole)
        mix.append({**whole, **said})
        more += [{**whole, **other} for other in others]
    mix += more
    if "start" not in whole and mix and "start" in mix[0]:
        whole["start"] = mix[0]["start"]
    return {**whole, "mix": mix}


def _parts(component: Table) -> list[Table]:
    """Return a component, or the parts of which it is a mixture, by their shares of its weight."""
    mix = component.get("mix")
    if not mix or not isinstance(mix, list):
        return [component]
    weight, weights = component.get("weight"), [part.get("weight") for part in mix]
    for one in (weight, *weights):
        if not _is_weight(one):  # it is told of where the section is checked
            return [
                {name: value for name, value in mix[0].items() if name != "weight"}
                | ({} if one is None else {"weight": one})
            ]
    return [part | {"weight": weight * part["weight"] / math.fsum(weights)} for part in mix]


def _is_weight(value: Any) -> bool:
    return type(value) in (int, float) and 0 < value < math.inf


def _with_profile(key: str, table: Mapping[str, Any], folder: Path, faults: list[Fault]) -> Table:
    own = dict(table)
    name = own.pop("profile", None)
    if name is None:
        return own
    try:
        profile = _profile(name, folder)
    except InputError as error:
        faults.append(Fault(f"{key}.profile", str(error)))
        return own
    if "goes" in own or "turning" in own:
        profile.pop("mix", None)  # which is of where profiles go
    return {**profile, **own}


def _profile(name: Any, folder: Path) -> Table:
    if not isinstance(name, str) or "\0" in name:
        known = ", ".join(shipped_profiles())
        raise InputError(f"should be a name in quotes, not {as_written(name)}; known: {known}")
    if name.endswith(".toml"):
        path = folder / name
        if not path.is_file():
            raise InputError(f"there is no file {path}; correct the path")
        return read_toml(path)
    if name not in shipped_profiles():
        raise InputError(f"{name} is not a profile; {suggestion(name, shipped_profiles())}")
    return read_toml(SHIPPED / f"{name}.toml")


def _of_all_faults(key: str, said: Mapping[str, Any], whole: Mapping[str, Any]) -> Iterator[Fault]:
    missing = object()
    for name in OF_ALL:
        if name in said and said[name] != whole.get(name, missing):
            yield Fault(
                f"{key}.{name}", "is the same in all components; write it in [target] alone"
            )


def inherited(table: Mapping[str, Any], fault: Fault, key: str) -> bool:
    """Return whether a fault of a component is one of the whole's, which is reported there.

    Parameters
    ----------
    table
        Of the target, written out.
    key
        The target's.
    """
    mix = table.get("mix")
    if not fault.key.startswith(f"{key}.mix[") or not isinstance(mix, list):
        return False
    number, _, rest = fault.key.removeprefix(f"{key}.mix[").partition("].")
    field = rest.partition(".")[0].partition("[")[0]
    if not number.isdecimal() or int(number) >= len(mix) or field not in table:
        return False
    return bool(mix[int(number)].get(field) == table[field])
