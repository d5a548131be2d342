"""The result of a search, as a run keeps it and as it is printed."""

import argparse
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from planner.bounds.certificate import Certificate
from planner.cli.preview import flight_table
from planner.detection.mistimed import Mistimed
from planner.detection.prospects import Prospects
from planner.futures.futures import Futures
from planner.mission import run_folder
from planner.mission.opening import OpenScenario
from planner.mission.own_futures import OwnFutures
from planner.mission.plan_file import plan_content, timing_content
from planner.mission.trial import Attempt, Trial
from planner.network.georeference import is_georeferenced
from planner.network.road_network import RoadNetwork
from planner.report import finds, real_flight, sentences, tables
from planner.search.problem import Problem


@dataclass(frozen=True, eq=False)
class Planned:
    """The result of a search."""

    opened: OpenScenario
    problem: Problem  # that the plan solves
    attempt: Attempt
    certificate: Certificate | None = None
    no_bound: str = ""  # why there is no certificate, though it was asked for
    # of which run it is the rest, as ``plan.json`` has it; empty: of none
    parent: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Found(Planned):
    """The result of a search, and what it is worth."""

    met: Futures = field(kw_only=True)  # the targets of its trial
    trial: Trial = field(kw_only=True)
    prospects: Prospects = field(kw_only=True)  # of any flight, on the same fresh targets
    fresh: tables.Fresh = field(kw_only=True)  # what its targets for evaluation are
    timing: tuple[Mistimed, ...] = field(kw_only=True)  # flown otherwise; () for the ideal aircraft

    @property
    def row(self) -> tables.MethodRow:
        """Its row in a table."""
        return replace(tables.row_of(self.trial), fresh=self.fresh)

    @cached_property
    def content(self) -> dict[str, Any]:
        """What ``plan.json`` holds."""
        content = plan_content(
            self.trial.plan,
            self.problem,
            planned=self.trial.planned,
            evaluated=self.trial.evaluated,
            seed=self.opened.scenario.search.seed,
            sighted_at=self.opened.scenario.target.sighted_at,
        )
        if len(names := self.opened.scenario.target_names) > 1:
            content["targets"] = [*names]
        if self.parent:
            content["parent"] = dict(self.parent)
        if self.trial.own is not None:
            content["planner"] = self.trial.own.as_dict()
        if self.timing:
            content["evaluated"]["timing"] = timing_content(self.timing)
        return content


def blocks_of(
    arguments: argparse.Namespace, found: Found, *, own: OwnFutures | None, shown: bool
) -> Iterator[Any]:
    """Yield the tables and sentences to print.

    Parameters
    ----------
    own
        The futures that take the place of the belief; None: it is planned for.
    shown
        Whether the flight has been shown already.
    """
    opened, trial, certificate = found.opened, found.trial, found.certificate
    if not shown:
        yield flight_table(trial.plan, opened)
    yield tables.plan_table(found.row, in_town=not opened.network.is_abstract)
    if found.problem.objective.sought > 1:
        yield finds.targets_table(trial.evaluated, opened.scenario.target_names)
    if not opened.network.is_abstract:
        yield from sentences.prospects_lines(found.prospects)
    yield from _timing(found)
    yield from filter(
        None,
        (
            sentences.as_if_perfect({found.row.method: trial.evaluated}),
            sentences.hidden_line(opened.scenario.hidden),
            sentences.flees_line(opened.scenario.targets),
        ),
    )
    yield from _hints(found, own=own is not None)
    if trial.result.stopped:
        yield "the search was stopped: this is the best plan so far"
    if own is not None:
        many = len(trial.evaluated.weight)
        yield sentences.own_futures_line(found.fresh, many, len(own.paths))
    if certificate is not None:
        yield sentences.certificate_line(certificate, found.problem.objective.by_s)
        if certificate.gap > arguments.gap:
            yield sentences.gap_line(arguments.gap)
    elif arguments.gap is not None:
        yield f"there is no certificate: {found.no_bound}"
    if arguments.output:
        yield f"written to {arguments.output}"
        yield from _next_steps(arguments.output, found.opened.network)
    else:
        yield "not saved; add -o DIR for plan.json, a page to look at, and what sumo-gui shows"


def _timing(found: Found) -> Iterator[Any]:
    """Yield what it costs to fly at other times, and what flies; nothing for the ideal aircraft."""
    if found.timing:
        yield real_flight.timing_table(found.trial.evaluated, found.timing, found.fresh)
        yield real_flight.corners_line(found.trial.plan)
        yield real_flight.aircraft_line(found.opened.scenario.uav)


def _next_steps(folder: Path, network: RoadNetwork) -> Iterator[str]:
    """Yield what to do with a run, a command a line."""
    typed = shlex.quote(str(folder))
    origin = "" if is_georeferenced(network) else " --origin LAT,LON"
    yield f"look at it:      open {folder / run_folder.PAGE} in a browser"
    yield f"for an aircraft: planner export {typed}{origin}"
    yield f"try it out:      planner fly {typed}"


def _hints(found: Found, *, own: bool) -> Iterator[str]:
    """Yield whether the plan was made on too few particles."""
    scenario, trial, hint = found.opened.scenario, found.trial, None
    if not found.opened.network.is_abstract:
        sought = trial.planned.objective.sought
        hint = sentences.few_in_town(len(trial.planned.weight), sought)
    if own or scenario.truths != scenario.targets:
        return
    sampling = scenario.search.sampling
    hint = hint or sentences.particles_hint(trial.planned, trial.evaluated, sampling)
    if hint:
        yield hint
