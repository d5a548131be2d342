"""How far the kinematic clock is from what SUMO recorded of the same particles."""

from dataclasses import asdict, dataclass

import numpy as np

from planner.arrays import Floats
from planner.errors import InputError
from planner.futures.futures import Futures

AT_S = (180.0, 300.0)  # when distances are told
RUNNING_S = 5.0  # who is on the way so shortly before the end has not arrived


@dataclass(frozen=True)
class ClockError:
    """How far a clock is from recordings of the same particles.

    NaN where no particle tells it.
    """

    particles: int
    at_180_s_m: float  # median distance at 180 s, metres
    at_300_s_m: float
    arrived: int  # particles that reach their route's end in both
    arrival_ratio: float  # median of the recorded time of arrival over the clock's

    def as_json(self) -> dict[str, float | None]:
        """Return the fields; None for NaN."""
        values: dict[str, float] = asdict(self)
        return {name: value if np.isfinite(value) else None for name, value in values.items()}

    def __str__(self) -> str:
        """Return it in a sentence."""
        offs = zip(AT_S, (self.at_180_s_m, self.at_300_s_m), strict=True)
        far = [f"{off_m:.0f} m off at {at_s:.0f} s" for at_s, off_m in offs if np.isfinite(off_m)]
        said = [f"{' and '.join(far)} (medians)"] if far else []
        if self.arrived:
            said.append(f"SUMO takes {self.arrival_ratio:.3f} times as long to arrive")
        if not said:
            return "the kinematic clock (a guess) cannot be compared: nobody drives for long enough"
        return f"the kinematic clock (a guess): {'; '.join(said)}"


def clock_error(clock: Futures, recorded: Futures) -> ClockError:
    """Return how far a clock is from what was recorded.

    Parameters
    ----------
    clock, recorded
        Futures of the same particles, in the same order, up to the same horizon.

    Raises
    ------
    InputError
        If they are of different numbers of particles.
    """
    if len(clock) != len(recorded):
        raise InputError(
            f"clock, recorded: have {len(clock)} and {len(recorded)} particles; give the same ones"
        )
    until_s = min(_last_s(clock), _last_s(recorded)) - RUNNING_S
    both = (clock.end_s < until_s) & (recorded.end_s < until_s)
    both &= (_begin_s(clock) < clock.end_s) & (_begin_s(recorded) < recorded.end_s)
    ratios = recorded.end_s[both] / clock.end_s[both]
    return ClockError(
        particles=len(clock),
        at_180_s_m=_median(distances(clock, recorded, AT_S[0])),
        at_300_s_m=_median(distances(clock, recorded, AT_S[1])),
        arrived=int(both.sum()),
        arrival_ratio=_median(ratios),
    )


def distances(a: Futures, b: Futures, at_s: float) -> Floats:
    """Return how far apart particles are at a time, (k,) metres, of those that are there in both.

    Nobody is compared after the end of what was recorded.
    """
    if at_s > min(_last_s(a), _last_s(b)):
        return np.zeros(0)
    away_m = np.linalg.norm(a.positions(at_s) - b.positions(at_s), axis=1)
    return np.asarray(away_m[np.isfinite(away_m)])


def _last_s(futures: Futures) -> float:
    return float(futures.end_s.max(initial=-np.inf))


def _begin_s(futures: Futures) -> Floats:
    """Time of each particle's first knot, (N,) seconds; inf for one without knots."""
    begins = np.full(len(futures), np.inf)
    some = np.diff(futures.first_knot) > 0
    begins[some] = futures.time_s[futures.first_knot[:-1][some]]
    return begins


def _median(values: Floats) -> float:
    return float(np.median(values)) if len(values) else float("nan")
