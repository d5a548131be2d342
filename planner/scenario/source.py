"""Where a scenario lies and what its tables say, after the preset and the overrides."""

import copy
import datetime
import os
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from planner.errors import Fault, InputError
from planner.files import RECORD, shipped, shipped_names
from planner.guard import LARGEST_JSON, parsed_json, parsed_toml, read_text
from planner.messages import as_written, suggestion
from planner.scenario.toml_twice import twice
from planner.xml_guard import kind_of_xml

FILE = "scenario.toml"
FROM_RUN = "_from_run"  # ends the key of a path that starts at the folder of a run
BARE_WORD = re.compile(r"[\w./:+-]+( [\w./:+-]+)*")
CLOCK = re.compile(r"\d+:\d+:\d+(\.\d*)?")
LEADING_POINT = re.compile(r"\A[+-]?(?=\.\d)")  # .5 is 0.5 to everybody but TOML
NAMES = ("node",)  # keys of --set whose value is a name, whatever it looks like
LISTED = ("uav", "target", "truth")  # sections that may be lists of tables, addressed by number
# What is sometimes given for a scenario, by its root element, and how it is given rightly.
OTHER_KINDS = {
    "net": "a SUMO net, not a scenario; write a scenario with network = {{ net = {name} }} "
    '(see "Your own net" in README), or: planner plan SCENARIO -n {place}',
    "osm": "an OpenStreetMap extract, not a scenario; write a scenario with "
    'network = {{ osm = {name} }} (see "Your own net" in README)',
    "": "a file of SUMO's, not a scenario; write a scenario that names the net "
    '(see "Your own net" in README), or: planner plan SCENARIO -n TOWN.net.xml',
}

Tables = dict[str, Any]


@dataclass(frozen=True)
class Source:
    """The tables of a scenario file and what was wrong on the way to them."""

    path: Path  # of the file
    tables: Tables
    faults: tuple[Fault, ...]
    parsed: bool = True  # False: the file is not TOML, so nothing else is known
    of_run: bool = False  # whether it is what a run kept, with its aircraft written out

    @property
    def folder(self) -> Path:
        """Where the scenario's relative paths start."""
        return self.path.parent


def scenario_path(place: str | Path) -> Path:
    """Return the file of a scenario: a ``.toml``, a folder that holds one, or a shipped name.

    The ``run.json`` of an earlier run is one too.

    Raises
    ------
    InputError
        If there is nothing of the kind.
    """
    path = Path(place)
    if "\0" in str(path):
        raise InputError(f"{place}: no file's name holds a NUL; correct the path")
    folder = shipped(str(place))
    if path.is_dir():
        if not (path / FILE).is_file():
            if folder is None:
                raise InputError(f"{place}: holds no {FILE}; {_of_folder(path)}")
            path = folder  # a run, say, bears the name of a scenario that is shipped
        path = path / FILE
    if path.is_file():
        kind = kind_of_xml(path)
        if kind is not None:
            other = OTHER_KINDS.get(kind, OTHER_KINDS[""])
            typed = shlex.quote(str(place))
            is_what = other.format(name=as_written(path.name), place=typed)
            raise InputError(f"{place}: is {is_what}")
        return path
    if path.suffix in (".toml", ".json"):
        raise InputError(f"{place}: there is no such file; correct the path")
    if folder is None:
        hint = suggestion(str(place), shipped_names())
        raise InputError(
            f"{place}: is neither a file, nor a folder, nor a shipped scenario; {hint}"
        )
    return folder / FILE


def _of_folder(folder: Path) -> str:
    """Return the remedy for a folder that is no scenario's."""
    if (folder / RECORD).is_file():
        return f"the scenario of the run that it holds is {folder / RECORD}"
    return "name the folder of a scenario"


def read_source(
    place: str | Path, *, preset: str | None = None, overrides: Sequence[str] = ()
) -> Source:
    """Return a scenario's tables with a preset and then the overrides applied.

    Parameters
    ----------
    overrides
        Such as ``uav.start.distance_m=120000``: a dotted key and a TOML value, where a plain word
        or a time needs no quotes.

    Raises
    ------
    InputError
        If there is no such scenario.
    """
    path = scenario_path(place)
    of_run = path.suffix == ".json"
    if of_run:
        path, tables = _of_run(path)
        fault = None
    else:
        tables, fault = _parsed(path)
    if fault:
        return Source(path, {}, (fault,), parsed=False)
    presets = tables.pop("presets", {})
    faults: list[Fault] = []
    if not isinstance(presets, dict):
        text = f"should be tables, not {as_written(presets)}; write [presets.NAME]"
        faults.append(Fault("presets", text))
        presets = {}
    if preset is not None:
        _apply_preset(tables, preset, presets, faults)
    for override in sorted(overrides, key=_is_of_truth):
        apply_override(tables, override, faults)
        if of_run and override.replace(" ", "").startswith("uav.aircraft="):
            text = "of a run is written out; name the scenario in place of the run to change it"
            faults.append(Fault("uav.aircraft", text))
    return Source(path, tables, tuple(faults), of_run=of_run)


def _parsed(path: Path) -> tuple[Tables, Fault | None]:
    text = ""
    try:
        text = read_text(path)
        return copy.deepcopy(_toml(text)), None
    except InputError as error:
        if isinstance(error.__cause__, UnicodeDecodeError):
            what = "is not UTF-8 text; save the file as UTF-8"
            return {}, Fault(f"byte {error.__cause__.start}", what)
        raise
    except ValueError as error:
        what, _, where = str(error).rpartition(" (at ")
        said = twice(text, what, where) or f"{what or error}; correct the TOML there"
        return {}, Fault(where.rstrip(")") or "TOML", said)


@lru_cache(8)
def _toml(text: str) -> Tables:
    """Return the tables of a text, parsed once while a batch opens the same scenario often."""
    return parsed_toml(text)


def _of_run(path: Path) -> tuple[Path, Tables]:
    """Return where the scenario of an earlier run lies, and its tables as that run had them."""
    try:
        record = parsed_json(read_text(path, LARGEST_JSON))
        return there_now(path, record, "scenario_path"), dict(record["scenario"])
    except InputError:
        raise
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: does not hold a run's scenario ({error}); give the run.json of a plan"
        ) from error


def there_now(run: Path, record: Mapping[str, Any], key: str) -> Path:
    """Return where a file that a run was made from lies now: as seen from the run, else as it lay.

    Parameters
    ----------
    run
        Its ``run.json``.
    key
        Of the absolute path in it.

    Raises
    ------
    KeyError, TypeError
        If the record holds no such path.
    """
    absolute = Path(record[key])
    seen = record.get(key + FROM_RUN)
    if isinstance(seen, str) and seen.isprintable() and (run.parent / seen).is_file():
        return (run.parent / seen).resolve()
    return absolute


def paths_in_record(key: str, file: Path, run: Path) -> Tables:
    """Return what a run's record says of where a file lies: absolute, and as seen from the run."""
    absolute = file.resolve()
    try:
        seen = Path(os.path.relpath(absolute, run.resolve())).as_posix()
    except ValueError:  # another drive
        return {key: str(absolute)}
    return {key: str(absolute), key + FROM_RUN: seen}


def _apply_preset(tables: Tables, preset: str, presets: Tables, faults: list[Fault]) -> None:
    chosen = presets.get(preset)
    if preset not in presets:
        text = f"is not in this scenario; {suggestion(preset, presets)}"
        faults.append(Fault(f"presets.{preset}", text))
    elif not isinstance(chosen, Mapping):
        faults.append(Fault(f"presets.{preset}", 'should be a table of "dotted.key" = value'))
    else:
        for key, value in sorted(chosen.items(), key=lambda item: _is_of_truth(item[0])):
            if isinstance(value, Mapping) and "." not in key:
                text = (
                    "should be a dotted key; write the whole key in quotes, as "
                    f'"{key}.{next(iter(value), "key")}" = ...'
                )
                faults.append(Fault(f"presets.{preset}.{key}", text))
            else:
                _set(tables, key, copy.deepcopy(value), faults)


def _is_of_truth(override: str) -> bool:
    """Return whether a key is of the truth, which is set last: there is one for each target."""
    key = override.partition("=")[0]
    return key.partition(".")[0].strip(" \t\"'") == "truth"


def apply_override(tables: Tables, override: str, faults: list[Fault]) -> None:
    """Set a key of some tables, written ``dotted.key=value``; adds what is wrong with it."""
    key, equals, text = (part.strip() for part in override.partition("="))
    if not (key and equals and text):
        faults.append(Fault(override, "is not an override; write dotted.key=value"))
        return
    try:
        value = _value(key, text)
    except ValueError as error:
        reason = str(error).partition(" (at ")[0]
        what = f"{as_written(text)} is not a TOML value ({reason}); quote it if it is text"
        faults.append(Fault(key, what))
        return
    _set(tables, key, value, faults)


def _value(key: str, text: str) -> Any:
    if key.rpartition(".")[2] in NAMES and not text.startswith(('"', "'")):
        return text  # the name of a node may look like a number, or like anything else
    if CLOCK.fullmatch(text):
        return text
    try:
        value = parsed_toml("value = " + LEADING_POINT.sub(r"\g<0>0", text))["value"]
    except ValueError:
        if BARE_WORD.fullmatch(text):
            return text
        raise
    return text if isinstance(value, datetime.date) else value


def _set(tables: Tables, key: str, value: Any, faults: list[Fault]) -> None:
    try:
        *parents, last = _parts(key)
    except ValueError:
        text = "is not a dotted key; write it as in uav.start.distance_m"
        faults.append(Fault(key, text, unknown=True))
        return
    if parents and parents[0] in LISTED and [*parents[1:], last][0].isdigit():
        tables[parents[0]] = _each(tables, parents[0])
    places: list[Any] = [tables]
    for depth, name in enumerate(parents):
        places = [inner for place in places for inner in _led_to(place, name)]
        wrong = [inner for inner in places if not _holds_tables(inner)]
        if wrong or not places:
            within = ".".join(parents[: depth + 1])
            is_what = f"is {as_written(wrong[0])}, not a table" if wrong else "is not in the list"
            faults.append(Fault(key, f"{within} {is_what}; set {within} as a whole"))
            return
    if last.isdigit() and any(isinstance(place, list) for place in places):
        faults.append(Fault(key, f"is a table of a list; set its keys, as in {key}.KEY"))
        return
    for place in places:
        for table in place if isinstance(place, list) else [place]:
            table[last] = copy.deepcopy(value)


def _each(tables: Tables, section: str) -> Any:
    """Return a section as a list of tables; what is no table stays, for others to refuse.

    A table is a list of one. Of the truth, one holds for all targets: so there is one for each.
    """
    said, targets = tables.get(section, {}), tables.get("target")
    listed = [said] if isinstance(said, dict) else said
    holds_for_all = section == "truth" and isinstance(listed, list) and len(listed) == 1
    if holds_for_all and isinstance(targets, list) and targets:
        return [copy.deepcopy(listed[0]) for _ in targets]
    return listed


def _holds_tables(place: Any) -> bool:
    """Return whether something is a table, or a list of tables."""
    if isinstance(place, list):
        return all(isinstance(one, dict) for one in place)
    return isinstance(place, dict)


def _led_to(place: Any, name: str) -> list[Any]:
    """Return what a part of a dotted key leads to.

    From a table to what it has by that name; from a list to the entry of that number, else to
    what each of its tables has by that name.
    """
    if isinstance(place, dict):
        return [place.setdefault(name, {})]
    if name.isdigit():
        return list(place[int(name) : int(name) + 1])
    return [inner for table in place for inner in _led_to(table, name)]


def _parts(key: str) -> list[str]:
    """Return the names in a dotted key, in which names may be quoted as TOML allows."""
    names: list[str] = []
    table: Any = parsed_toml(f"{key} = 0")
    while isinstance(table, dict):
        ((name, table),) = table.items()
        names.append(name)
    return names
