"""Records the targets that planners and missions need, each for one use."""

import logging
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from planner.belief.mixture import Belief, in_traffic
from planner.belief.particles import Particles, Realisations
from planner.belief.recipe import Drawn, OneTarget
from planner.belief.sampling import Sampling
from planner.checked import instance, set_fields, whole
from planner.detection.likelihood import draws
from planner.errors import InputError
from planner.futures.futures import Futures
from planner.futures.pooled import pooled
from planner.futures.record import How, Note
from planner.futures.store import Recording, Request, recorded, recorded_in_turn
from planner.futures.workers import HERE, Backend
from planner.mission.news import given
from planner.mission.opening import OpenScenario
from planner.mission.proposals import PROPOSALS, proposals
from planner.mission.sample_sizes import fresh_targets, holdout_particles
from planner.progress import Progress

UNSEEN = ("evaluation", "truth")  # streams of targets that no planner may know
ENOUGH, MOST_SETS = 100, 8  # draws that weights are to be worth; sets of particles recorded for it

log = logging.getLogger(__name__)


class _Set(NamedTuple):
    """Targets of one use."""

    prior: Belief
    many: int
    name: tuple[str | int, ...]  # of their random stream
    sampling: Sampling = "iid"
    seed: int | None = None  # None: the scenario's


@dataclass(frozen=True)
class Recorder:
    """Records targets of a scenario; each use has its own random stream.

    Planners see ``planning`` only: no planner can reach the streams of the others. In traffic what
    plans are made and chosen on rides in its first realisations. Fresh targets and truths ride in
    as many others, which no planner has seen.
    """

    opened: OpenScenario
    workers: int | None = None
    progress: Progress | None = None
    backend: Backend = HERE  # whose processes drive them

    def __post_init__(self) -> None:
        instance("opened", self.opened, OpenScenario)
        if self.workers is not None:
            set_fields(self, {"workers": whole("workers", self.workers, least=1)})

    def planning(self, step: int | None = None) -> Recording:
        """Return the particles that planners work on; a number gives another, disjoint set."""
        return self._enough(self._to_plan_with(step))

    def planning_particles(self) -> Particles:
        """Return the particles that `planning` records, before they move."""
        return self._recipe(self._to_plan_with()).particles(self.opened.network)

    def bounding(self, number: int) -> Recording:
        """Return one of many sets of as many particles, independent draws whatever the scenario."""
        many, name = self.opened.scenario.search.particles, ("bounding", whole("number", number))
        return self._left(self._drawn(_Set(self.opened.prior, many, name)))

    def holdout(self) -> Recording:
        """Return the particles on which methods choose between plans."""
        return self._enough(self._to_choose_on())

    def proposals(self, recorded: Futures) -> Futures | None:
        """Return many particles by the kinematic clock, to search on; None if there is no clock.

        Parameters
        ----------
        recorded
            The particles that `planning` has recorded: where signals are actuated, the clock is
            fitted to some of them.
        """
        found = self._proposed(recorded)
        return None if found is None else self._given(found)

    def _proposed(self, recorded: Futures) -> Futures | None:
        sampling = self.opened.scenario.search.sampling
        if sampling == "all":
            return None
        recipe = self._recipe(_Set(self.opened.prior, PROPOSALS, ("proposals",), sampling))
        return proposals(self.opened, recipe, self.planning_particles, recorded)

    def evaluation(self, targets: int | None = None, *, note: Note | None = None) -> Recording:
        """Return the fresh targets on which plans are evaluated, independent draws.

        Parameters
        ----------
        targets
            How many; if not given, as many as `planner.mission.sample_sizes` has for them.
        note
            Where each is driven alone, called with the first ones as soon as there are some, as
            `planner.futures.record.How` has it.
        """
        return self._enough(self._to_evaluate_on(targets), note)

    def in_turn(self, *, holdout: bool) -> Generator[Recording, None, None]:
        """Yield what a plan takes: `planning`, `holdout` if there is to be one, and `evaluation`.

        Each comes as soon as it is there. Processes go on with those that follow meanwhile, so that
        they drive the fresh targets while a plan is searched for.
        """
        sets = [self._to_plan_with(), self._to_evaluate_on()]
        if holdout:
            sets.insert(1, self._to_choose_on())
        recipes = [self._recipe(one) for one in sets]
        requests = [Request(recipe, self._described(recipe)) for recipe in recipes]
        found = recorded_in_turn(self.opened.network, requests, self._how())
        for one, first in zip(sets, found, strict=True):
            yield self._enough(one, first=first)

    def truths(self, targets: int, *, seed: int) -> Recording:
        """Return true targets for missions, independent draws under their own seed.

        Where a scenario has several, so many of each: those of one mission follow each other.
        """
        many, seed = whole("targets", targets, least=1), whole("seed", seed)
        many *= len(self.opened.scenario.truths)
        return self._left(self._drawn(_Set(self.opened.truth_prior, many, ("truth",), seed=seed)))

    def validation(self, realisations: int, each: int) -> Recording:
        """Return true targets in so many realisations of the traffic that no particle has seen.

        They drive in it even if particles are believed not to.

        Parameters
        ----------
        each
            How many ride in each of them.
        """
        traffic = self.opened.traffic
        if traffic is None:
            raise InputError("traffic: nothing is said of any; give [traffic], or truths in files")
        many = whole("realisations", realisations, least=2) * whole("each", each, least=1)
        prior = in_traffic(self.opened.truth_prior)
        search, name = self.opened.scenario.search, ("validation",)
        there = Realisations(traffic.realisations, realisations)
        recipe = Drawn(prior, many, search.horizon_s, search.seed, name, realisations=there)
        return self._recorded(recipe, self._described(recipe))

    def predefined(
        self, route: Sequence[str], *, speed_mps: float, offset_m: float = 0.0, seed: int
    ) -> Recording:
        """Return one true target with a given route, as in Section 5 of the paper.

        The seed is that of SUMO's driver.
        """
        horizon_s = self.opened.scenario.search.horizon_s
        prior = self.opened.truth_prior
        seed = whole("seed", seed)
        instance("speed_mps", speed_mps, Real)
        instance("offset_m", offset_m, Real)
        speed_mps, offset_m = float(speed_mps), float(offset_m)
        name, there = ("truth",), self._realisations(prior, unseen=True)
        target = OneTarget(prior, route, speed_mps, offset_m, horizon_s, seed, name, there)
        return self._recorded(target, {"route": list(route), **self._digest(target)})

    def _to_plan_with(self, step: int | None = None) -> _Set:
        search = self.opened.scenario.search
        name = ("particles",) if step is None else ("particles", whole("step", step))
        return _Set(self.opened.prior, search.particles, name, search.sampling)

    def _to_choose_on(self) -> _Set:
        many = holdout_particles(self.opened.scenario, self.opened.network)
        # The stream keeps the first name of these: another one would change what is drawn.
        sampling = self.opened.scenario.search.sampling
        return _Set(self.opened.prior, many, ("judges",), sampling)

    def _to_evaluate_on(self, targets: int | None = None) -> _Set:
        if targets is None:
            targets = fresh_targets(self.opened.scenario, self.opened.network)
        many = whole("targets", targets, least=1)
        return _Set(self.opened.truth_prior, many, ("evaluation",))

    def _enough(
        self, one: _Set, note: Note | None = None, first: Recording | None = None
    ) -> Recording:
        """Return targets of a belief; more of them where news leaves hardly any weight."""
        parts = [self._drawn(one, note) if first is None else first]
        while not self._suffices(parts) and len(parts) < MOST_SETS and one.sampling != "all":
            parts.append(self._drawn(one._replace(name=(*one.name, "more", len(parts)))))
        if len(parts) == 1:
            return self._left(parts[0])
        _warn_once(
            f"news leaves few of the targets drawn: more are, up to {MOST_SETS} times as many"
        )
        log.info(
            "news leaves %s of %s targets; recorded %d times as many",
            f"{draws(self._given(parts[0].futures).weight):,.0f}",
            f"{one.many:,}",
            len(parts),
        )
        return self._left(Recording.pooled(parts))

    def _left(self, drawn: Recording) -> Recording:
        """Return what news leaves of targets; all that it rules out are left out."""
        if not self._knows_more:
            return drawn
        futures = self._given(drawn.futures)
        return replace(drawn, futures=futures).take(np.flatnonzero(futures.weight))

    @property
    def _knows_more(self) -> bool:
        """Whether weights are others than those that targets are drawn with."""
        return bool(self.opened.news)

    def _suffices(self, parts: Sequence[Recording]) -> bool:
        """Return whether news leaves enough of some particles to plan on."""
        if not self._knows_more:
            return True
        left = self._given(pooled([part.futures for part in parts])).weight
        return draws(left) >= ENOUGH

    def _given(self, futures: Futures) -> Futures:
        """Return futures with the weights that they have after the scenario's news."""
        opened = self.opened
        return given(futures, opened.news, opened.network, speed_mps=opened.scenario.uav.speed_mps)

    def _drawn(self, one: _Set, note: Note | None = None) -> Recording:
        recipe = self._recipe(one)
        return self._recorded(recipe, self._described(recipe), note)

    def _described(self, recipe: Drawn) -> dict[str, Any]:
        """Return what particles are drawn from, in the scenario's words."""
        scenario = self.opened.scenario
        beliefs = [
            belief.model_dump(mode="json", exclude_none=True, exclude={"sighted_at", "name"})
            for belief in (
                scenario.targets if recipe.prior is self.opened.prior else scenario.truths
            )
        ]
        return {
            "target": beliefs[0] if len(beliefs) == 1 else beliefs,
            "horizon_s": recipe.horizon_s,
            "sampling": recipe.sampling,
            "seed": recipe.seed,
            "stream": list(recipe.stream),
            **self._digest(recipe),
        }

    def _digest(self, recipe: Drawn | OneTarget) -> dict[str, str]:
        """Return that of the traffic in which particles ride, if they do."""
        traffic = self.opened.traffic
        if recipe.realisations is None or traffic is None:
            return {}
        return {"traffic": traffic.digest}

    def _recipe(self, one: _Set) -> Drawn:
        search = self.opened.scenario.search
        seed = search.seed if one.seed is None else one.seed
        there = self._realisations(one.prior, unseen=one.name[0] in UNSEEN)
        return Drawn(one.prior, one.many, search.horizon_s, seed, one.name, one.sampling, there)

    def _realisations(self, prior: Belief, *, unseen: bool) -> Realisations | None:
        """Return in which realisations of the traffic particles ride; None if they ride in none."""
        traffic = self.opened.traffic
        if traffic is None or prior.driving != "traffic":
            return None
        return Realisations(traffic.realisations if unseen else 0, traffic.realisations)

    def _recorded(
        self, recipe: Drawn | OneTarget, described: Mapping[str, Any], note: Note | None = None
    ) -> Recording:
        how = self._how(note)
        return recorded(self.opened.network, recipe, scenario=described, how=how)

    def _how(self, note: Note | None = None) -> How:
        tolerance_m, traffic = self.opened.scenario.futures.tolerance_m, self.opened.traffic
        return How(tolerance_m, self.workers, self.progress, note, self.backend, traffic)


@cache
def _warn_once(text: str) -> None:
    """Say what would be said again for each of many plans."""
    log.warning(text)
