"""An experiment: factors and their levels, from which the conditions follow."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.experiments.condition import Condition
from planner.experiments.target_set import TargetSet
from planner.futures.traffic import NO_PERMIT, Permit
from planner.messages import as_written, suggestion
from planner.scenario.draft import read_draft
from planner.scenario.toml_text import toml_text
from planner.search.methods import METHODS, Method, method_named

METHOD, SEED, BLOCK = "method", "seed", "block"
PARTICLES = "search.particles"
QUICK_TARGETS, QUICK_POINTS, QUICK_SEEDS = 1000, 2, 2
QUICK_PARTICLES = 128
QUICK = (f"{PARTICLES}={QUICK_PARTICLES}", "search.work=2000")


@dataclass(frozen=True)
class Experiment:
    """What is varied, on which scenario, and how often."""

    path: Path
    title: str
    scenario: str  # as the file names it
    place: Path  # of the scenario's file
    preset: str | None
    factors: Mapping[str, Sequence[Any]]  # dotted keys of the scenario, or method
    seeds: tuple[int, ...]
    targets: int  # fresh ones for each plan
    fixed: tuple[str, ...] = ()  # overrides that hold for all conditions
    sets: tuple[TargetSet, ...] = ()  # of enumerated targets
    study: str = ""  # what is done in place of making a plan
    metrics: tuple[str, ...] = ()  # names of the figures that the table holds; all if empty
    permit: Permit = NO_PERMIT  # what the traffic of all conditions may be
    block: str = ""  # its name, if the file has several
    more: tuple["Experiment", ...] = ()  # the file's other blocks

    @property
    def parts(self) -> tuple["Experiment", ...]:
        """The file's blocks, each on its own."""
        return replace(self, more=()), *self.more

    def quick(self) -> "Experiment":
        """Return a small one of the same kind: the ends of each factor, few seeds and targets."""
        return _together([part._quick() for part in self.parts])

    def _quick(self) -> "Experiment":
        return replace(
            self,
            factors={key: tuple(_ends(key, levels)) for key, levels in self.factors.items()},
            seeds=self.seeds[:QUICK_SEEDS],
            targets=min(self.targets, QUICK_TARGETS),
            fixed=(*self.fixed, *QUICK),
            sets=tuple(replace(one, points=min(one.points, QUICK_POINTS)) for one in self.sets),
        )

    def permitted(self, permit: Permit) -> "Experiment":
        """Return it with what its conditions' traffic may be."""
        return _together([replace(part, permit=permit) for part in self.parts])

    def also_by(self, names: Sequence[str]) -> "Experiment":
        """Return it with more methods that plan for each condition, beside those it has.

        Raises
        ------
        InputError
            If there is no such method, or nothing is planned.
        """
        if self.study and names:
            raise InputError(f"--method {names[0]}: {self.path.stem} makes no plans; leave it out")
        return _together([part._also_by(names) for part in self.parts])

    def _also_by(self, names: Sequence[str]) -> "Experiment":
        known = tuple(self.factors.get(METHOD, (METHODS[0].name,)))
        levels = dict.fromkeys((*known, *(_from_here(name) for name in names)))
        return replace(self, factors={**self.factors, METHOD: tuple(levels)}) if names else self

    def only(self, choices: Sequence[str]) -> "Experiment":
        """Return the part in which factors, or the seed, have the levels chosen as key=value.

        Raises
        ------
        InputError
            If there is no such factor or level.
        """
        wanted: dict[str, list[Any]] = {}
        for choice in choices:
            key, _, text = (part.strip() for part in choice.partition("="))
            offered = self._offered(key)
            if not offered:
                known = dict.fromkeys(name for part in self.parts for name in part._levels())
                raise InputError(f"--only {choice}: no factor {key!r}; {suggestion(key, known)}")
            found = [level for level in offered if _is(level, text)]
            if not found:
                remedy = suggestion(text, map(as_written, offered))
                raise InputError(f"--only {choice}: is not among the levels; {remedy}")
            wanted.setdefault(key, []).extend(found)
        kept = [part for part in (one._only(wanted) for one in self.parts) if part is not None]
        if not kept:
            together = " --only ".join(choices)
            raise InputError(f"--only {together}: no block has all of these; choose fewer")
        return _together(kept)

    def _levels(self) -> dict[str, Sequence[Any]]:
        """Return what --only can choose of a block."""
        named = {BLOCK: (self.block,)} if self.block else {}
        return {**self.factors, SEED: self.seeds, **named}

    def _offered(self, key: str) -> list[Any]:
        """Return the levels that a factor has in any block; they need not be hashable."""
        levels = [level for part in self.parts for level in part._levels().get(key, ())]
        return [level for i, level in enumerate(levels) if level not in levels[:i]]

    def _only(self, wanted: Mapping[str, Sequence[Any]]) -> "Experiment | None":
        """Return a block with these levels alone; none if it lacks them."""
        levels = self._levels()
        for key, among in wanted.items():
            levels[key] = tuple(level for level in levels.get(key, ()) if level in among)
            if not levels[key]:
                return None
        seeds = tuple(levels.pop(SEED))
        levels.pop(BLOCK, None)
        return replace(self, factors=levels, seeds=seeds)

    def conditions(self) -> list[Condition]:
        """Return all combinations of the levels, seeds varying fastest, block after block.

        Each condition has a level of every factor of every block: where a block does not vary
        one, what the scenario has. One that occurs in several blocks is the first block's.
        """
        keys = list(dict.fromkeys(key for part in self.parts for key in part.factors))
        keys = [key for key in keys if key != METHOD]
        combined = [c for part in self.parts for c in part._combined(keys)]
        return list({condition.id: condition for condition in reversed(combined)}.values())[::-1]

    def _combined(self, keys: Sequence[str]) -> Iterator[Condition]:
        named = {BLOCK: self.block} if self.block else {}
        methods = self._methods()
        as_it_is = self._unvaried([key for key in keys if key not in self.factors])
        for combination in itertools.product(*self.factors.values()):
            levels = dict(zip(self.factors, combination, strict=True))
            level = levels.pop(METHOD, self.study or METHODS[0].name)
            method = methods.get(level)
            overrides = (*self.fixed, *(f"{k}={toml_text(v)}" for k, v in levels.items()))
            every = {**named, **{key: levels.get(key, as_it_is.get(key)) for key in keys}}
            for seed in self.seeds:
                yield Condition(
                    scenario=self.scenario,
                    preset=self.preset,
                    overrides=overrides,
                    method=level if method is None else method.name,
                    seed=seed,
                    targets=self.targets,
                    sets=self.sets,
                    study=self.study,
                    own=None if method is None else method.own,
                    place=self.place,
                    levels=every,
                    metrics=self.metrics,
                    permit=self.permit,
                )

    def _methods(self) -> dict[str, Method]:
        """Return the methods that plan, by the levels that name them."""
        if self.study:
            return {}
        named = self.factors.get(METHOD, (METHODS[0].name,))
        return {name: method_named(name, self.path.parent) for name in named}

    def _unvaried(self, keys: Sequence[str]) -> dict[str, Any]:
        """Return what the scenario has where this block does not vary it."""
        if not keys:
            return {}
        draft = read_draft(self.place, preset=self.preset, overrides=self.fixed)
        return {key: _value(draft, key) for key in keys}


def _from_here(name: str) -> str:
    """Return a method's name; the path of a user's own begins from where it was typed."""
    own = method_named(name).own
    return name if own is None else f"{own.path.resolve()}:{own.function}"


def _together(parts: Sequence[Experiment]) -> Experiment:
    return replace(parts[0], more=tuple(parts[1:]))


def _value(draft: Any, key: str) -> Any:
    """Return the plain value of a dotted key, None where there is none."""
    section, *names = key.split(".")
    found: Any = getattr(draft, section, None)
    for name in names:
        found = getattr(found, name, None)
    if hasattr(found, "model_dump"):
        return found.model_dump(mode="json", exclude_none=True)
    return found


def _ends(key: str, levels: Sequence[Any]) -> Sequence[Any]:
    if key == PARTICLES:
        return sorted({min(level, QUICK_PARTICLES) for level in levels})[:2]
    return levels if key == METHOD or len(levels) < 2 else (levels[0], levels[-1])


def _is(level: Any, text: str) -> bool:
    if isinstance(level, int | float) and not isinstance(level, bool):
        with suppress(ValueError):
            return float(text) == level
    return text in (str(level), toml_text(level))
