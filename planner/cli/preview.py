"""A plan that is shown as soon as it is made, while it is driven for what it is worth."""

import argparse
import sys
from contextlib import suppress

from planner.belief.particles import Driving
from planner.cli.backends import recorder_of
from planner.cli.printing import console
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.mission.opening import OpenScenario
from planner.mission.trial import Attempt, attempted
from planner.report import flight_tables, sentences
from planner.report.formats import FittingTable
from planner.search.methods import method_named

FIRST = "rate"  # the method of the first plan, where another one has to wait for more particles


class Preview:
    """Shows a plan before fresh targets are driven, to somebody who would have to wait for it."""

    def __init__(
        self, arguments: argparse.Namespace, opened: OpenScenario, attempt: Attempt
    ) -> None:
        self._opened, self._attempt, self.is_shown = opened, attempt, False
        self._is_wanted = _someone_waits(arguments, opened.scenario.truth.driving)

    def __call__(self, many: int) -> None:
        """Show the plan, for which so many fresh targets are driven now."""
        if self._is_wanted:
            self.is_shown = True
            out = console()
            out.print(flight_table(self._attempt.plan, self._opened))
            out.print(sentences.estimate_follows(many))


def show_first_plan(
    many: int, *, arguments: argparse.Namespace, opened: OpenScenario, futures: Futures
) -> None:
    """Show what a quick method makes of the particles, while so many are driven for a slower one.

    Nobody's draws are touched: every method has a random stream of its own.
    """
    if not _someone_waits(arguments, opened.scenario.target.driving):
        return
    with suppress(NotApplicableError):
        method = method_named(FIRST)
        first = attempted(method, recorder_of(arguments, opened), futures)
        out = console()
        out.print(flight_table(first.plan, opened))
        out.print(sentences.better_plan_follows(FIRST, arguments.method, many))


def _someone_waits(arguments: argparse.Namespace, driving: Driving) -> bool:
    """Return whether a person looks at a terminal while targets are driven one by one."""
    is_seen = sys.stdout is not None and sys.stdout.isatty() and not arguments.json
    return is_seen and driving != "constant"


def flight_table(plan: Plan, opened: OpenScenario) -> FittingTable:
    """Return the roads of a plan, or its waypoints where it leaves them."""
    until_s = opened.scenario.search.horizon_s
    if plan.follows_roads:
        return flight_tables.legs_table(plan, opened.network, until_s)
    radius_m = None if opened.network.is_abstract else opened.scenario.sensor.radius_m
    return flight_tables.waypoints_table(plan, opened.network, until_s, radius_m=radius_m)
