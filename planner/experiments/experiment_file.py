"""An experiment file, read and checked before anything is run."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from planner.errors import InputError, PlannerError
from planner.experiments.experiment import METHOD, Experiment
from planner.experiments.results import METRICS
from planner.experiments.run_condition import NO_STUDIES, Studies
from planner.experiments.target_set import POINTS, TargetSet
from planner.files import shipped, shipped_names
from planner.guard import read_toml
from planner.messages import as_written, suggestion
from planner.mission.sample_sizes import FRESH_TARGETS, fresh_targets
from planner.network.read import open_network
from planner.scenario.draft import read_draft, read_scenario
from planner.scenario.source import scenario_path
from planner.scenario.target import TargetSection
from planner.scenario.toml_text import toml_text
from planner.search.methods import method_named

MOST_CONDITIONS = 200_000  # of a file: each is listed, and takes a file of results
LARGEST_NUMBER = 10**12
OF_A_BLOCK = ("factors", "set", "replicates")
KNOWN = (
    "title",
    "scenario",
    "preset",
    "seed",
    "targets",
    "sets",
    "study",
    "metrics",
    "block",
    *OF_A_BLOCK,
)

Table = Mapping[str, Any]


def experiment_path(place: str | Path) -> Path:
    """Return an experiment's file: a path, or the name of one that comes with the package.

    Its name, or SCENARIO/NAME.

    Raises
    ------
    InputError
        If there is nothing of the kind.
    """
    path = Path(place)
    if path.is_file():
        return path
    names = [path.parent.name] if len(path.parts) == 2 else shipped_names()
    for folder in filter(None, map(shipped, names)):
        if path.stem != "scenario" and (folder / f"{path.stem}.toml").is_file():
            return folder / f"{path.stem}.toml"
    raise InputError(
        f"{place}: there is no such experiment file; give its path, or one that is shipped, "
        "as figure8"
    )


def read_experiment(place: str | Path, studies: Studies = NO_STUDIES) -> Experiment:
    """Return the experiment in a file.

    Parameters
    ----------
    studies
        By name, those that it may run in place of methods.

    Raises
    ------
    InputError
        If there is no such file or something in it is wrong; the text names file, key and remedy.
    """
    path = experiment_path(place)
    table = read_toml(path)
    _refuse_unknown(path, "", table, KNOWN)
    blocks = _blocks(path, table)
    whole = _whole(path, table, studies)
    parts = [_block(whole, table, block) for block in blocks]
    experiment = replace(parts[0], more=tuple(parts[1:]))
    for part in parts:
        _refuse_unknown_keys(part)
    return experiment


def _refuse_unknown(path: Path, within: str, table: Table, known: tuple[str, ...]) -> None:
    for key in table:
        if key not in known:
            raise InputError(f"{path}: {within}{key}: is not a known key; {suggestion(key, known)}")


def _whole(path: Path, table: Table, studies: Studies) -> Experiment:
    """Return what all blocks share."""
    scenario = _text(path, table, "scenario")
    study = _text(path, table, "study", default="-").strip("-")
    if study and study not in studies:
        raise InputError(f"{path}: study: {study} is unknown; {suggestion(study, studies)}")
    sets = _sets(path, table.get("sets", {}))
    place = _scenario_place(path, scenario)
    preset = _text(path, table, "preset") if "preset" in table else None
    usual = FRESH_TARGETS if "targets" in table else _usual_targets(place, preset)
    return Experiment(
        path=path,
        title=_text(path, table, "title", default=path.stem),
        scenario=scenario,
        place=place,
        preset=preset,
        factors={},
        seeds=(_number(path, table, "seed", default=1, least=0),),
        targets=_number(path, table, "targets", default=usual, least=0 if sets else 1),
        sets=sets,
        study=study,
        metrics=_metrics(path, table, study),
    )


def _usual_targets(place: Path, preset: str | None) -> int:
    """Return how many fresh targets a plan is evaluated on in a scenario as it stands."""
    with suppress(PlannerError):  # the conditions report what is wrong with it
        scenario = read_scenario(place, preset=preset)
        if scenario.truth.driving != "constant" or scenario.search.targets is not None:
            network = open_network(scenario.network, scenario.folder)
            return fresh_targets(scenario, network)
    return FRESH_TARGETS


def _metrics(path: Path, table: Table, study: str) -> tuple[str, ...]:
    if "metrics" not in table:
        return ()
    names = table["metrics"]
    if study:
        raise InputError(f"{path}: metrics: a study has columns of its own; leave the key out")
    if not isinstance(names, list) or not names:
        remedy = f'write metrics = ["{METRICS[0]}"]'
        raise InputError(
            f"{path}: metrics: should be a list of names, not {as_written(names)}; {remedy}"
        )
    for name in names:
        if name not in METRICS:
            remedy = suggestion(str(name), METRICS)
            raise InputError(
                f"{path}: metrics: {as_written(name)} is no figure of the table; {remedy}"
            )
    return tuple(names)


def _blocks(path: Path, table: Table) -> list[Table]:
    blocks = table.get("block", [{}])
    if not isinstance(blocks, list) or not all(isinstance(block, dict) for block in blocks):
        raise InputError(f"{path}: block: should be tables; write [[block]]")
    for block in blocks:
        _refuse_unknown(path, "block.", block, ("name", *OF_A_BLOCK))
    return blocks or [{}]


def _block(whole: Experiment, table: Table, block: Table) -> Experiment:
    path, first = whole.path, whole.seeds[0]
    factors = {**_table(path, table, "factors"), **_table(path, block, "factors")}
    settings = {**_table(path, table, "set"), **_table(path, block, "set")}
    seeds = _number(path, {**table, **block}, "replicates", default=1)
    levels = _factors(path, factors, needed=not whole.study)
    count = seeds * math.prod(map(len, levels.values()))
    if count > MOST_CONDITIONS:
        raise InputError(
            f"{path}: makes {count:,} conditions; choose fewer levels or replicates, for at most "
            f"{MOST_CONDITIONS:,}"
        )
    return replace(
        whole,
        block=_text(path, block, "name", default="-").strip("-"),
        factors=levels,
        fixed=_overrides(path, "set", settings),
        seeds=tuple(range(first, first + seeds)),
    )


def _overrides(path: Path, within: str, table: Table) -> tuple[str, ...]:
    for key, value in table.items():
        try:
            toml_text(value)
        except ValueError as error:
            raise InputError(f"{path}: {within}.{key}: {error}") from error
    return tuple(f"{key}={toml_text(value)}" for key, value in table.items())


def _sets(path: Path, table: Any) -> tuple[TargetSet, ...]:
    if not isinstance(table, dict):
        raise InputError(f"{path}: sets: should be tables; write [sets.NAME]")
    return tuple(_set(path, name, keys) for name, keys in table.items())


def _set(path: Path, name: str, keys: Any) -> TargetSet:
    within = f"sets.{name}"
    if not isinstance(keys, dict):
        raise InputError(f"{path}: {within}: should be a table, not {as_written(keys)}")
    own = ("route", "points", "parks", "detects", "by_route")
    truth = tuple(TargetSection.model_fields)
    _refuse_unknown(path, f"{within}.", keys, (*own, *truth))
    detects = keys.get("detects", 1.0)
    if not isinstance(detects, float | int) or not 0 < detects <= 1:
        raise InputError(
            f"{path}: {within}.detects: should not be {as_written(detects)}; "
            "give a probability above 0 and at most 1"
        )
    of_truth = {f"truth.{key}": value for key, value in keys.items() if key in truth}
    return TargetSet(
        name=name,
        truth=_overrides(path, within, of_truth),
        route=_text(path, keys, "route", default="-").strip("-"),
        points=_number(path, keys, "points", default=POINTS),
        parks=_flag(path, within, keys, "parks"),
        detects=float(detects),
        by_route=_flag(path, within, keys, "by_route"),
    )


def _flag(path: Path, within: str, table: Table, key: str) -> bool:
    value = table.get(key, False)
    if not isinstance(value, bool):
        raise InputError(
            f"{path}: {within}.{key}: should be true or false, not {as_written(value)}"
        )
    return value


def _text(path: Path, table: Table, key: str, *, default: str | None = None) -> str:
    value = table.get(key, default)
    if value is None:
        raise InputError(f"{path}: {key}: is missing; give its name in quotes")
    if not isinstance(value, str) or not value:
        raise InputError(f"{path}: {key}: should be text in quotes, not {as_written(value)}")
    return value


def _number(path: Path, table: Table, key: str, *, default: int, least: int = 1) -> int:
    value = table.get(key, default)
    if type(value) is not int or not least <= value <= LARGEST_NUMBER:
        remedy = f"give a whole number from {least} on"
        if type(value) is int and value > LARGEST_NUMBER:
            remedy = f"give at most {LARGEST_NUMBER:,}"
        raise InputError(f"{path}: {key}: should not be {as_written(value)}; {remedy}")
    return value


def _table(path: Path, table: Table, key: str) -> Table:
    found = table.get(key, {})
    if not isinstance(found, dict):
        remedy = f'write [{key}] and below it "dotted.key" = ...'
        raise InputError(f"{path}: {key}: should be a table, not {as_written(found)}; {remedy}")
    return found


def _scenario_place(path: Path, scenario: str) -> Path:
    """Return the scenario's file: relative to the experiment's folder, or a shipped one."""
    beside = path.parent / scenario
    try:
        return scenario_path(beside if beside.exists() else scenario)
    except InputError as error:
        raise InputError(f"{path}: scenario: {error}") from error


def _factors(path: Path, table: Table, *, needed: bool) -> dict[str, Sequence[Any]]:
    if not table and needed:
        remedy = 'write [factors] and below it "dotted.key" = [level, level]'
        raise InputError(f"{path}: factors: is missing; {remedy}")
    for key, levels in table.items():
        fault = _fault_of(key, levels, path.parent)
        if fault:
            raise InputError(f"{path}: factors.{key}: {fault}")
    return {key: tuple(levels) for key, levels in table.items()}


def _fault_of(key: str, levels: Any, folder: Path) -> str | None:
    if isinstance(levels, dict):
        whole = f'"{key}.{next(iter(levels), "key")}"'
        return f"should be a list of levels; write the whole key in quotes, as {whole} = [...]"
    if not isinstance(levels, list) or not levels:
        return f"should be a list of levels, not {as_written(levels)}; write {key} = [level, level]"
    for index, level in enumerate(levels):
        if level in levels[:index]:
            return f"names the level {as_written(level)} more than once; name it once"
        try:
            toml_text(level)
            if key == METHOD:
                method_named(level, folder)
        except ValueError as error:
            return f"{level}: {error}"
    if key == "search.seed":
        return "seeds come from replicates (and seed, the first); leave the factor out"
    return None


def _refuse_unknown_keys(experiment: Experiment) -> None:
    """Raise InputError for keys that no condition could be run with.

    A level out of range is reported later, as the reason why its conditions failed: it may be
    sound in combination with others.
    """
    first = experiment.conditions()[0]
    for within, overrides in [
        ("factors", ()),
        *((f"sets.{one.name}", one.truth) for one in experiment.sets),
    ]:
        given = (*first.settings, *overrides)
        draft = read_draft(first.place, preset=first.preset, overrides=given)
        for fault in draft.faults:
            if fault.unknown or overrides:
                raise InputError(f"{experiment.path}: {within}.{fault}")
            if fault.is_about("presets."):
                raise InputError(f"{experiment.path}: preset: {fault}")
