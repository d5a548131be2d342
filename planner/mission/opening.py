"""A scenario with its network open: all that a search starts from, or every fault at once."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.belief.distribution import distribution
from planner.belief.mixture import Belief, Mixture
from planner.belief.prior import Known, prior_of
from planner.errors import Fault, InputError, PlannerError, ScenarioError
from planner.messages import as_written, suggestion
from planner.mission.known_target import known_target, told_once
from planner.mission.known_turns import LEAVES, known_turns
from planner.network.georeference import grid_convergence_deg, is_georeferenced
from planner.network.read import open_network, source_files
from planner.network.road_network import RoadNetwork
from planner.network.street_names import no_edge
from planner.scenario.checks import faults_of_fields
from planner.scenario.draft import Draft, read_draft
from planner.scenario.sections import NetworkSection, Scenario, TargetSection, UavSection
from planner.scenario.values import NodeLanding, NodeStart, PointStart, UavStart

FAR = 5.0  # widths of a net; a start beyond, which is out of reach too, is in another frame
TOLERANCE_M = 0.01  # lengths in net files have two decimals


@dataclass(frozen=True, eq=False)
class OpenScenario:
    """A sound scenario, its network and what is known of the target on it."""

    scenario: Scenario
    network: RoadNetwork
    prior: Belief  # what the planners know
    truth_prior: Belief  # what the true targets are drawn from

    @property
    def uav_xy_m(self) -> tuple[float, float]:
        """Where the UAV takes off, metres east and north."""
        return _start_xy(self.scenario.uav.start, self.network)

    @property
    def return_to_m(self) -> tuple[float, float] | None:
        """Where the UAV has to land, metres east and north; None: anywhere."""
        return _return_xy(self.scenario.uav, self.network)


def open_scenario(
    place: str | Path, *, preset: str | None = None, overrides: Sequence[str] = ()
) -> OpenScenario:
    """Return a scenario with its network and priors.

    Parameters
    ----------
    place, preset, overrides
        As `planner.scenario.draft.read_draft` takes them.

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
    if network is not None:
        for key, target, names in _targets(draft):
            found: list[Fault] = []
            if key == "truth" and target == draft.target:
                known |= {f"truth{name.removeprefix('target')}": k for name, k in known.items()}
                continue
            for part_key, part in target.parts(key):
                known[part_key], wrong = _known(part_key, part, network, draft)
                found += wrong
            faults += told_once(faults_of_fields(found, key, names))
        faults += _uav_faults(draft.uav, network)
        if draft.uav is not None and not any(fault.is_about("uav.") for fault in faults):
            faults += _landing_faults(draft.uav, network)
            faults += _far_faults(draft, draft.uav, network)
    if faults or network is None:
        raise ScenarioError(str(draft.path), faults)
    scenario = draft.scenario(in_town=not network.is_abstract)
    return OpenScenario(
        scenario=scenario,
        network=network,
        prior=_belief("target", scenario.target, network, known),
        truth_prior=_belief("truth", scenario.truth, network, known),
    )


def _known(
    key: str, target: TargetSection, network: RoadNetwork, draft: Draft
) -> tuple[Known, list[Fault]]:
    turns, found = known_turns(key, target, network, draft)
    found += _start_faults(key, target, network)
    if not _stands_in(target, draft.faults):
        found += _distance_faults(key, target, network)
    known, more = known_target(key, target, network, draft.folder)
    return known._replace(turns=turns), [*found, *more]


def _belief(
    key: str, target: TargetSection, network: RoadNetwork, known: Mapping[str, Known]
) -> Belief:
    priors = [prior_of(part, network, known[name]) for name, part in target.parts(key)]
    if target.mix is None:
        return priors[0]
    weight = np.array([part.weight for part in target.mix])
    return Mixture(weight / weight.sum(), tuple(priors))


def _targets(draft: Draft) -> Iterator[tuple[str, TargetSection, frozenset[str]]]:
    """Yield what is known and what is true of the target, and the keys to report faults of."""
    if draft.target is not None:
        yield "target", draft.target, frozenset(TargetSection.model_fields)
    if draft.truth is not None:
        # Distances that fit the target's starts may not fit the truth's.
        moved = {"distance_m"} if "start" in draft.truth_keys else set()
        yield "truth", draft.truth, draft.truth_keys | moved


def _network(draft: Draft, faults: list[Fault]) -> RoadNetwork | None:
    if draft.network is None or any(fault.is_about("network") for fault in faults):
        return None
    try:
        source_files(draft.network, draft.folder)
    except InputError as error:
        faults.append(Fault("network.net", str(error)))
        return None
    try:
        return _opened(draft.network, draft.folder, faults)
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


def _uav_faults(uav: UavSection | None, network: RoadNetwork) -> Iterator[Fault]:
    if uav is None:
        return
    for key, place in (("uav.start", uav.start), ("uav.return_to", uav.return_to)):
        if isinstance(place, NodeStart | NodeLanding) and place.node not in network.node_index:
            hint = suggestion(place.node, network.node_ids)
            yield Fault(f"{key}.node", f"{place.node} is not a node of the network; {hint}")


def _landing_faults(uav: UavSection, network: RoadNetwork) -> Iterator[Fault]:
    home = _return_xy(uav, network)
    if home is not None and uav.max_flight_time_s is not None:
        away_s = math.dist(_start_xy(uav.start, network), home) / uav.speed_mps
        if away_s > uav.max_flight_time_s:
            yield Fault(
                "uav.return_to",
                f"lies {as_written(round(away_s, 1))} s of flight from the start, but "
                f"uav.max_flight_time_s is {as_written(uav.max_flight_time_s)}; "
                "choose a nearer place",
            )


def _far_faults(draft: Draft, uav: UavSection, network: RoadNetwork) -> Iterator[Fault]:
    """Yield a fault if the UAV cannot see any of the roads by the horizon."""
    if draft.search is None or draft.sensor is None:
        return
    place = np.array(_start_xy(uav.start, network))
    low, high = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    away_m = math.hypot(*np.maximum(np.maximum(low - place, place - high), 0.0))
    out_of_reach = away_m > uav.speed_mps * draft.search.horizon_s + draft.sensor.radius_m
    if out_of_reach and away_m > FAR * float((high - low).max()):
        yield Fault(
            "uav.start",
            f"lies {away_m / 1000:.6g} km from the net (x {low[0]:.8g} to {high[0]:.8g}, y "
            f"{low[1]:.8g} to {high[1]:.8g} m), farther than the UAV flies by search.horizon_s; "
            "give a place nearby, in metres as the net has them",
        )


def _start_xy(start: UavStart, network: RoadNetwork) -> tuple[float, float]:
    if isinstance(start, PointStart):
        return start.x_m, start.y_m
    x_m, y_m = network.node_xy_m[network.node_index[start.node]]
    bearing_deg = start.bearing_deg  # clockwise from north: the true one, where that is known
    if start.distance_m > 0.0 and is_georeferenced(network):
        bearing_deg -= float(grid_convergence_deg(network, np.array([x_m, y_m])))
    bearing = math.radians(bearing_deg)
    return (
        float(x_m + start.distance_m * math.sin(bearing)),
        float(y_m + start.distance_m * math.cos(bearing)),
    )


def _return_xy(uav: UavSection, network: RoadNetwork) -> tuple[float, float] | None:
    place = uav.return_to
    if place is None or isinstance(place, PointStart):
        return None if place is None else (place.x_m, place.y_m)
    if isinstance(place, str):
        return _start_xy(uav.start, network)
    x_m, y_m = network.node_xy_m[network.node_index[place.node]]
    return float(x_m), float(y_m)
