"""A plan that is shown as soon as it is made, while it is driven for what it is worth."""

import argparse
import sys

from planner.cli.printing import console
from planner.flight.plan import Plan
from planner.mission.opening import OpenScenario
from planner.mission.trial import Attempt
from planner.report import sentences, tables
from planner.report.formats import FittingTable


class Preview:
    """Shows a plan before fresh targets are driven, to somebody who would have to wait for it."""

    def __init__(
        self, arguments: argparse.Namespace, opened: OpenScenario, attempt: Attempt
    ) -> None:
        self._opened, self._attempt, self.is_shown = opened, attempt, False
        someone_waits = sys.stdout is not None and sys.stdout.isatty() and not arguments.json
        self._is_wanted = someone_waits and opened.scenario.truth.driving == "free"

    def __call__(self, many: int) -> None:
        """Show the plan, for which so many fresh targets are driven now."""
        if self._is_wanted:
            self.is_shown = True
            out = console()
            out.print(flight_table(self._attempt.plan, self._opened))
            out.print(sentences.estimate_follows(many))


def flight_table(plan: Plan, opened: OpenScenario) -> FittingTable:
    """Return the roads of a plan, or its waypoints where it leaves them."""
    until_s = opened.scenario.search.horizon_s
    if plan.follows_roads:
        return tables.legs_table(plan, opened.network, until_s)
    return tables.waypoints_table(plan, until_s)
