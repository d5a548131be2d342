"""What became of particles in traffic, beside their motion."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, freeze
from planner.checked import same_length
from planner.futures.riders import DRIVEN_S
from planner.intervals import ratio_of_means
from planner.messages import percent

LATE_S = 1.0  # after its departure, from which on a particle counts as late


@dataclass(frozen=True, eq=False)
class Fates(Frozen):
    """How each of N particles got into the traffic, and what it met there."""

    realisation: Ints  # (N,) of the traffic, in which it rode
    late_s: Floats  # (N,) seconds that it waited for a place; infinity: until the end
    took_over: Ints  # (N,) 1: it is a car that was there, 0: one more car
    teleports: Ints  # (N,) how often SUMO has put it past a jam
    # (N,) metres that it drove within `DRIVEN_S`, and that it drives when no other particle rides
    # beside it; NaN where that was not measured
    driven_m: Floats
    alone_m: Floats

    def __post_init__(self) -> None:
        freeze(
            self,
            realisation=np.int32,
            late_s=np.float64,
            took_over=np.int32,
            teleports=np.int32,
            driven_m=np.float64,
            alone_m=np.float64,
        )
        same_length(**self.columns)

    def __len__(self) -> int:
        return len(self.realisation)

    @property
    def columns(self) -> dict[str, Any]:
        """All columns by their names, (N,) each."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def take(self, particles: Offsets | Flags) -> "Fates":
        """Return those of some particles only, in the order given."""
        return Fates(**{name: column[particles] for name, column in self.columns.items()})

    @classmethod
    def joined(cls, parts: Sequence["Fates | None"]) -> "Fates | None":
        """Return those of several sets of particles; None if they are not known of all."""
        known = [part.columns for part in parts if part is not None]
        if not known or len(known) < len(parts):
            return None
        return cls(**{name: np.concatenate([some[name] for some in known]) for name in known[0]})

    def counts(self) -> dict[str, int]:
        """Return how many particles fared how."""
        return {
            "realisations": len(np.unique(self.realisation)),
            "took_over": int(self.took_over.sum()),
            "entered_late": int(((self.late_s >= LATE_S) & np.isfinite(self.late_s)).sum()),
            "never_entered": int(np.isinf(self.late_s).sum()),
            "teleported": int((self.teleports > 0).sum()),
        }

    def __str__(self) -> str:
        count = self.counts()
        late_s = self.late_s[(self.late_s >= LATE_S) & np.isfinite(self.late_s)]
        mean = f" (by {late_s.mean():.0f} s on average)" if len(late_s) else ""
        return (
            f"{len(self)} particles rode in {count['realisations']} realisations of the traffic: "
            f"{count['took_over']} took over a car that stood there, "
            f"{count['entered_late']} entered late{mean}, "
            f"{count['never_entered']} never entered and stand where they start, "
            f"{count['teleported']} were put past a jam by SUMO"
        )

    def share(self) -> tuple[float, float, int]:
        """Return how far a particle comes among others, as a share, half its interval, and pairs.

        The share is of the way that it comes when no other particle rides beside it: the ratio of
        mean distances, with a 95 % interval over pairs. These are few: the first particle of some
        copies rides once more without the others. NaN where none did.
        """
        some = ~np.isnan(self.alone_m)
        driven_m, alone_m = self.driven_m[some], self.alone_m[some]
        if len(alone_m) == 0 or alone_m.sum() <= 0.0:
            return np.nan, np.nan, 0
        return *ratio_of_means(driven_m, alone_m), len(alone_m)

    def as_json(self) -> dict[str, int | float]:
        """Return how particles fared, and how far they slow each other where that is known."""
        share, half, pairs = self.share()
        known = {"share_of_way_alone": share, "share_measured_on": pairs} if pairs else {}
        return {**self.counts(), **known, **({"share_half_width": half} if pairs > 1 else {})}

    def told_share(self) -> str:
        """Return a sentence on how far particles slow each other; empty if that is not known."""
        share, half, pairs = self.share()
        if pairs == 0:
            return ""
        interval = f" (95 % interval +-{percent(half)})" if np.isfinite(half) else ""
        return (
            f"in the first {DRIVEN_S:.0f} s a particle comes {percent(share)} of the way that it "
            f"comes when no other particle rides beside it{interval}, measured on {pairs}"
        )


COLUMNS = tuple(field.name for field in fields(Fates))
