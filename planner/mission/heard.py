"""What pieces of news mean for a mission: for the target, and for who searches."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from planner.mission.standing import OfUav, Standing
from planner.scenario.news import News


@dataclass(frozen=True)
class Heard:
    """What a piece of news means."""

    news: tuple[News, ...] = ()  # of the target
    standing: Mapping[str, Any] = field(default_factory=dict)  # of UAVs, as `Standing` has it
    same_source: bool = False  # whether a report is from who gave the last one
    insist: bool = False  # whether a report counts that hardly can be true
    said: tuple[str, ...] = ()  # how it was understood

    def then(self, other: "Heard") -> "Heard":
        """Return both together."""
        return Heard(
            (*self.news, *other.news),
            _together(self.standing, other.standing),
            self.same_source or other.same_source,
            self.insist or other.insist,
            (*self.said, *other.said),
        )

    def standing_at(self, at_s: float) -> Standing:
        """Return where the UAVs are at a time."""
        named = {uav: OfUav(**said) for uav, said in self.standing.get("uavs", {}).items()}
        return Standing(at_s, **{**self.standing, "uavs": named})


def _together(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """Return what two pieces of news say of UAVs: delays add up, and the later place counts."""
    found = {**one, **other}
    for key in {*one} & {*other}:
        if key == "uavs":
            both = {*one[key], *other[key]}
            found[key] = {
                uav: _together(one[key].get(uav, {}), other[key].get(uav, {})) for uav in both
            }
        elif key in ("late_s", "joined"):
            found[key] = one[key] + other[key]
    return found
