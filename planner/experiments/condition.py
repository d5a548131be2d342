"""One condition of an experiment: a scenario as it is set, a method and a seed."""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.experiments.target_set import TargetSet
from planner.futures.steering import control_of
from planner.futures.traffic import NO_PERMIT, Permit
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.sample_sizes import FRESH_TARGETS
from planner.mission.several import refuse_several
from planner.scenario.draft import read_draft
from planner.search.methods import Method, method_named, method_of
from planner.user_code import UserFunction

OF_NET = "network"  # begins the keys that decide on the network
ID_DIGITS = 16  # 64 bits: chance repeats among a million conditions have odds of 1 to 4e7


@dataclass(frozen=True)
class Condition:
    """What one plan is made and evaluated under; equal conditions give equal results."""

    scenario: str  # as the experiment file names it
    preset: str | None
    overrides: tuple[str, ...]  # such as uav.start.distance_m=120000, the seed not among them
    method: str
    seed: int  # of all random draws
    targets: int = FRESH_TARGETS  # fresh ones on which the plan is evaluated
    sets: tuple[TargetSet, ...] = ()  # of enumerated targets that it meets as well
    study: str = ""  # what is done in place of making a plan
    own: UserFunction | None = None  # the user's, that the method is; None: the program's own
    # Where the scenario lies here; elsewhere it is still the same condition.
    place: Path = field(default=Path(), compare=False)
    levels: Mapping[str, Any] = field(default_factory=dict, compare=False)  # of the factors
    metrics: tuple[str, ...] = field(default=(), compare=False)  # the table's figures; all if empty
    permit: Permit = field(default=NO_PERMIT, compare=False)  # what its traffic may be

    @cached_property
    def id(self) -> str:
        """The same for the same condition, on any machine: the start of a SHA-256."""
        return hashlib.sha256(self.canonical.encode()).hexdigest()[:ID_DIGITS]

    @property
    def canonical(self) -> str:
        """The condition as JSON that is written in one way only."""
        return json.dumps(self.as_dict(), sort_keys=True, separators=(",", ":"))

    @property
    def settings(self) -> tuple[str, ...]:
        """All overrides, the seed's among them."""
        return (*self.overrides, f"search.seed={self.seed}")

    @property
    def planned_by(self) -> Method:
        """The method that plans."""
        return method_named(self.method) if self.own is None else method_of(self.own)

    def opened(self, more: Sequence[str] = ()) -> OpenScenario:
        """Return the scenario of the condition, open, with more overrides applied after its own."""
        overrides = (*self.settings, *more)
        opened = open_scenario(
            self.place, preset=self.preset, overrides=overrides, permit=self.permit
        )
        refuse_several(opened, "an experiment")
        return opened

    def as_dict(self) -> dict[str, Any]:
        """Return what makes the condition, as plain values."""
        steers = self.permit.control
        return {
            "scenario": self.scenario,
            "preset": self.preset,
            "overrides": list(self.overrides),
            "method": self.method,
            "seed": self.seed,
            "targets": self.targets,
            **({"sets": [one.as_dict() for one in self.sets]} if self.sets else {}),
            **({"study": self.study} if self.study else {}),
            **({} if self.own is None else {"planner": self.own.as_dict()}),
            **({} if steers is None else {"control": control_of(steers).as_dict()}),
        }


def horizons_s(conditions: Iterable[Condition]) -> dict[str, float]:
    """Return when the search of each condition is given up, seconds, by the condition's id."""
    found: dict[str, float] = {}
    known: dict[tuple[Any, ...], float] = {}
    for one in conditions:
        # Seeds are most of what conditions differ in.
        where = (one.place, one.preset, one.overrides)
        if where not in known:
            place, preset, overrides = where
            search = read_draft(place, preset=preset, overrides=overrides).search
            known[where] = math.inf if search is None else search.horizon_s
        found[one.id] = known[where]
    return found


def credit_of(conditions: Iterable[Condition]) -> dict[str, str]:
    """Return whose data the networks of conditions are, as files hold it; see `RoadNetwork`."""
    # Conditions differ in a hundred keys, but hardly ever in their network.
    about = {(c.place, c.preset, tuple(o for o in c.overrides if OF_NET in o)) for c in conditions}
    credits: dict[str, None] = {}
    for place, preset, overrides in sorted(about, key=repr):
        with suppress(InputError):  # the condition has reported why
            network = read_draft(place, preset=preset, overrides=overrides).network
            credits |= {network.credit: None} if network and network.credit else {}
    return {"attribution": "; ".join(credits)} if credits else {}
