"""A run as one page: the headline, a still map and the legs in it, and a script that moves it."""

from collections.abc import Iterator

import numpy as np

from planner.detection.evaluation import Evaluation
from planner.detection.prospects import gone_by, left_unseen
from planner.detection.several import find_of, first_and_last
from planner.messages import counted
from planner.network.georeference import grid_convergence_deg, is_georeferenced, lonlat
from planner.page.content import Drawn, page_content
from planner.page.document import document, markup
from planner.page.legend import dots
from planner.page.rows import Row
from planner.page.shown import Shown
from planner.page.still import Flown, still
from planner.page.words import UNTITLED, odds, soon_s
from planner.report.formats import length
from planner.report.sentences import hidden_line

NEARLY_ALL = 0.99  # of the finds; the headline has no times between that and the end
APART = (
    "Legs, as a person follows them; the waypoints of exported files (flight.txt) are counted "
    "apart and have other numbers."
)
LIMITS = (
    "The sensor is taken to see everything within its radius. This is research software, not "
    "certified for flight."
)


def page(run: Shown) -> str:
    """Return a run as a page of HTML, the same text for the same run."""
    drawn = Drawn.of(run)
    title = run.opened.scenario.title or UNTITLED
    at_take_off = drawn.targets.positions(run.plan.take_off_s)
    there = np.isfinite(at_take_off[:, 0])
    picture = still(
        drawn.view,
        roads=drawn.roads,
        targets_m=at_take_off[there],
        target=drawn.targets.target[there],
        flights=[
            Flown(track, np.array([row.start_m for row in rows]).reshape(-1, 2))
            for track, rows in zip(run.plan.tracks, run.rows, strict=True)
        ],
        label=markup(f"Map of the search: {title}"),
    )
    soon = soon_s(run.until_s)
    parts = {
        "KIND": "plan",
        "ABOUT": markup(_about(run)),
        "SOON": "minute" if soon == 60.0 else f"{soon / 60:g} minutes",
        "ODDS": _odds(run),
        "STILL": picture,
        "DOTS": dots(run.names),
        "METHODS": _methods(run),
        "LEGS": _legs(run),
        "NOTES": "".join(f"<p>{markup(note)}</p>" for note in _notes(run)),
        "CREDIT": markup(run.opened.network.attribution),
    }
    return document(title=title, data=page_content(run, drawn), parts=parts)


def _about(run: Shown) -> str:
    """Return one line on who searches, from when on."""
    uavs = run.problem.flying
    speeds = sorted({uav.speed_mps for uav in uavs})
    begins = "flies on" if any(uav.in_air for uav in uavs) else "takes off"
    said = [
        f"{counted(len(uavs), 'drone')}, {' and '.join(f'{mps:g}' for mps in speeds)} m/s",
        f"sees {length(run.radius_m)}",
        f"{begins} {run.clock.at(run.plan.take_off_s)}",
    ]
    if run.clock.sighted_at is not None:
        said.insert(0, f"last seen {run.clock.at(0.0)}")
    longest_s = max(uav.max_flight_time_s for uav in uavs)
    if np.isfinite(longest_s):
        said.append(f"flies {longest_s / 60:.3g} min at most")
    if run.sought > 1:
        said.append(f"{run.sought} targets, odds of one on average")
    return " · ".join(said)


def _odds(run: Shown) -> str:
    """Return the headline: the odds of having found the target by some times, and at the end."""
    times_s = run.clock.round_times_s(run.plan.take_off_s, _settled_s(run.evaluated))
    by_s = run.evaluated.objective.by_s
    if by_s is not None:
        times_s.append(by_s)
    moments = {run.clock.short(time_s): time_s for time_s in [*times_s, run.until_s]}
    rows = sorted((time_s, said) for said, time_s in moments.items())
    return "".join(_one_odds(run, time_s, said, is_goal=time_s == by_s) for time_s, said in rows)


def _settled_s(evaluation: Evaluation) -> float:
    """Return by when nearly all is found that is found at all, seconds; 0 if nothing is."""
    times_s, probability = evaluation.curve()
    if not len(times_s):
        return 0.0
    return float(times_s[np.searchsorted(probability, NEARLY_ALL * probability[-1])])


def _one_odds(run: Shown, time_s: float, said: str, *, is_goal: bool) -> str:
    share = markup(odds(run.evaluated.found_by_probability(time_s) / run.sought))
    word = "deadline " if is_goal else "by "
    return f"<li><b>{share}</b> <span>{word}{markup(said)}</span></li>"


def _methods(run: Shown) -> str:
    """Return the rows of the table of flights: found by the end, and the mean time of finding."""
    rows = []
    for number, (name, one) in enumerate(run.curves.items()):
        found = one.found_by_probability(run.until_s) / run.sought
        mean_s = one.expected_detection_time_s / run.sought
        label, look = (f"this plan ({name})" if number == 0 else name), f"c{number}"
        if number == len(run.curves) - 1:
            look = "limit"
        rows.append(
            f'<tr><th scope="row"><svg class="line {look}" viewBox="0 0 30 8" aria-hidden="true">'
            f'<path d="M0 4h30"/></svg>{markup(label)}</th><td>{markup(odds(found))}</td>'
            f"<td>{mean_s / 60:,.1f} min</td></tr>"
        )
    return "".join(rows)


def _legs(run: Shown) -> str:
    """Return a table of legs for each UAV."""
    tables = []
    for called, rows in zip(run.plan.names, run.rows, strict=True):
        name = "Flight" if len(run.rows) == 1 else called.replace("UAV", "Flight of drone", 1)
        head = "".join(f'<th scope="col">{cell}</th>' for cell in _head(run))
        body = "".join(_leg(run, order, row) for order, row in enumerate(rows, 1))
        tables.append(
            f'<table class="legs"><caption>{name}<small>{APART}</small></caption>'
            f"<thead><tr>{head}</tr></thead>"
            f"<tbody>{body}</tbody></table>"
        )
    return "".join(tables)


def _head(run: Shown) -> list[str]:
    place = "lat, lon" if is_georeferenced(run.opened.network) else "x, y (m)"
    return ["#", "leg", "from, to", place]


def _leg(run: Shown, order: int, row: Row) -> str:
    far = length(row.length_m) if row.length_m else ""
    how = " · ".join(filter(None, [_course(run, row), far]))
    times = f"{run.clock.at(row.start_s)}\n{run.clock.at(row.end_s)}"
    return (
        f"<tr><td>{order}</td><td>{markup(row.name)}<small>{how}</small></td><td>{times}</td>"
        f"<td>{_place(run, row)}</td></tr>"
    )


def _course(run: Shown, row: Row) -> str:
    """Return the true course of a straight leg; that of the net where nobody knows true north."""
    if row.bearing_deg is None:
        return ""
    network, bearing_deg = run.opened.network, row.bearing_deg
    if is_georeferenced(network):
        bearing_deg += float(grid_convergence_deg(network, row.start_m))
    return f"{round(bearing_deg) % 360:03d}°"


def _place(run: Shown, row: Row) -> str:
    if not is_georeferenced(run.opened.network):
        x_m, y_m = row.start_m.tolist()
        return f"{x_m:.0f},\n{y_m:.0f}"
    lon_deg, lat_deg = lonlat(run.opened.network, row.start_m).tolist()
    return f"{lat_deg:.5f},\n{lon_deg:.5f}"


def _notes(run: Shown) -> Iterator[str]:
    """Yield what the figures rest on."""
    evaluated, until = run.evaluated, run.clock.short(run.until_s)
    low, high = (share / run.sought for share in evaluated.found_interval)
    found = evaluated.detection_probability / run.sought
    yield (
        f"Odds count {counted(len(evaluated.weight), 'possible target')} that had no part in "
        f"making the plan. Found by {until}: {odds(found)} "
        f"(95 %: {low * 100:.0f} .. {high * 100:.0f} %)."
    )
    yield from _several(run)
    hidden = hidden_line(run.opened.scenario.hidden)
    if hidden:
        yield hidden[0].upper() + hidden[1:] + "."
    left = left_unseen(run.fresh, evaluated, run.until_s)
    if left > 0.0:
        gone, left = gone_by(run.fresh, run.until_s) / run.sought, left / run.sought
        yield f"Off the map by {until}: {odds(gone)}, of which not seen before: {odds(left)}."
    yield LIMITS


def _several(run: Shown) -> Iterator[str]:
    """Yield what is to be known where several targets are searched for."""
    if run.sought == 1:
        return
    yield f"There are {run.sought} targets: odds and times above are of one of them, on average."
    first, last = first_and_last(run.evaluated)
    each = [(run.names[number], find_of(one)) for number, one in run.evaluated.each.items()]
    for name, find in (*each, ("Any of them", first), ("All of them", last)):
        yield f"{name}: found {odds(find.probability)}, in {find.expected_s / 60:,.1f} min."
