"""The choices that the paper's pseudo-code leaves open; of each, the first is the default."""

from dataclasses import dataclass
from typing import Literal, get_type_hints

from planner.checked import choice, number, set_fields
from planner.search.problem import Directions


@dataclass(frozen=True)
class GreedyOptions:
    """How the printed pseudo-code is interpreted.

    Attributes
    ----------
    particles
        "once": sampled before the first step, all steps share one recorded future. "anew":
        sampled at every step, as line 4 of Figure 4 stands; what was seen stays with the index k.
    flags
        "copied": ``observed`` goes to all simulations together with ``observation_times``.
        "times only": lines 29-31 of Figure 6 as printed. A simulation then never looks again for
        a particle that it once saw on a flight never flown; and as ``roads`` shrinks (line 13 of
        Figure 4), simulation i is not the same road from step to step.
    miss
        What a particle not seen adds to the sum in line 28: "horizon": the horizon, as for one
        seen later; "infinity": more than all else, so that most newly seen comes first and time
        decides ties. "rate": not the sum, but what a leg takes off it per second of flight.
        Where the objective is to find the target by a deadline, sightings by then count instead
        of times, and only these are newly seen.
    direction
        Each road flown in its "own" direction, in "both", or from its "nearest end".
    roads
        A road once flown is "removed" (line 13 of Figure 4), or may be "revisited".
    ends
        The path ends at its "depth", or with "all found" once all its own particles are seen.
    tick_s
        0: detection in continuous time. Else the test of line 17 runs at the first, second, ...
        tick of each flight only, with distance <= radius (printed: <), and a sighting is timed
        at its own tick (the printed counter stands one lower, as it rises after the test).
    ties
        Between equally good legs the one of "lowest index" is flown, or that of "earliest end".
    """

    particles: Literal["once", "anew"] = "once"
    flags: Literal["copied", "times only"] = "copied"
    miss: Literal["horizon", "infinity", "rate"] = "horizon"
    direction: Directions = "own"
    roads: Literal["removed", "revisited"] = "removed"
    ends: Literal["depth", "all found"] = "depth"
    tick_s: float = 0.0
    ties: Literal["lowest index", "earliest end"] = "lowest index"

    def __post_init__(self) -> None:
        set_fields(self, {"tick_s": number("greedy.tick_s", self.tick_s, least=0.0)})
        for name, kind in get_type_hints(type(self)).items():
            if name != "tick_s":
                choice(f"greedy.{name}", getattr(self, name), kind)
