"""What a recorded flight was worth: a table beside its plan, and how the recording was read."""

from collections.abc import Callable, Iterator, Sequence
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.export.about import BY_S
from planner.messages import counted, percent
from planner.mission.debrief import Debrief
from planner.mission.plan_file import figures
from planner.report.formats import Column, FittingTable
from planner.telemetry.flown import Flown


class Apart(NamedTuple):
    """How much more one flight has of something than another, with its 95 % interval."""

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, flown: Evaluation, one: Floats, other: Floats) -> "Apart":
        """Return it from what two flights make of each target of an evaluation, (N,), paired."""
        if flown.weight.sum() <= 0.0:
            return cls(0.0, 0.0, 0.0)
        mean, half = float(flown.weight @ (one - other)), flown.half_width(one - other)
        return cls(mean, mean - half, mean + half)


class _Row(NamedTuple):
    """One figure of both flights."""

    name: str
    by_s: float | None  # of what is found by a time
    planned: float
    flown: float
    ci95: tuple[float, float]  # of what was flown
    apart: Apart  # flown minus planned


def _rows(found: Debrief) -> Iterator[_Row]:
    planned, flown = found.planned, found.flown.evaluation
    yield _Row(
        "expected time",
        None,
        planned.expected_detection_time_s,
        flown.expected_detection_time_s,
        flown.ci95_s,
        Apart.of(flown, flown.time_s, planned.time_s),
    )
    horizon_s, by_s = flown.objective.horizon_s, flown.objective.by_s or inf
    for time_s in sorted({*(s for s in (*BY_S, by_s) if s < horizon_s), horizon_s}):
        one, other = (_found_by(evaluation, time_s) for evaluation in (flown, planned))
        yield _Row(
            f"by {clock(time_s)}",
            time_s,
            planned.found_by_probability(time_s),
            flown.found_by_probability(time_s),
            flown.found_by_interval(time_s),
            Apart.of(flown, one, other),
        )


def _found_by(evaluation: Evaluation, time_s: float) -> Floats:
    return np.asarray(evaluation.found_by(time_s), dtype=np.float64)


def odds_table(found: Debrief) -> FittingTable:
    """Return what the plan and the flight achieve on the same targets, side by side."""
    table = FittingTable(
        f"found of {len(found.planned.weight):,} fresh targets, as planned and as flown",
        (
            Column("", left=True, wraps=True),
            Column("planned"),
            Column("flown"),
            Column("95 %\ninterval"),
            Column("flown minus\nplanned"),
            Column("95 %\npaired", rank=1),
        ),
    )
    for row in _rows(found):
        shown = _seconds if row.by_s is None else _points
        unit = " s" if row.by_s is None else " %"
        table.add_row(
            row.name,
            shown(row.planned) + unit,
            shown(row.flown) + unit,
            _span(row.ci95, shown),
            shown(row.apart.mean, "+"),
            _span(row.apart[1:], shown, "+"),
        )
    return table


def _seconds(value: float, sign: str = "") -> str:
    return f"{value:{sign}z,.0f}"


def _points(share: float, sign: str = "") -> str:
    return f"{100.0 * share:{sign}z.1f}"


def _span(ends: Sequence[float], shown: Callable[[float, str], str], sign: str = "") -> str:
    return " .. ".join(shown(end, sign) for end in ends) if all(map(isfinite, ends)) else ""


def reading_lines(found: Debrief) -> list[str]:
    """Return how the recording was read: its clock, its heights, its breaks."""
    flight, reading = found.flight, found.flight.reading
    first_s, last_s = float(flight.track.time_s[0]), flight.track.end_s
    lines = [
        f"{flight.points:,} points, from {clock(first_s)} to {clock(last_s)} after the last "
        "sighting",
        f"lift-off: at {clock(flight.lift_off_s)}, planned for {clock(found.planned_lift_off_s)}",
        _clock_line(flight),
        _height_line(flight),
    ]
    if flight.breaks:
        lines.append(
            f"{counted(flight.breaks, 'break')}, {clock(flight.unknown_s)} in all, over which "
            "nobody knows where it was, so that nothing counts as seen: a new segment, a leap, or "
            f"more than {reading.break_s:g} s between points (--break-after)"
        )
    return lines


def _clock_line(flight: Flown) -> str:
    if flight.clock == "takes-off-at":
        return "clock: the lift-off is when --takes-off-at says"
    if flight.clock == "utc":
        assert flight.reading.sighted_at is not None
        seen = flight.reading.sighted_at.isoformat()
        return f"clock: its times of day, from target.sighted_at on ({seen})"
    return "clock: its own seconds, taken as those since the last sighting (--takes-off-at)"


def _height_line(flight: Flown) -> str:
    reading, lasts = flight.reading, clock(flight.sensor_s)
    if flight.heights == "told":
        return (
            f"sensor: counts for {lasts}, from {reading.sensor_from_m:g} m above the lowest point "
            "on (--sensor-from)"
        )
    if flight.heights == "never down":
        return f"sensor: counts for {lasts}; the recording is never on the ground, so all along"
    return (
        f"sensor: counts for {lasts}; there are no heights, so it climbs for "
        f"{clock(reading.law.climb_s)} and comes down for {clock(reading.descend_s)}, as planned"
    )


def still_line(found: Debrief, time_s: float) -> str:
    """Return how likely it is that the target was missed, in words."""
    missed = 1.0 - found.flown.evaluation.found_by_probability(time_s)
    return (
        f"not seen by {clock(time_s)} with a probability of {percent(missed)}; if it was not, it "
        "can still be here:"
    )


def as_dict(found: Debrief) -> dict[str, Any]:
    """Return all of it as plain data."""
    flight, reading = found.flight, found.flight.reading
    return {
        "clock": flight.clock,
        "heights": flight.heights,
        "points": flight.points,
        "lift_off_s": flight.lift_off_s,
        "planned_lift_off_s": found.planned_lift_off_s,
        "begins_s": float(flight.track.time_s[0]),
        "ends_s": flight.track.end_s,
        "sensor_from_m": reading.sensor_from_m,
        "sensor_s": flight.sensor_s,
        "breaks": flight.breaks,
        "unknown_s": flight.unknown_s,
        "targets": len(found.planned.weight),
        "as_planned": figures(found.planned),
        "as_flown": figures(found.flown.evaluation),
        "beside": [
            {
                "figure": "expected_detection_time_s" if row.by_s is None else "found_by",
                "by_s": row.by_s,
                "planned": row.planned,
                "flown": row.flown,
                "flown_ci95": list(row.ci95),
                "flown_minus_planned": row.apart.mean,
                "flown_minus_planned_ci95": [
                    end if isfinite(end) else None for end in row.apart[1:]
                ],
            }
            for row in _rows(found)
        ],
    }
