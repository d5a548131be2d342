"""A call as a page before there is a plan: where the target may be, as the quick clock guesses."""

import numpy as np

from planner.futures.futures import Futures
from planner.mission.guess import told_reach
from planner.mission.opening import OpenScenario
from planner.page.content import Drawn, guess_content
from planner.page.document import NO_PARTS, document, markup
from planner.page.legend import dots
from planner.page.still import still
from planner.page.words import UNTITLED, Clock

NO_PLAN = "The first plan is being made; this page turns into it."


def page_of_guess(opened: OpenScenario, guess: Futures) -> str:
    """Return a page of where the target may be, and of where the drone waits.

    Parameters
    ----------
    guess
        Of the planning particles, before SUMO drives any.
    """
    scenario, clock = opened.scenario, Clock(opened.scenario.target.sighted_at)
    title, horizon_s = scenario.title or UNTITLED, scenario.search.horizon_s
    drawn = Drawn.around(
        opened.network,
        guess,
        np.full(len(guess), np.inf),
        [np.array(opened.starts_m)],
        radius_m=scenario.sensor.radius_m,
        until_s=horizon_s,
    )
    there_m = drawn.targets.positions(float(scenario.take_off_s))
    picture = still(
        drawn.view,
        roads=drawn.roads,
        targets_m=there_m[np.isfinite(there_m[:, 0])],
        flights=(),
        label=markup(f"Map of where it may be: {title}"),
    )
    notes = (NO_PLAN, f"Where it may be: {told_reach(guess, horizon_s)}.")
    parts = NO_PARTS | {
        "KIND": "guess",
        "ABOUT": markup(f"last seen {clock.at(0.0)} · searched until {clock.short(horizon_s)}"),
        "ODDS": "<li><b>no plan yet</b> <span>the map is a guess</span></li>",
        "STILL": picture,
        "DOTS": dots(),
        "NOTES": "".join(f"<p>{markup(note)}</p>" for note in notes),
        "CREDIT": markup(opened.network.attribution),
    }
    return document(title=title, data=guess_content(opened, drawn, clock), parts=parts)
