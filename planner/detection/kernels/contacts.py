"""Contacts: from when to when a flight has each particle within the radius; compiled, exact."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Offsets
from planner.detection.kernels.closest_approach import (
    FuturesColumns,
    PathColumns,
    Window,
    apart,
    knots_of,
    last_at_or_before,
    motion_at,
    while_within,
)
from planner.jit import compiled


class ContactColumns(NamedTuple):
    """The contacts of N particles, one particle's after the other's; of one flight, by time."""

    first: Offsets  # (N + 1,) where a particle's contacts start
    from_s: Floats  # (M,) seconds on the target's clock
    to_s: Floats  # (M,) seconds; as `from_s` where they touch for a moment only


class Spans(NamedTuple):
    """Spans of time, with room for more."""

    from_s: Floats  # (M,)
    to_s: Floats  # (M,)
    many: int  # how many there are


@compiled
def with_one_more(spans: Spans, span: Window) -> Spans:
    """Return the same spans and another one, in larger columns where these are full."""
    from_s, to_s, many = spans
    if many == len(from_s):
        from_s, to_s = np.empty(2 * many + 16), np.empty(2 * many + 16)
        from_s[:many], to_s[:many] = spans.from_s, spans.to_s
    from_s[many], to_s[many] = span
    return Spans(from_s, to_s, many + 1)


@compiled
def note_contacts(
    flight: PathColumns,
    futures: FuturesColumns,
    particle: int,
    window: Window,
    radius_m: float,
    spans: Spans,
) -> Spans:
    """Return the same spans, and those of a flight's contacts with a particle.

    ``window`` is when the sensor is on; it is off outside the flight.
    """
    knots, i_end = knots_of(futures), len(flight.time_s)
    k, k_end = futures.first_knot[particle], futures.first_knot[particle + 1]
    if k == k_end or i_end == 0:
        return spans
    now_s = max(window.from_s, flight.time_s[0], knots.time_s[k])
    over_s, since = min(window.to_s, flight.time_s[i_end - 1]), spans.many
    if futures.gone[particle]:
        over_s = min(over_s, knots.time_s[k_end - 1])
    if now_s > over_s:
        return spans
    i = last_at_or_before(flight.time_s, 0, i_end, now_s)
    k = last_at_or_before(knots.time_s, k, k_end, now_s)
    while True:
        uav = motion_at(flight, i, i_end, now_s)
        seen = motion_at(knots, k, k_end, now_s)
        until_s = min(over_s, uav.until_s, seen.until_s)
        offset, drift = apart(seen, uav)
        within = while_within(offset, drift, until_s - now_s, radius_m)
        if within.from_s < np.inf:
            stays = within.to_s >= until_s - now_s
            from_s, to_s = now_s + within.from_s, until_s if stays else now_s + within.to_s
            last = spans.many - 1
            if last >= since and spans.to_s[last] >= from_s:  # one contact, in two pieces
                spans.to_s[last] = max(spans.to_s[last], to_s)
            else:
                spans = with_one_more(spans, Window(from_s, max(from_s, to_s)))
        if until_s >= over_s:
            return spans
        i += uav.until_s <= until_s
        k += seen.until_s <= until_s
        now_s = until_s


@compiled
def contacts_of_flight(
    flight: PathColumns, sensor_on: Floats, futures: FuturesColumns, radius_m: float
) -> ContactColumns:
    """Return all contacts of a flight; ``sensor_on`` (S, 2) is from when to when it looks."""
    many = len(futures.gone)
    first = np.zeros(many + 1, dtype=np.int64)
    spans = Spans(np.empty(2 * many + 16), np.empty(2 * many + 16), int(np.int64(0)))
    for particle in range(many):
        for s in range(len(sensor_on)):
            window = Window(sensor_on[s, 0], sensor_on[s, 1])
            spans = note_contacts(flight, futures, particle, window, radius_m, spans)
        first[particle + 1] = spans.many
    from_s, to_s, count = spans
    return ContactColumns(first, from_s[:count].copy(), to_s[:count].copy())
