"""What on-line planning is worth: Section 6 leaves open plans that change with what comes in."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from planner.detection.evaluate import evaluate
from planner.experiments.condition import Condition
from planner.experiments.results import Row
from planner.mission.alarms import Alarms, by_chance, compared
from planner.mission.online import Remembering
from planner.mission.planning import holdout_for, make_plan
from planner.paper.claims import Claim, ResultsByName, markdown_table
from planner.paper.figures import U0
from planner.paper.in_flight import Flight, afresh, reported, with_no_news
from planner.report.estimates import Estimate, chosen, estimate, levels
from planner.report.formats import km
from planner.scenario.toml_text import toml_text
from planner.search.methods import method_named
from planner.streams import stream

ARRIVALS_S = (1000.0, 2000.0, 4000.0)
REPORTS = 2  # at each of these times
ALARMS, SEQUENCES = Alarms(every_s=600.0, lasts_s=120.0), 1
HALF_WAY = 0.5
SAVED = "saved"

REPORT = "a report, 70 % sure, 1 km off, 5 minutes old"
LATE = "a false alarm every 10 minutes, 2 minutes each"
SECOND = "a second UAV from the same place"
SILENCE = f"nothing, planned anew at {', '.join(f'{one:,.0f}' for one in ARRIVALS_S)} s"
AFRESH = "nothing, planned afresh half-way, the old plan forgotten"
WORTH, NOTHING = (REPORT, LATE, SECOND), (SILENCE, AFRESH)


def online_of(condition: Condition) -> dict[str, Any]:
    """Return what planning anew is worth after all that may come in, on fresh targets.

    A row for each: the expected time, from when it is heard, of the flight as it was planned, and
    with a plan made anew; the share of the first that this saves.
    """
    recorder = Remembering(condition.opened(), 1)
    targets = recorder.evaluation(condition.targets).futures
    flight = Flight.planned(recorder, targets)
    found = {REPORT: _reported(flight, condition.seed), LATE: _alarmed(flight, condition.seed)}
    found[SECOND] = flight.whole_s, _together_s(condition, flight)
    half_way_s = HALF_WAY * flight.plan.tracks[0].end_s
    for name, track in (
        (SILENCE, with_no_news(flight, *ARRIVALS_S)),
        (AFRESH, afresh(flight, half_way_s)),
    ):
        found[name] = flight.whole_s, flight.expected_s(track)
    rows = [
        {"what": what, "as_planned_s": before_s, "anew_s": after_s, SAVED: 1.0 - after_s / before_s}
        for what, (before_s, after_s) in found.items()
    ]
    return {"rows": rows}


def _reported(flight: Flight, seed: int) -> tuple[float, float]:
    """Return the mean time still to come after reports, without and with a plan made anew."""
    heard = [
        one
        for arrival_s in ARRIVALS_S
        for one in reported(flight, arrival_s, REPORTS, stream(seed, "reports", f"{arrival_s:g}"))
    ]
    as_planned_s, anew_s = np.array(heard).mean(axis=0).tolist()
    return as_planned_s, anew_s


def _alarmed(flight: Flight, seed: int) -> tuple[float, float]:
    """Return the expected times with false alarms, flown late and planned anew after each."""
    horizon_s = flight.problem.objective.horizon_s
    gaps = [ALARMS.gaps_s(horizon_s, stream(seed, "alarms", k)) for k in range(SEQUENCES)]
    alarms = [partial(by_chance, one.tolist()) for one in gaps]
    found = compared(flight.mission(), flight.targets, alarms, ALARMS.lasts_s)
    return float(np.mean(found.late_s)), float(np.mean(found.anew_s))


def _together_s(condition: Condition, flight: Flight) -> float:
    """Return the expected time of two UAVs that are alike and planned together."""
    start = condition.opened().scenario.uav.start.model_dump(exclude_none=True)
    opened = condition.opened([f"uav={toml_text([{'start': start}] * 2)}"])
    recorder, best = Remembering(opened, 1), method_named("best")
    planning, holdout = recorder.planning().futures, holdout_for(best, recorder)
    tracks = make_plan(best, opened, recorder, planning, holdout=holdout).plan.tracks
    problem = flight.problem
    found = evaluate(tracks, flight.targets, problem.sensor, problem.objective)
    return found.expected_detection_time_s


def claims(found: ResultsByName) -> Iterator[Claim]:
    """Yield what is answered of Section 6."""
    if "online" not in found:
        return
    rows = [row for row in found["online"].rows if row.get("reason") is None]
    yield Claim(
        "What is on-line planning worth?",
        "Section 6",
        "`best` on the 5 x 5 grid, one pass in ten misses; time from when it is heard on, with the "
        "plan there was and with one made anew on the same particles; reports are as often true as "
        "they say; with more UAVs, the whole search",
        "beyond the paper",
        f"{_ranges(rows, WORTH)}.",
        _table(rows, WORTH),
    )
    yield Claim(
        "When is on-line planning worth nothing?",
        "Section 6",
        "the same; until the target is found the UAV learns nothing but that it has not been seen, "
        "which the plan has reckoned with from the start, misses included",
        "beyond the paper",
        "As long as nothing comes in, though one pass in ten misses: what planning anew changes "
        f"is chance, or work that the first plan was spared. {_ranges(rows, NOTHING)}.",
        _table(rows, NOTHING),
    )


def _ranges(rows: Sequence[Row], whats: Sequence[str]) -> str:
    """Return by how much each shortens the time, from the least distance to the greatest."""
    said = []
    for what in whats:
        saved = [one for one in (_saved(rows, what, u0) for u0 in levels(rows, U0)) if one]
        if saved:
            least, most = min(one.mean for one in saved), max(one.mean for one in saved)
            said.append(f"{what}: {100 * least:.1f} to {100 * most:.1f} % less")
    text = "; ".join(said)
    return text[:1].upper() + text[1:]


def _table(rows: Sequence[Row], whats: Sequence[str]) -> str:
    lines = []
    for what in whats:
        for u0 in sorted(levels(rows, U0)):
            where, saved = {"what": what, U0: u0}, _saved(rows, what, u0)
            before, after = (estimate(rows, where, name) for name in ("as_planned_s", "anew_s"))
            if before and after and saved:
                cells = (before.seconds, after.seconds, saved.percent)
                lines.append((what, km(u0), *cells))
    return markdown_table(["what comes in", "u0", "as planned", "planned anew", "less by"], lines)


def _saved(rows: Sequence[Row], what: str, u0: float) -> Estimate | None:
    return estimate(chosen(rows, {"what": what, U0: u0}), {}, SAVED)
