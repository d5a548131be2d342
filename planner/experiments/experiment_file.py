"""An experiment file: factors and their levels, from which the conditions follow."""

import itertools
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.experiments.condition import Condition, toml_text
from planner.files import shipped
from planner.mission.preparation import FRESH_TARGETS
from planner.scenario_draft import read_draft
from planner.scenario_source import scenario_path
from planner.search.methods import METHODS, method_named
from planner.wording import shown, suggestion

KNOWN = ("title", "scenario", "preset", "factors", "replicates", "seed", "targets")
METHOD, SEED = "method", "seed"
QUICK_TARGETS, QUICK_PARTICLES = 1000, 256


@dataclass(frozen=True)
class Experiment:
    """What is varied, on which scenario, and how often."""

    path: Path
    title: str
    scenario: str  # as the file names it
    place: Path  # of the scenario's file
    preset: str | None
    factors: Mapping[str, tuple[Any, ...]]  # dotted keys of the scenario, or method
    seeds: tuple[int, ...]
    targets: int  # fresh ones for each plan
    fixed: tuple[str, ...] = ()  # overrides that hold for all conditions

    def quick(self) -> "Experiment":
        """Return a small one of the same kind: the ends of each factor, one seed, few targets."""
        return replace(
            self,
            factors={key: tuple(_ends(levels)) for key, levels in self.factors.items()},
            seeds=self.seeds[:1],
            targets=QUICK_TARGETS,
            fixed=(f"search.particles={QUICK_PARTICLES}",),
        )

    def only(self, choices: Sequence[str]) -> "Experiment":
        """Return the part in which factors, or the seed, have the levels chosen as key=value.

        Raises
        ------
        InputError
            If there is no such factor or level.
        """
        factors: dict[str, tuple[Any, ...]] = {**self.factors, SEED: self.seeds}
        kept: dict[str, list[Any]] = {}
        for choice in choices:
            key, _, text = (part.strip() for part in choice.partition("="))
            if key not in factors:
                raise InputError(f"--only {choice}: no factor {key!r}; {suggestion(key, factors)}")
            found = [level for level in factors[key] if _is(level, text)]
            if not found:
                levels = ", ".join(map(shown, factors[key][:8]))
                raise InputError(f"--only {choice}: is not among the levels; choose of {levels}")
            kept.setdefault(key, []).extend(found)
        for key, among in kept.items():
            factors[key] = tuple(level for level in factors[key] if level in among)
        seeds = factors.pop(SEED)
        return replace(self, factors=factors, seeds=seeds)

    def conditions(self) -> list[Condition]:
        """Return all combinations of the levels, seeds varying fastest."""
        return list(self._combined())

    def _combined(self) -> Iterator[Condition]:
        for combination in itertools.product(*self.factors.values()):
            levels = dict(zip(self.factors, combination, strict=True))
            method = levels.pop(METHOD, METHODS[0].name)
            overrides = (*self.fixed, *(f"{k}={toml_text(v)}" for k, v in levels.items()))
            for seed in self.seeds:
                yield Condition(
                    scenario=self.scenario,
                    preset=self.preset,
                    overrides=overrides,
                    method=method,
                    seed=seed,
                    targets=self.targets,
                    place=self.place,
                    levels=levels,
                )


def _ends(levels: Sequence[Any]) -> Sequence[Any]:
    return levels if len(levels) < 2 else (levels[0], levels[-1])


def _is(level: Any, text: str) -> bool:
    if isinstance(level, int | float) and not isinstance(level, bool):
        with suppress(ValueError):
            return float(text) == level
    return text in (str(level), toml_text(level))


def experiment_path(place: str | Path) -> Path:
    """Return an experiment's file: a path, or SCENARIO/NAME of one that comes with the package.

    Raises
    ------
    InputError
        If there is nothing of the kind.
    """
    path = Path(place)
    if path.is_file():
        return path
    folder = shipped(path.parent.name) if len(path.parts) == 2 else None
    if folder is not None and (folder / f"{path.stem}.toml").is_file():
        return folder / f"{path.stem}.toml"
    raise InputError(
        f"{place}: there is no such experiment file; give its path, or one that is shipped, "
        "as grid5x5/figure8"
    )


def read_experiment(place: str | Path) -> Experiment:
    """Return the experiment in a file.

    Raises
    ------
    InputError
        If there is no such file or something in it is wrong; the text names file, key and remedy.
    """
    path = experiment_path(place)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is not TOML ({error}); correct it there") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); correct the path") from error
    for key in table:
        if key not in KNOWN:
            raise InputError(f"{path}: {key}: is not a known key; {suggestion(key, KNOWN)}")
    scenario = _text(path, table, "scenario")
    seed = _number(path, table, "seed", default=1, least=0)
    experiment = Experiment(
        path=path,
        title=_text(path, table, "title", default=path.stem),
        scenario=scenario,
        place=_scenario_place(path, scenario),
        preset=_text(path, table, "preset") if "preset" in table else None,
        factors=_factors(path, table.get("factors")),
        seeds=tuple(range(seed, seed + _number(path, table, "replicates", default=1))),
        targets=_number(path, table, "targets", default=FRESH_TARGETS),
    )
    _refuse_unknown_keys(experiment)
    return experiment


def _text(path: Path, table: Mapping[str, Any], key: str, *, default: str | None = None) -> str:
    value = table.get(key, default)
    if value is None:
        raise InputError(f"{path}: {key}: is missing; give its name in quotes")
    if not isinstance(value, str) or not value:
        raise InputError(f"{path}: {key}: should be text in quotes, not {shown(value)}")
    return value


def _number(path: Path, table: Mapping[str, Any], key: str, *, default: int, least: int = 1) -> int:
    value = table.get(key, default)
    if type(value) is not int or value < least:
        remedy = f"give a whole number from {least} on"
        raise InputError(f"{path}: {key}: should not be {shown(value)}; {remedy}")
    return value


def _scenario_place(path: Path, scenario: str) -> Path:
    """Return the scenario's file: relative to the experiment's folder, or a shipped one."""
    beside = path.parent / scenario
    try:
        return scenario_path(beside if beside.exists() else scenario)
    except InputError as error:
        raise InputError(f"{path}: scenario: {error}") from error


def _factors(path: Path, table: Any) -> dict[str, tuple[Any, ...]]:
    if not isinstance(table, dict) or not table:
        what = "is missing" if table is None else f"should be a table, not {shown(table)}"
        remedy = 'write [factors] and below it "dotted.key" = [level, level]'
        raise InputError(f"{path}: factors: {what}; {remedy}")
    for key, levels in table.items():
        fault = _fault_of(key, levels)
        if fault:
            raise InputError(f"{path}: factors.{key}: {fault}")
    return {key: tuple(levels) for key, levels in table.items()}


def _fault_of(key: str, levels: Any) -> str | None:
    if isinstance(levels, dict):
        whole = f'"{key}.{next(iter(levels), "key")}"'
        return f"should be a list of levels; write the whole key in quotes, as {whole} = [...]"
    if not isinstance(levels, list) or not levels:
        return f"should be a list of levels, not {shown(levels)}; write {key} = [level, level]"
    for index, level in enumerate(levels):
        if level in levels[:index]:
            return f"names the level {shown(level)} more than once; name it once"
        try:
            toml_text(level)
            if key == METHOD:
                method_named(level)
        except ValueError as error:
            return f"{level}: {error}"
    if key == "search.seed":
        return "seeds come from replicates (and seed, the first); leave the factor out"
    return None


def _refuse_unknown_keys(experiment: Experiment) -> None:
    """Tell at once of keys that no condition could be run with.

    A level out of range is told later, as the reason of the conditions that have it: it may be
    sound together with others only.
    """
    first = next(experiment._combined())
    draft = read_draft(first.place, preset=first.preset, overrides=first.settings)
    for fault in draft.faults:
        key, _, what = fault.partition(": ")
        if "is not a known" in what or "is not a dotted key" in what:
            raise InputError(f"{experiment.path}: factors.{key}: {what}")
        if key.startswith("presets."):
            raise InputError(f"{experiment.path}: preset: {fault}")
