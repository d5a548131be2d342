"""What an aircraft flies of a line: as far as its battery lasts, and the way home."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.export.line import Line
from planner.flight.as_flown import Battery, home_in_time
from planner.flight.law import FlightLaw


class Way(NamedTuple):
    """What is flown of a line."""

    xy_m: Floats  # (W, 2) metres
    hold_s: Floats  # (W,) seconds
    streets: tuple[str, ...]  # W - 1

    @classmethod
    def all_of(cls, line: Line) -> "Way":
        """Return a line as it is."""
        return cls(line.xy_m, line.hold_s, line.streets)

    def is_all_of(self, line: Line) -> bool:
        """Return whether nothing of a line is left out."""
        many = len(line.xy_m)
        if not np.array_equal(self.xy_m[:many], line.xy_m):
            return False
        return bool(np.all(self.hold_s[:many] >= line.hold_s))

    @property
    def legs(self) -> list[tuple[int, int]]:
        """Its legs, from place to place: one ends where it rests, or leaves its street."""
        last = len(self.xy_m) - 1
        ends = [
            k
            for k in range(1, last + 1)
            if k == last or self.hold_s[k] > 0.0 or self.streets[k - 1] != self.streets[k]
        ]
        return [*zip([0, *ends[:-1]], ends, strict=True)]

    def in_time(self, law: FlightLaw, battery: Battery) -> "Way":
        """Return it as far as the battery lasts, and the way home."""
        xy_m, hold_s = home_in_time(self.xy_m, self.hold_s, law, battery)
        same = np.all(xy_m[: len(self.xy_m)] == self.xy_m[: len(xy_m)], axis=1)
        turns = len(same) - 1 if same.all() else int(np.argmin(same))  # the last place before home
        x_m, y_m = xy_m[turns - 1].tolist()
        if np.array_equal(xy_m[turns:], battery.way_home((x_m, y_m))):
            turns -= 1
        streets = self.streets[:turns]
        streets = (*streets, *[""] * (len(xy_m) - 1 - len(streets)))
        return Way(xy_m, hold_s, streets)

    def rounded(self, digits: int) -> "Way":
        """Return it with few digits of its hovering; what is rounded is made up for at the next."""
        held, wanted, found = 0.0, 0.0, []
        for one in self.hold_s.tolist():
            wanted += one
            found.append(max(0.0, round(wanted - held, digits)) if one > 0.0 else 0.0)
            held += found[-1]
        return self._replace(hold_s=np.array(found))
