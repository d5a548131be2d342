"""What is told of a plan that a real aircraft flies: which one, how it turns, what timing costs."""

from collections.abc import Iterator, Sequence

import numpy as np

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.detection.mistimed import Mistimed, Timing
from planner.flight.plan import Plan
from planner.flight.track import SHARP_DEG
from planner.messages import counted, percent
from planner.report.formats import Column, FittingTable
from planner.report.tables import Fresh
from planner.scenario.aircraft_file import TESTED, shipped_aircraft
from planner.scenario.uav import IDEAL, UavSection


def aircraft_line(uav: UavSection) -> str:
    """Return how a real aircraft flies, in words, and how to say that another one does."""
    name = "" if uav.aircraft in (None, IDEAL) else f"{uav.aircraft}, "
    untested = "untested, " * (uav.aircraft in set(shipped_aircraft()) - {TESTED})
    others = ", ".join(one for one in (*shipped_aircraft(), IDEAL) if one != uav.aircraft)
    return (
        f"aircraft: {name}{untested}{', '.join(_figures(uav))}; for another one --set "
        f"uav.aircraft=NAME: {others}, or a file"
    )


def _figures(uav: UavSection) -> Iterator[str]:
    yield f"{uav.speed_mps:g} m/s"
    if not uav.can_hover:
        yield f"at least {uav.min_speed_mps:g} m/s: it circles and does not hover"
    if uav.acceleration_mps2 is not None:
        yield f"{uav.acceleration_mps2:g} m/s2, corners within {uav.corner_m:g} m"
    if uav.climb_mps is not None:
        yield f"up to {uav.altitude_m:g} m at {uav.climb_mps:g} m/s"
    if uav.descend_mps is not None:
        yield f"down at {uav.descend_mps:g} m/s"
    if uav.max_flight_time_s is not None:
        yield f"in the air for {clock(uav.max_flight_time_s)} with {clock(uav.kept_s)} in reserve"
    if uav.wind is not None:
        yield f"wind {uav.wind.speed_mps:g} m/s from {uav.wind.from_deg:g} degrees"
    if uav.link_m is not None:
        yield f"within {uav.link_m:g} m of its start"


def corners_line(plan: Plan) -> str:
    """Return how often a flight turns, in words."""
    many = sum(track.corners for track in plan.tracks)
    return f"the flight has {counted(many, 'corner')} (turns of more than {SHARP_DEG:g} degrees)"


def timing_table(planned: Evaluation, others: Sequence[Mistimed], fresh: Fresh) -> FittingTable:
    """Return what a plan is worth on the same targets if it is flown at other times."""
    by_s = planned.objective.by_s
    table = FittingTable(
        f"what timing costs ({len(planned.weight):,} {fresh.name})",
        (
            Column("flown", left=True),
            Column("expected\ndetection"),
            Column("against\nthe plan", rank=1),
            Column("95 % of that\n(+: later)", rank=2),
            *([] if by_s is None else [Column(f"found by\n{clock(by_s)}")]),
            Column("found"),
        ),
    )
    for name, one in [("as planned", planned), *((_name(o.timing), o.evaluated) for o in others)]:
        cells = [f"{one.expected_detection_time_s:,.0f} s", "", ""]
        if one is not planned:
            cells[1:] = _later(one, planned)
        if by_s is not None:
            cells.append(percent(one.found_by_probability(by_s)))
        table.add_row(name, *cells, percent(one.detection_probability))
    return table


def _name(timing: Timing) -> str:
    if timing.late_s:
        return f"{timing.late_s:g} s late"
    return f"in {timing.pace:g} of its time"


def _later(one: Evaluation, planned: Evaluation) -> tuple[str, str]:
    """Return by how much later targets are found, and the paired interval of that, seconds."""
    later_s = one.expected_detection_time_s - planned.expected_detection_time_s
    half_s = one.half_width(one.time_s - planned.time_s)
    said = f"{abs(later_s):,.0f} s {'later' if round(later_s) >= 0 else 'sooner'}"
    if not np.isfinite(half_s):
        return said, ""
    return said, f"{later_s - half_s:+z,.0f} .. {later_s + half_s:+z,.0f} s"
