"""A scenario with its network open: all that a search starts from, or every fault at once."""

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.belief.caution import cautious
from planner.belief.distribution import distribution
from planner.belief.mixture import Belief, Mixture, OneBelief, Several
from planner.belief.prior import Known, prior_of
from planner.errors import Fault, InputError, PlannerError, ScenarioError
from planner.flight.airspace import Airspace
from planner.flight.ways import Point
from planner.futures.traffic import NO_PERMIT, Permit, Traffic
from planner.messages import as_written
from planner.mission.areas import airspace_of
from planner.mission.known_target import known_target, told_once
from planner.mission.known_turns import LEAVES, known_turns
from planner.mission.news import news_faults
from planner.mission.traffic import traffic_of
from planner.mission.uav_airspace import airspace_for
from planner.mission.uav_places import return_xy, start_xy
from planner.network.read import open_network, source_files
from planner.network.road_network import RoadNetwork
from planner.network.roads import with_roads
from planner.network.street_names import no_edge
from planner.scenario.checks import faults_of_fields
from planner.scenario.draft import Draft, read_draft
from planner.scenario.listed import named_for
from planner.scenario.news import FoundNews, News
from planner.scenario.sections import NetworkSection, Scenario
from planner.scenario.target import TargetSection

log = logging.getLogger(__name__)

PART_OF_RADIUS = 1 / 3  # of the sensor's: what is as near is one road to it
TOLERANCE_M = 0.01  # lengths in net files have two decimals


@dataclass(frozen=True, eq=False)
class OpenScenario:
    """A sound scenario, its network and what is known of the target on it."""

    scenario: Scenario
    network: RoadNetwork
    prior: Belief  # what the planners know
    truth_prior: Belief  # what the true targets are drawn from
    airspace: Airspace | None = None  # where the UAV may fly; None: anywhere
    traffic: Traffic | None = None  # in which targets may drive; None: nothing is said of any
    notes: tuple[str, ...] = ()  # what of the target's files counts otherwise than it may seem
    other_airspaces: tuple[Airspace | None, ...] = ()  # of the UAVs beside the first

    @property
    def airspaces(self) -> tuple[Airspace | None, ...]:
        """Where each UAV may fly; None: anywhere."""
        return (self.airspace, *self.other_airspaces)

    @property
    def news(self) -> tuple[News, ...]:
        """What is known of the target beyond the priors."""
        return self.scenario.news.heard or ()

    @property
    def sought(self) -> int:
        """How many targets are searched for: all but those that news says are found."""
        found = {one.target for one in self.news if isinstance(one, FoundNews)}
        return max(1, len(self.scenario.targets) - len(found))

    @property
    def starts_m(self) -> tuple[Point, ...]:
        """Where each UAV takes off, metres east and north."""
        return tuple(start_xy(uav.start, self.network) for uav in self.scenario.uavs)

    @property
    def landings_m(self) -> tuple[Point | None, ...]:
        """Where each UAV has to land, metres east and north; None: anywhere."""
        return tuple(return_xy(uav, self.network) for uav in self.scenario.uavs)


def open_scenario(
    place: str | Path,
    *,
    preset: str | None = None,
    overrides: Sequence[str] = (),
    permit: Permit = NO_PERMIT,
) -> OpenScenario:
    """Return a scenario with its network and priors.

    Parameters
    ----------
    place, preset, overrides
        As `planner.scenario.draft.read_draft` takes them.
    permit
        What the traffic's files and its control may be.

    Raises
    ------
    InputError
        If there is no such scenario, or its network cannot be opened.
    ScenarioError
        With all faults, those that only the network shows too.
    """
    draft = read_draft(place, preset=preset, overrides=overrides)
    faults = list(draft.faults)
    network = _network(draft, faults)
    known: dict[str, Known] = {}
    notes: list[str] = []
    if network is not None:
        for key, target, names, known_as in _targets(draft):
            found: list[Fault] = []
            if known_as is not None:
                known |= {
                    name.replace(known_as, key, 1): k
                    for name, k in known.items()
                    if name == known_as or name.startswith(f"{known_as}.")
                }
                continue
            for part_key, part in target.parts(key):
                known[part_key], wrong = _known(part_key, part, network, draft, notes)
                found += wrong
            faults += told_once(faults_of_fields(found, key, names))
        airspaces = _airspaces(draft, network, faults)
        traffic = _traffic(draft, network, faults, permit)
        faults += news_faults((draft.news and draft.news.heard) or (), network, len(draft.targets))
    if faults or network is None:
        raise ScenarioError(str(draft.path), faults)
    scenario = draft.scenario(in_town=not network.is_abstract)
    _note_wide_roads(network, scenario.sensor.radius_m)
    return OpenScenario(
        scenario=scenario,
        network=network,
        prior=_all(
            cautious(_belief(key, target, network, known), target.caution or 0.0, network)
            for key, target in draft.targets
        ),
        truth_prior=_all(_belief(key, truth, network, known) for key, truth in draft.truths),
        airspace=airspaces[0],
        traffic=traffic,
        notes=tuple(dict.fromkeys(notes)),
        other_airspaces=airspaces[1:],
    )


def _airspaces(
    draft: Draft, network: RoadNetwork, faults: list[Fault]
) -> tuple[Airspace | None, ...]:
    """Return where each UAV may fly, None for anywhere; adds what is wrong with their places."""
    found: list[Airspace | None] = []
    for key, uav in draft.uavs:
        sound = not any(one.is_about(f"{key}.") for one in faults)
        airspace, told = airspace_for(uav, draft, network, sound=sound)
        found.append(airspace)
        # what is wrong with the areas is so for all, and told once
        faults += [one for one in named_for(key, told) if one not in faults]
    if not found:
        airspace, told = airspace_of(draft.airspace, draft.folder, network, None)
        faults += told
        found.append(airspace)
    return tuple(found)


def _traffic(
    draft: Draft, network: RoadNetwork, faults: list[Fault], permit: Permit
) -> Traffic | None:
    """Return the traffic; adds what is wrong with its files."""
    if any(fault.is_about("traffic") for fault in faults):
        return None
    try:
        return traffic_of(draft, network, permit)
    except InputError as error:
        faults.append(Fault("traffic", str(error).removeprefix(f"{draft.path}: ")))
        return None


def _known(
    key: str, target: TargetSection, network: RoadNetwork, draft: Draft, notes: list[str]
) -> tuple[Known, list[Fault]]:
    turns, found = known_turns(key, target, network, draft, note=notes.append)
    found += _start_faults(key, target, network)
    if not _stands_in(target, draft.faults):
        found += _distance_faults(key, target, network)
    known, more = known_target(key, target, network, draft.folder)
    return known._replace(turns=turns), [*found, *more]


def _belief(
    key: str, target: TargetSection, network: RoadNetwork, known: Mapping[str, Known]
) -> OneBelief:
    priors = [prior_of(part, network, known[name]) for name, part in target.parts(key)]
    if target.mix is None:
        return priors[0]
    weight = np.array([part.weight for part in target.mix])
    return Mixture(weight / weight.sum(), tuple(priors))


def _all(beliefs: Iterable[OneBelief]) -> Belief:
    """Return the belief of all targets: that of one is its own."""
    targets = tuple(beliefs)
    return targets[0] if len(targets) == 1 else Several(targets)


def _targets(draft: Draft) -> Iterator[tuple[str, TargetSection, frozenset[str], str | None]]:
    """Yield what is known and what is true of each target, and the keys to report faults of.

    The last one is the key of what is known of it, where what is true is the same.
    """
    for key, target in draft.targets:
        yield key, target, frozenset(TargetSection.model_fields), None
    # Distances that fit the target's starts may not fit the truth's.
    moved = {"distance_m"} if "start" in draft.truth_keys else set()
    for (key, truth), (known_as, target) in zip(draft.truths, draft.targets, strict=False):
        same = known_as if truth == target else None
        yield key, truth, draft.truth_keys | moved, same


def _network(draft: Draft, faults: list[Fault]) -> RoadNetwork | None:
    if draft.network is None or any(fault.is_about("network") for fault in faults):
        return None
    try:
        source_files(draft.network, draft.folder)
    except InputError as error:
        faults.append(Fault("network.net", str(error)))
        return None
    try:
        network = _opened(draft.network, draft.folder, faults)
        return with_roads(network, _road_tolerance_m(draft))
    except PlannerError as error:
        if not faults:
            raise
        faults.append(Fault("network", str(error)))
        return None


def _opened(section: NetworkSection, folder: Path, faults: list[Fault]) -> RoadNetwork:
    """Return the network; exits that it lacks are among the faults, and it is without any then."""
    if section.exits:
        network = open_network(section.model_copy(update={"exits": ()}), folder)
        found = [
            Fault(f"network.exits.{name}", no_edge(name, network))
            for name in section.exits
            if name not in network.edge_index
        ]
        if found:
            faults += found
            return network
    return open_network(section, folder)


def _road_tolerance_m(draft: Draft) -> float:
    """Return how near each other edges are one road to the sensor, metres."""
    if draft.network is not None and draft.network.road_tolerance_m is not None:
        return draft.network.road_tolerance_m
    return draft.sensor.radius_m * PART_OF_RADIUS if draft.sensor is not None else 0.0


def _note_wide_roads(network: RoadNetwork, radius_m: float) -> None:
    widest_m = float(network.half_width_m.max())
    if widest_m > radius_m:
        log.warning(
            "network.road_tolerance_m: a target may be %.0f m beside a road's line, farther than "
            "the sensor sees (%g m); a smaller tolerance keeps more roads apart",
            widest_m,
            radius_m,
        )


def _start_faults(key: str, target: TargetSection, network: RoadNetwork) -> Iterator[Fault]:
    if not isinstance(target.start, dict):
        return
    for edge in target.start:
        if edge not in network.edge_index:
            yield Fault(f"{key}.start.{edge}", no_edge(edge, network))
        elif network.edge_exit[network.edge_index[edge]]:
            yield Fault(
                f"{key}.start.{edge}", f"{LEAVES}; choose an edge that leads to another one"
            )
        elif len(network.turns(network.edge_index[edge])) == 0:
            text = "has no way on; choose an edge that leads to another one"
            yield Fault(f"{key}.start.{edge}", text)


def _stands_in(target: TargetSection, faults: Sequence[Fault]) -> bool:
    """Return whether the target starts "anywhere" only because its own starts are faulty."""
    faulty = any(fault.is_about("target.start", "truth.start") for fault in faults)
    return faulty and isinstance(target.start, str)


def _distance_faults(key: str, target: TargetSection, network: RoadNetwork) -> Iterator[Fault]:
    if isinstance(target.distance_m, str) or not isinstance(target.start, str | dict):
        return
    names = target.start if isinstance(target.start, dict) else network.edge_ids
    index = [network.edge_index[edge] for edge in names if edge in network.edge_index]
    high_m = distribution(target.distance_m).high
    short = [edge for edge in index if network.edge_length_m[edge] < high_m - TOLERANCE_M]
    if short:
        edge = min(short, key=lambda edge: float(network.edge_length_m[edge]))
        yield Fault(
            f"{key}.distance_m",
            f"reaches to {as_written(high_m)} m, but {network.edge_ids[edge]} is "
            f"{as_written(float(network.edge_length_m[edge]))} m long; stay within the start edges",
        )
