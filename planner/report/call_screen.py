"""What is said of a call while it is planned, as lines for a terminal of 80 columns.

Times are those of a watch. The odds come first, as a range over what is not known; how far chance
in the drawing of targets may have moved them stands at the end.
"""

import textwrap
from collections.abc import Iterator, Sequence
from datetime import datetime, timedelta

import numpy as np

from planner.arrays import Floats
from planner.clock import rough, to_minute, to_second
from planner.detection.evaluation import Evaluation
from planner.detection.paired import Ahead
from planner.detection.prospects import gone_by
from planner.messages import percent
from planner.mission.call import Call
from planner.mission.guess import told_reach
from planner.mission.now_events import (
    BetterPlan,
    Cloud,
    Condition,
    Done,
    FirstPlan,
    NoBetter,
    Outlook,
)
from planner.network.georeference import coordinates, grid_convergence_deg, is_georeferenced
from planner.network.street_names import road_phrase, street_at
from planner.report.formats import length

WIDTH, MARGIN = 71, 8  # characters of a line, and how far to the right it stands
EVERY_MIN = 5  # the odds are told at round minutes
MOST_TIMES = 5  # at which they are told
BESIDE_M = 100.0  # from a street: farther away, it is not named
STRAIGHT_M = 20.0  # beside a straight way, a flight still follows it


def since(elapsed_s: float) -> str:
    """Return how long ago the call came, as it stands before a line: "  0:07"."""
    minutes, seconds = divmod(int(elapsed_s), 60)
    return f"{minutes:3d}:{seconds:02d}"


def beside(margin: str, text: str) -> str:
    """Return lines of a text with something in the margin of the first one."""
    first, *others = textwrap.wrap(text, WIDTH, break_on_hyphens=False)
    return "\n".join([f"{margin:{MARGIN}}{first}", *(f"{'':{MARGIN}}{line}" for line in others)])


def cloud_line(event: Cloud) -> str:
    """Return how far the target may have come."""
    if event.guess is None:
        return "where it may be shows when SUMO has driven it: this net has no quick clock"
    return f"where it may be: {told_reach(event.guess, event.opened.scenario.search.horizon_s)}"


def plan_line(event: FirstPlan) -> str:
    """Return what is new with a plan, and against the one before."""
    made = f"on {len(event.planning.futures):,} particles"
    leaves = f"take-off {take_off(event)}"
    if isinstance(event, BetterPlan):
        later_s = event.take_off_s - event.before_s
        later = f", {later_s:.0f} s later" if later_s > 0.0 else ""
        lead = _lead(event.lead)
        return f"better plan {made}: {lead}; {leaves}{later}"
    return f"first plan {made}: {leaves}"


def no_better_line(event: NoBetter) -> str:
    """Return that the plan before stands."""
    lead = _lead(event.lead)
    return f"no better plan on {event.particles:,} particles, so it stands; the other: {lead}"


def done_line(event: Done) -> str:
    """Return when the best plan takes off, and how late that is already."""
    which = "stopped: the best plan so far" if event.stopped else "the best plan"
    late_s = event.elapsed_s - event.plan.take_off_s
    late = f", {rough(late_s)} ago: fly now, or call again for a later one" if late_s >= 1.0 else ""
    return f"{which} takes off {take_off(event.plan)}{late}"


def take_off(event: FirstPlan) -> str:
    """Return when the drone takes off, on the watch."""
    return to_second(_moment(event.call, _take_off(event)), event.call.called_at)


def _lead(lead: Ahead) -> str:
    """Return how far a plan is ahead, paired on the same fresh targets."""
    sign, way = (100.0, "sooner") if lead.share >= 0.0 else (-100.0, "later")
    share, *ends = (sign * one for one in lead)
    low, high = sorted(ends)
    return f"found {share:.1f} % {way} (95 %: {low:.1f} .. {high:.1f}, paired)"


def screen(event: FirstPlan, outlook: Outlook | None = None) -> Iterator[str]:
    """Yield a plan's screen: odds, first leg, where from, what instead, what matters, who is gone.

    Parameters
    ----------
    outlook
        None while nothing is known yet beyond the plan itself.
    """
    call, times_s = event.call, _times(event)
    yield from _odds(event, outlook, times_s)
    yield from _wrapped("first leg:", first_leg(event))
    if len(event.sites) > 1:
        yield from _wrapped("launch from:", _sites(event, times_s[-1]))
    if outlook is not None:
        yield from _instead(outlook, times_s[-1])
        yield from _matters(outlook, times_s[-1])
    gone = [(s, gone_by(event.fresh.futures, s)) for s in times_s]
    if gone[-1][1] > 0.0:
        said = ", ".join(f"{_percent(share)} by {at(call, s)}" for s, share in gone)
        yield from _wrapped("off the map:", said)
    yield from _wrapped("how sure:", _details(event, times_s))


def at(call: Call, time_s: float) -> str:
    """Return the time of day of a time on the target's clock, to the minute."""
    return to_minute(_moment(call, time_s), call.called_at)


def _moment(call: Call, time_s: float) -> datetime:
    ago_s = call.tables["target"]["last_seen_ago_s"]
    return call.called_at + timedelta(seconds=round(time_s - ago_s))


def _take_off(event: FirstPlan) -> float:
    """Return when the drone takes off, on the target's clock."""
    return float(event.opened.scenario.take_off_s)


def _times(event: FirstPlan) -> list[float]:
    """Return when the odds are told: at round minutes on the watch, and at the end."""
    end_s, begin_s = event.problem.objective.horizon_s, _take_off(event)
    begin = _moment(event.call, begin_s)
    past_s = (begin.minute % EVERY_MIN) * 60.0 + begin.second
    first_s = begin_s - past_s + 60.0 * EVERY_MIN
    round_s = np.arange(first_s, end_s - 60.0, 60.0 * EVERY_MIN)
    step = max(1, -(-len(round_s) // (MOST_TIMES - 1)))
    return [*round_s[::step].tolist(), end_s]


def _odds(event: FirstPlan, outlook: Outlook | None, times_s: Sequence[float]) -> Iterator[str]:
    conditions = () if outlook is None else outlook.conditions
    for time_s in times_s:
        share = event.trial.evaluated.found_by_probability(time_s)
        said = f"found by {at(event.call, time_s)}: {_percent(share)}"
        ifs = ", ".join(f"if {name} {_points(one, time_s)}" for name, one, _ in conditions)
        yield from _wrapped(said, f"({ifs})" if ifs else "")


def first_leg(event: FirstPlan) -> str:
    """Return where the drone flies first: the street, true bearing, distance, and the place."""
    network, (track,) = event.opened.network, event.trial.plan.tracks
    xy_m = np.stack([track.x_m, track.y_m], axis=1)
    to_m = xy_m[_first_turn(xy_m)]
    step = to_m - xy_m[0]
    if not step.any():
        return "stays where it takes off"
    bearing_deg = float(np.degrees(np.arctan2(step[0], step[1])))
    kind = ""
    if is_georeferenced(network):
        bearing_deg += float(grid_convergence_deg(network, xy_m[0]))
        kind = " true"
    legs = event.trial.plan.legs[0]
    near = street_at(network, to_m)
    street = near.name if near.away_m <= BESIDE_M else ""
    if legs:
        street = road_phrase(network, legs[0].leg)
    way = f"{round(bearing_deg) % 360:03d} deg{kind}, {length(float(np.hypot(*step)))}"
    place = coordinates(network, to_m)
    return f"to {street}: {way}, to {place}" if street else f"{way}, to {place}"


def _first_turn(xy_m: Floats) -> int:
    """Return to which of a flight's points, (W, 2) metres, it flies straight from the first."""
    k = 1
    while k < len(xy_m) and _is_straight(xy_m[: k + 1]):
        k += 1
    return k - 1


def _is_straight(xy_m: Floats) -> bool:
    """Return whether all points lie near the way from the first one to the last, in its course."""
    steps, whole = xy_m - xy_m[0], xy_m[-1] - xy_m[0]
    long_m = float(np.hypot(*whole))
    if long_m == 0.0:
        return not steps.any()
    along_m = steps @ whole / long_m
    off_m = np.abs(steps @ np.array([-whole[1], whole[0]]) / long_m)
    return bool(off_m.max() <= STRAIGHT_M and np.all(np.diff(along_m) >= 0.0))


def _sites(event: FirstPlan, end_s: float) -> str:
    odds = sorted(event.sites, key=lambda site: -site[1].found_by_probability(end_s))
    shares = (f"{name} {_percent(one.found_by_probability(end_s))}" for name, one in odds)
    return f"{'; '.join(shares)} by {at(event.call, end_s)}, on the first plans"


def _instead(outlook: Outlook, end_s: float) -> Iterator[str]:
    by = at(outlook.plan.call, end_s)
    said = []
    if outlook.waiting is not None:
        name, one = outlook.waiting
        said.append(f"waiting at {name} {_percent(one.found_by_probability(end_s))}")
    if outlook.pattern is not None:
        name, one = outlook.pattern
        share = _percent(one.found_by_probability(end_s))
        said.append(f"the best of a pilot's patterns, {name}, {share}")
    if said:
        yield from _wrapped("instead:", f"{'; '.join(said)} by {by}")


def _matters(outlook: Outlook, end_s: float) -> Iterator[str]:
    """Yield what would be worth asking."""
    if not outlook.unknowns:
        return
    by = at(outlook.plan.call, end_s)
    yield from _wrapped("would change it:", f"if you ask, and say it; found by {by} (95 %), if so:")
    for name, option, answers in outlook.unknowns:
        said = ", ".join(_answer(one, end_s) for one in answers)
        yield from textwrap.wrap(
            f"- {name} ({option}): {said}",
            WIDTH,
            initial_indent="  ",
            subsequent_indent="    ",
            break_on_hyphens=False,
        )


def _answer(one: Condition, end_s: float) -> str:
    low, high = one.evaluated.found_by_interval(end_s)
    share = "" if one.share is None else f"; {_percent(one.share)} are so"
    return (
        f"{one.name} {_points(one.evaluated, end_s)} ({100 * low:.0f} .. {100 * high:.0f}{share})"
    )


def _details(event: FirstPlan, times_s: Sequence[float]) -> str:
    evaluated = event.trial.evaluated
    said = []
    for time_s in times_s:
        low, high = evaluated.found_by_interval(time_s)
        said.append(f"{100 * low:.0f} .. {percent(high, 0)} by {at(event.call, time_s)}")
    return f"{', '.join(said)} (95 %, on {len(evaluated.weight):,} fresh targets)"


def _percent(share: float) -> str:
    return percent(share, 0)


def _points(evaluated: Evaluation, time_s: float) -> str:
    return f"{100.0 * evaluated.found_by_probability(time_s):.0f}"


def _wrapped(name: str, text: str) -> Iterator[str]:
    yield from textwrap.wrap(
        f"{name} {text}".strip(), WIDTH, subsequent_indent="  ", break_on_hyphens=False
    )
