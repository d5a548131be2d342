"""A recorded flight as its file has it: the same columns of each format."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, freeze
from planner.errors import InputError

LARGEST = 64 << 20  # bytes of a recording: ten hours at ten points a second, and more
FARTHEST = 1e11  # no time and no place of a flight is farther from 0, in seconds or metres
NUMBERS = ("utc_s", "time_s", "lon_deg", "lat_deg", "x_m", "y_m", "height_m", "hold_s")


@dataclass(frozen=True, eq=False)
class TrackLog(Frozen):
    """Points in the file's order, K of them; NaN is what a point does not say."""

    path: Path
    point: str  # what the file calls a point
    number: Ints  # (K,) by which a point is found in the file, as in "line 7"
    begins: Flags  # (K,) True: how the aircraft came there is unknown
    utc_s: Floats  # (K,) seconds since 1970
    time_s: Floats  # (K,) seconds, on a clock of the file's own
    lon_deg: Floats  # (K,) WGS 84
    lat_deg: Floats  # (K,)
    x_m: Floats  # (K,) in the net's plane
    y_m: Floats  # (K,)
    height_m: Floats  # (K,) above whatever the file likes
    hold_s: Floats  # (K,) for how long it stays there
    is_sampled: bool = True  # False: waypoints; it flies straight and evenly to each

    def __post_init__(self) -> None:
        kinds = dict.fromkeys(NUMBERS, np.float64)
        freeze(self, number=np.int64, begins=np.bool_, **kinds)

    def __len__(self) -> int:
        return len(self.number)

    def times(self, *, of_day: bool) -> tuple[Floats, bool]:
        """Return the times of all points, (K,) seconds, and whether they are since 1970.

        Parameters
        ----------
        of_day
            Whether times of day are wanted, where there are both.

        Raises
        ------
        InputError
            If points have neither.
        """
        utc, own = (np.isfinite(column) for column in (self.utc_s, self.time_s))
        if utc.all() and (of_day or not own.all()):
            return self.utc_s, True
        if not own.all():
            known = utc if utc.sum() >= own.sum() else own
            raise InputError(
                f"{self.at(int(np.argmin(known)))}: has no time; give what was recorded, with the "
                "time of each point"
            )
        return self.time_s, False

    def at(self, k: int) -> str:
        """Return how a message begins that is about a point."""
        return f"{self.path}: {self.point} {self.number[k]}"


def log_of(
    path: Path,
    point: str,
    rows: Iterable[Mapping[str, float]],
    *,
    is_sampled: bool = True,
) -> TrackLog:
    """Return the log of points, each of which has some of the columns by name.

    Parameters
    ----------
    rows
        With ``number`` and ``begins``, and what the point says of `NUMBERS`.

    Raises
    ------
    InputError
        If there are fewer than two points, or one has a number that is out of all reach.
    """
    names = ("number", "begins", *NUMBERS)
    table = [[row.get(name, np.nan) for name in names] for row in rows]
    if len(table) < 2:
        raise InputError(
            f"{path}: holds {'one point' if table else 'no points'} of a flight; give the file "
            "that was recorded on it"
        )
    number, begins, *numbers = np.array(table, dtype=np.float64).T
    columns = dict(zip(NUMBERS, numbers, strict=True))
    log = TrackLog(
        path=path,
        point=point,
        number=number.astype(np.int64),
        begins=begins > 0.0,
        is_sampled=is_sampled,
        **columns,
    )
    for name in NUMBERS:
        beyond = np.abs(columns[name]) > FARTHEST
        if beyond.any():
            k = int(np.argmax(beyond))
            raise InputError(
                f"{log.at(k)}: {name} {columns[name][k]:g} is out of reach; correct it, or leave "
                "the point out"
            )
    return log
