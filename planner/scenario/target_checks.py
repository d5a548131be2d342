"""Checks of what a target's keys say together, and of the files that they name."""

import unicodedata
from collections.abc import Iterator, Sequence
from pathlib import Path

from planner.errors import Fault
from planner.messages import as_written
from planner.scenario.sections import SearchSection
from planner.scenario.target import TargetSection
from planner.scenario.values import probability_fault

OF_ALL_TARGETS = ("driving", "last_seen_ago_s", "sighted_at")  # one clock, and one kind of motion


def target_faults(key: str, section: TargetSection, folder: Path) -> Iterator[Fault]:
    """Yield what is wrong within a target's section, or in one of its components."""
    yield from _own_faults(key, section, folder)
    if section.mix is None:
        return
    if len(section.mix) < 2:
        text = "has one component; add another one, or write its keys in [target]"
        yield Fault(f"{key}.mix", text if section.mix else "is empty; leave it out")
    for part_key, part in section.parts(key):
        yield from _own_faults(part_key, part, folder)


def shared_faults(targets: Sequence[tuple[str, TargetSection]]) -> Iterator[Fault]:
    """Yield where several targets, by key, differ in what is the same for all, or have one name."""
    names = [target.called(number) for number, (_, target) in enumerate(targets, 1)]
    for number, (key, target) in enumerate(targets[1:], 1):
        first_key, first = targets[0]
        if target.driving == "traffic":
            text = "is traffic, in which there is one target so far; leave the others out"
            text += ', or write driving = "free" for all'
            yield Fault(f"{key}.driving", text)
        for name in OF_ALL_TARGETS:
            if getattr(target, name) != getattr(first, name):
                text = f"is the same for all targets, but {first_key}.{name} differs"
                yield Fault(f"{key}.{name}", f"{text}; write the same in both")
        if _alike(names[number]) in map(_alike, names[:number]):
            text = f"{as_written(names[number])} is another target's name; give each its own"
            yield Fault(f"{key}.name", text)
    for key, target in targets:
        if target.name is not None and target.name.strip().isdecimal():
            text = f"{as_written(target.name)} could be the number of another target; give a word"
            yield Fault(f"{key}.name", text)


def _alike(name: str) -> str:
    """Return what names have in common that a reader takes for one."""
    return unicodedata.normalize("NFKC", name).casefold()


def count_faults(targets: int, search: SearchSection) -> Iterator[Fault]:
    """Yield the fault of fewer particles, or fresh targets, than there are targets."""
    for key in ("particles", "targets"):
        given = getattr(search, key)
        if given is not None and given < targets:
            text = f"{given} is too few for {targets} targets, which share them; give more"
            yield Fault(f"search.{key}", text)


def _own_faults(key: str, section: TargetSection, folder: Path) -> Iterator[Fault]:
    yield from _start_faults(key, section)
    yield from _turning_faults(key, section, folder)
    if section.goes not in (None, "turns"):
        yield from _going_faults(key, section)
    if section.flees is not None and section.driving == "constant":
        text = 'needs limits to exceed; write driving = "free", or leave it and its profile out'
        yield Fault(f"{key}.flees", text)
    elif section.flees is not None and section.speed_drawn == "per road":
        yield Fault(f"{key}.flees", 'goes with speed_drawn = "once"; leave one of them out')


def _start_faults(key: str, section: TargetSection) -> Iterator[Fault]:
    if isinstance(section.start, dict):
        fault = probability_fault(list(section.start.values()))
        if fault:
            yield Fault(f"{key}.start", fault)
    elif not isinstance(section.start, str) and not isinstance(section.distance_m, str):
        yield Fault(
            f"{key}.distance_m",
            f"goes with whole edges only, but {key}.start says where on them; leave it out",
        )


def _turning_faults(key: str, section: TargetSection, folder: Path) -> Iterator[Fault]:
    if isinstance(section.turning, dict):
        for edge, ways in section.turning.items():
            fault = probability_fault(list(ways.values()))
            if fault:
                yield Fault(f"{key}.turning.{edge}", fault)
    elif not isinstance(section.turning, str):
        path = folder / section.turning.file
        if "\0" in str(path) or not path.is_file():
            yield Fault(f"{key}.turning.file", f"there is no file {path}; correct the path")


def _going_faults(key: str, section: TargetSection) -> Iterator[Fault]:
    """Yield the keys that mean nothing for a target that goes somewhere."""
    if section.turning != "equal":
        text = f"goes with turns by chance, but {key}.goes says where to; leave one of them out"
        yield Fault(f"{key}.turning", text)
    if section.speed_drawn == "per road":
        text = f'"per road" goes with turns by chance, not with {key}.goes; write "once"'
        yield Fault(f"{key}.speed_drawn", text)


def sampling_faults(target: TargetSection, search: SearchSection) -> Iterator[Fault]:
    """Yield what has too many values for all of them to be taken."""
    if search.sampling != "all":
        return
    for key, part in target.parts("target"):
        yield from _endless(key, part)


SOBOL = 'or write search.sampling = "sobol"'


def _endless(key: str, target: TargetSection) -> Iterator[Fault]:
    endless = {
        "start": (not isinstance(target.start, str | dict), "has endlessly many places"),
        "goes": (target.goes not in (None, "turns"), "has endlessly many routes"),
        "last_seen_window_s": (bool(target.last_seen_window_s), "has many seconds"),
        "stops": (target.stops is not None, "has endlessly many times"),
    }
    for name, (is_so, what) in endless.items():
        if is_so:
            text = f'{what}, but search.sampling is "all"; leave it out, {SOBOL}'
            yield Fault(f"{key}.{name}", text)
    for name in ("distance_m", "speed_mps"):
        numbers = getattr(target, name)
        form = numbers if isinstance(numbers, str) else numbers.form
        if form not in ("list", "constant"):
            yield Fault(
                f"{key}.{name}",
                f'{form} has endlessly many values, but search.sampling is "all"; '
                'write { list = [...] } or { constant = x }, or search.sampling = "sobol"',
            )
    if target.speed_drawn == "per road" and target.speed_mps.form != "constant":
        yield Fault(
            f"{key}.speed_drawn",
            '"per road" makes endlessly many combinations, but '
            'search.sampling is "all"; write "once", or search.sampling = "sobol"',
        )
