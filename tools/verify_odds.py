"""The figures of a plan of any number of flights, from its waypoints and the particles alone.

`planner futures RUN/run.json -o PARTICLES` writes the particles that a run was planned on; nothing
here shares code with what made the plan. Places are complex numbers, x + iy, in metres; times are
seconds.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow.parquet
from verify_asked import Flight, as_asked, flights_of
from verify_files import Array, Fields, RefusedError, read_json
from verify_inputs import Claim

Spans = list[tuple[float, float]]
KEYS = ("particle", "weight", "at_end")
SEVERAL = ("expected_detection_time_s", "found_probability")  # of the first and the last find


class Particle(NamedTuple):
    """A motion: straight from knot to knot, then at rest, or gone."""

    time_s: Array
    place: Array
    weight: float
    is_gone: bool
    target: int  # which of several it is


class Search(NamedTuple):
    """What a plan says of its sensor and its objective."""

    radius_m: float
    rate_per_s: float  # infinity: who is in reach is seen at once
    horizon_s: float
    by_s: float | None


def claims(folder: Path, particles: Path) -> Iterator[Claim]:
    """Yield each figure of a plan on the particles that it was made on beside what is found."""
    run, plan = (read_json(folder, name) for name in ("run.json", "plan.json"))
    planned, flights = plan.part("planned"), flights_of(plan)
    yield from as_asked(run, planned, flights)
    rate_per_s = planned.above_zero("rate_per_s") if "rate_per_s" in planned else math.inf
    by_s = planned.number("found_by_s") if "found_by_s" in planned else None
    search = Search(
        planned.above_zero("radius_m"), rate_per_s, planned.above_zero("horizon_s"), by_s
    )
    known = _particles(particles)
    spans = ([span for one in flights for span in _contacts(each, one, search)] for each in known)
    rows = [(one.weight, *fate(met, search)) for one, met in zip(known, spans, strict=True)]
    weight, lasts_s, unseen, unseen_by = np.array(rows).T
    sought = planned.whole("sought") if "sought" in planned else 1
    missing = max(0.0, sought - float(weight.sum()))  # of the targets, each of which counts alike
    found = {
        "expected_detection_time_s": weight @ lasts_s + missing * search.horizon_s,
        "detection_probability": weight @ (1.0 - unseen),
        "particles": len(known),
    }
    if by_s is not None:
        found["found_by_probability"] = weight @ (1.0 - unseen_by)
    for key, figure in found.items():
        yield _claim(planned, key, float(figure))
    if sought > 1 and "first" in planned and not unchecked(planned):
        moments_s = np.where(unseen > 0.0, math.inf, lasts_s)
        each = [
            (moments_s[mine], weight[mine])
            for target in sorted({one.target for one in known if one.weight > 0.0})
            if len(mine := np.array([k for k, one in enumerate(known) if one.target == target]))
        ]
        for name, figures in zip(("first", "last"), _of_several(each, sought, search), strict=True):
            part = planned.part(name)
            for key, figure in zip(SEVERAL, figures, strict=True):
                yield _claim(part, key, figure, f"{name}: ")


def unchecked(planned: Fields) -> dict[str, Any]:
    """Return the figures of a plan that are taken as given: of several, where some are missed."""
    names = ("first", "last") if "rate_per_s" in planned else ()
    return {name: planned.any(name) for name in names if name in planned}


def _claim(part: Fields, key: str, figure: float, of: str = "") -> Claim:
    claimed = part.number(key)
    return Claim(of + key, claimed, figure, abs(claimed - figure) / max(1.0, figure))


def _of_several(
    each: list[tuple[Array, Array]], sought: int, search: Search
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return E[min(time, horizon)] of the first and of the last find, and how probable they are.

    A perfect sensor finds each target at moments of its particles, and whether one is found says
    nothing of the others: between two moments the probabilities stand still, and multiply.

    Parameters
    ----------
    each
        Of each target when its particles are seen, infinity: never; and what they weigh.
    """
    horizon_s = search.horizon_s
    seen_s = np.concatenate([moments_s for moments_s, _ in each])
    edges_s = np.unique([0.0, horizon_s, *seen_s[seen_s < horizon_s]])
    is_found = [[weight[at_s <= t].sum() for t in edges_s[:-1]] for at_s, weight in each]
    found, lasts_s = np.array(is_found), np.diff(edges_s)
    by_s = horizon_s if search.by_s is None else search.by_s
    by = np.array([weight[at_s <= by_s].sum() for at_s, weight in each])
    all_there = float(len(each) == sought)  # else one of them is never found
    first_s = float(lasts_s @ (1.0 - found).prod(axis=0))
    last_s = horizon_s - all_there * float(lasts_s @ found.prod(axis=0))
    return (first_s, 1.0 - float((1.0 - by).prod())), (last_s, all_there * float(by.prod()))


def fate(spans: Spans, search: Search) -> tuple[float, float, float]:
    """Return E[min(time seen, horizon)] of a particle, and how probably it is unseen by when.

    That is by the horizon, and by the deadline if there is one.

    Parameters
    ----------
    spans
        From when to when a flight has it in reach, before the horizon; of several flights all.
    """
    horizon_s, by_s = search.horizon_s, search.by_s or search.horizon_s
    if math.isinf(search.rate_per_s):
        seen_s = min((span[0] for span in spans), default=math.inf)
        return min(seen_s, horizon_s), float(seen_s > horizon_s), float(seen_s > by_s)
    moments = sorted({0.0, horizon_s, by_s, *(t for span in spans for t in span)})
    survives, lasts_s, at = 1.0, 0.0, {0.0: 1.0}
    for begin_s, end_s in pairwise(moments):
        watched = sum(a <= begin_s and end_s <= b for a, b in spans)  # by so many at once
        rate = watched * search.rate_per_s
        after = survives * math.exp(-rate * (end_s - begin_s))
        if end_s <= horizon_s:
            lasts_s += (survives - after) / rate if rate else survives * (end_s - begin_s)
        survives = at[end_s] = after
    return lasts_s, at[horizon_s], at[by_s]


def _contacts(particle: Particle, flight: Flight, search: Search) -> Iterator[tuple[float, float]]:
    """Yield from when to when a particle is in reach while the sensor is on, before the horizon."""
    if not len(particle.time_s):
        return
    first_s = max(particle.time_s[0], flight.time_s[0])
    last_s = particle.time_s[-1] if particle.is_gone else math.inf
    last_s = min(last_s, flight.time_s[-1], search.horizon_s)
    for on_s, off_s in flight.on_s:
        begin_s, end_s = max(first_s, on_s), min(last_s, off_s)
        if begin_s > end_s:
            continue
        bends = np.concatenate([particle.time_s, flight.time_s])
        inner = bends[(bends > begin_s) & (bends < end_s)]
        time_s = np.unique(np.concatenate([[begin_s, end_s], inner]))
        offset = np.interp(time_s, particle.time_s, particle.place)
        offset = offset - np.interp(time_s, flight.time_s, flight.place)
        yield from _within(time_s, offset, search.radius_m)


def _within(time_s: Array, offset: Array, radius_m: float) -> Iterator[tuple[float, float]]:
    """Yield from when to when an offset that changes evenly between times is short enough."""
    if len(time_s) == 1:
        if abs(offset[0]) <= radius_m:
            yield time_s[0], time_s[0]
        return
    for a, b, here, there in zip(time_s, time_s[1:], offset, offset[1:], strict=False):
        drift = (there - here) / (b - a)
        speed2 = abs(drift) ** 2
        nearest = -(here * np.conj(drift)).real  # times speed2: after which it is nearest
        outside = abs(here) ** 2 - radius_m**2
        if speed2 == 0.0:
            if outside <= 0.0:
                yield a, b
            continue
        square = nearest**2 - speed2 * outside
        if square < 0.0:
            continue
        # The one root as it is, the other by the product of both: nothing cancels.
        large = nearest + math.copysign(math.sqrt(square), nearest)
        roots = sorted((large / speed2, outside / large if large else 0.0))
        from_s, to_s = max(a, a + roots[0]), min(b, a + roots[1])
        if from_s <= to_s:
            yield from_s, to_s


def _particles(folder: Path) -> list[Particle]:
    """Return the particles in a folder that `planner futures` has written."""
    try:
        knots: Any = pyarrow.parquet.read_table(folder / "futures.parquet").to_pydict()
        said: Any = pyarrow.parquet.read_table(folder / "particles.parquet").to_pydict()
    except (OSError, pyarrow.ArrowException) as error:
        raise RefusedError(f"{folder}: {error}") from error
    names = np.array(knots["particle"])
    time_s, place = np.array(knots["time_s"]), np.array(knots["x_m"]) + 1j * np.array(knots["y_m"])
    found = []
    targets = said.get("target", [0] * len(said["particle"]))  # tables for one do not name it
    for name, weight, end, target in zip(*(said[key] for key in KEYS), targets, strict=True):
        mine = np.flatnonzero(names == name)
        is_gone = end == "gone"
        found.append(Particle(time_s[mine], place[mine], float(weight), is_gone, int(target)))
    return found
