"""How probably each particle is still unseen at a time, under flights of one UAV or several."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, first_rows, freeze, rows_taken
from planner.checked import number
from planner.detection.first_detection import columns
from planner.detection.kernels.closest_approach import PathColumns
from planner.detection.kernels.contacts import ContactColumns, contacts_of_flight
from planner.detection.kernels.survival import (
    SurvivalColumns,
    each_falls_to,
    each_lasts,
    each_unseen_at,
    found_by,
    survival_of,
)
from planner.detection.sensor import Sensor
from planner.flight.track import Track
from planner.futures.futures import Futures


class Searched(NamedTuple):
    """A flight that searches: where it is when, and what it sees with."""

    track: Track
    sensor: Sensor


@dataclass(frozen=True, eq=False)
class Survival(Frozen):
    """The survival of N particles in pieces of exponential decay; before the first all are unseen.

    Exposures add up, of one flight's contacts as of several flights', so survival is exact
    whatever the flights are cut into.
    """

    first: Offsets  # (N + 1,) where a particle's pieces start
    time_s: Floats  # (M,) seconds on the target's clock, when each piece begins
    survives: Floats  # (M,) probability of being unseen then
    rate_per_s: Floats  # (M,) of detection from then on

    def __post_init__(self) -> None:
        freeze(self, first=np.int64, time_s=np.float64)
        freeze(self, survives=np.float64, rate_per_s=np.float64)

    def __len__(self) -> int:
        return len(self.first) - 1

    def at(self, time_s: Floats | float) -> Floats:
        """Return the probability that each is unseen after a time, its own or one for all, (N,)."""
        moments: Floats = np.array(np.broadcast_to(time_s, len(self)), dtype=np.float64)
        return np.asarray(each_unseen_at(self.columns, moments))

    def lasts_s(self, until_s: Floats | float, particle: Ints | None = None) -> Floats:
        """Return E[min(time seen, until)] of each, or of some in any order, (N,) or (m,) seconds.

        The time is each one's own, or one for all.
        """
        some = np.arange(len(self)) if particle is None else particle
        moments: Floats = np.array(np.broadcast_to(until_s, len(some)), dtype=np.float64)
        return np.asarray(each_lasts(self.columns, some.astype(np.int64), moments))

    def falls_to(self, share: float) -> Floats:
        """Return when each is unseen with no more than a probability, (N,) seconds, inf: never."""
        return np.asarray(each_falls_to(self.columns, float(share)))

    def found_by(self, weight: Floats, times_s: Floats) -> Floats:
        """Return the probability that the target is found by each of rising times, (T,)."""
        times_s = np.array(times_s, dtype=np.float64)
        return np.asarray(found_by(self.columns, np.array(weight, dtype=np.float64), times_s))

    def of_those(self, which: Flags) -> "Survival":
        """Return the survival of some of the particles, (N,)."""
        rows, first = rows_taken(self.first, np.flatnonzero(which))
        return Survival(first, self.time_s[rows], self.survives[rows], self.rate_per_s[rows])

    @property
    def columns(self) -> SurvivalColumns:
        """As compiled code takes it."""
        return SurvivalColumns(self.first, self.time_s, self.survives, self.rate_per_s)


def contacts(futures: Futures, track: Track, radius_m: float) -> ContactColumns:
    """Return from when to when a flight has each particle within the radius; all such spans.

    Exact, in continuous time. A particle's first contact begins when `first_detection` says.

    Raises
    ------
    InputError
        If the radius is no number from 0 on.
    """
    radius_m = number("radius_m", radius_m, least=0.0)
    flight = PathColumns(track.time_s, track.x_m, track.y_m)
    return contacts_of_flight(flight, track.sensor_on, columns(futures), radius_m)


def survival(futures: Futures, searched: Sequence[Searched]) -> Survival:
    """Return how probably each particle stays unseen by flights, which may overlap in time."""
    return Survival(*survival_of(*contacts_of_all(futures, searched)))


def contacts_of_all(
    futures: Futures, searched: Sequence[Searched]
) -> tuple[ContactColumns, Floats]:
    """Return the contacts of several flights by particle and time, and the rate of each."""
    many, none = len(futures), np.empty(0)
    parts = [contacts(futures, flight.track, flight.sensor.radius_m) for flight in searched]
    rates = [
        np.full(len(part.from_s), flight.sensor.rate_per_s)
        for part, flight in zip(parts, searched, strict=True)
    ]
    if len(parts) == 1:
        return parts[0], rates[0]
    from_s, to_s, rate = (
        np.concatenate([none, *columns])
        for columns in ([part.from_s for part in parts], [part.to_s for part in parts], rates)
    )
    particle = [np.repeat(np.arange(many), np.diff(part.first)) for part in parts]
    who = np.concatenate([np.empty(0, dtype=np.int64), *particle])
    order, first = np.lexsort((from_s, who)), first_rows(np.bincount(who, minlength=many))
    return ContactColumns(first, from_s[order], to_s[order]), rate[order]
