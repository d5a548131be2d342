"""`planner check`: what a net is like, what work on it costs, and what is odd about it."""

import argparse
from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from planner.cli.arguments import add_scenario
from planner.cli.printing import print_result
from planner.clock import clock, rough
from planner.messages import counted, percent

if TYPE_CHECKING:
    from rich.table import Table

    from planner.belief.particles import Driving
    from planner.futures.cost import Cost
    from planner.futures.traffic import Traffic
    from planner.mission.opening import OpenScenario
    from planner.network.road_network import RoadNetwork
    from planner.network.survey import Survey

SUMMARY = "measure a net, tell what work on it costs and what is odd"
DETAILS = """\
SCENARIO may also be a net: a .net.xml (or .net.xml.gz), a .sumocfg or an
OpenStreetMap file."""
EXAMPLES = (
    ("check berlin", "a scenario and its net"),
    ("check town.osm.xml", "a net alone, before anything is planned"),
)

PARTICLES, HORIZON_S = 1000, 1800.0  # of a search on a net without a scenario


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner check`."""
    add_scenario(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print the measures of a net, what it costs, and what deserves to be known of it."""
    from planner.cli.nets import opened_net
    from planner.mission.remarks import scenario_remarks
    from planner.network.survey import remarks, survey
    from planner.report.formats import listed
    from planner.report.real_flight import aircraft_line

    network, opened = opened_net(arguments)
    found = survey(network)
    cost = _costs(network, opened)
    odd = [*remarks(found, network), *(scenario_remarks(opened) if opened else [])]
    summary = {
        "net": str(network.given_as),
        "sha256": network.sha256,
        **found.as_dict(),
        "cost": {"recording": cost.recording._asdict(), "plan": cost.plan._asdict()},
        "remarks": odd,
    }
    measures = dict(_measures(found)) | dict(_told_costs(cost))
    traffic = None if opened is None else opened.traffic
    if traffic is not None:
        summary["traffic"] = traffic.as_dict()
        measures |= dict(_told_traffic(traffic))
    if opened is None:  # what is one road to a sensor is not known yet
        del measures["roads"]
    told = [listed(odd) if odd else "nothing is odd about it"]
    if opened is not None and opened.scenario.uav.is_real:
        told.append(aircraft_line(opened.scenario.uav))
    print_result(arguments, summary, [_table(str(network.given_as), measures), *told])
    return 0


class _Costs(NamedTuple):
    """What SUMO's part of the work on a net costs, and for how many targets."""

    recording: "Cost"  # the particles alone
    plan: "Cost"  # with those to choose on and fresh targets
    targets: tuple[int, int, int]  # particles, to choose on, fresh
    horizon_s: float


def _costs(network: "RoadNetwork", opened: "OpenScenario | None") -> _Costs:
    from planner.futures.cost import cost_of
    from planner.mission.sample_sizes import fresh_targets, holdout_particles, sizes_for

    believed: Driving = "free"
    true: Driving = "free"
    particles, horizon_s = PARTICLES, HORIZON_S
    factor, fresh = sizes_for(network, believed, HORIZON_S)
    holdout = factor * PARTICLES
    if opened is not None:
        scenario = opened.scenario
        believed, true = scenario.target.driving, scenario.truth.driving
        particles, horizon_s = scenario.search.particles, scenario.search.horizon_s
        holdout = holdout_particles(scenario, network)
        fresh = fresh_targets(scenario, network)
    cost = partial(cost_of, network, horizon_s=horizon_s)
    to_plan = cost(particles + holdout, driving=believed).plus(cost(fresh, driving=true))
    recording = cost(particles, driving=believed)
    return _Costs(recording, to_plan, (particles, holdout, fresh), horizon_s)


def _table(title: str, measures: Mapping[str, str]) -> "Table":
    from planner.report.formats import titled_table

    table = titled_table(title)
    table.show_header = False
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for name, text in measures.items():
        table.add_row(name, text)
    return table


def _measures(found: "Survey") -> Iterator[tuple[str, str]]:
    from planner.report.formats import length

    others = f"; {found.closed_edges:,} more not for cars" if found.closed_edges else ""
    yield "edges", f"{found.edges:,} for cars, {found.edge_km:,.1f} km{others}"
    yield "roads", f"{found.roads:,}, {found.road_km:,.1f} km, between {found.nodes:,} nodes"
    yield "extent", " x ".join(map(length, found.extent_m))
    if found.lonlat_deg is not None:
        west, south, east, north = found.lonlat_deg
        yield "longitude", f"{west:.5f} .. {east:.5f}"
        yield "latitude", f"{south:.5f} .. {north:.5f}"
    yield "projection", found.projection or "none"
    if found.convergence_deg is not None:
        side = "east" if found.convergence_deg > 0 else "west"
        yield "north of the net", f"{abs(found.convergence_deg):.2f} degrees {side} of true north"
    yield "named streets", f"{percent(found.named_share)} of the length"
    yield "pieces", f"{found.pieces:,}"
    share = f", the largest {percent(found.main_share)} of the length" * bool(found.components)
    yield "strong components", f"{found.components:,}{share}"
    yield "dead ends", f"{found.dead_ends:,}"
    yield "exits", f"{found.exits:,}"
    yield "not reached by cars", counted(len(found.not_reached), "edge")
    yield "not left by cars", counted(len(found.not_left), "edge")
    yield "signals", f"{found.signals:,}"
    yield "roundabouts", f"{found.roundabouts:,}"
    if found.attribution:
        yield "data", found.attribution


def _told_traffic(traffic: "Traffic") -> Iterator[tuple[str, str]]:
    source = traffic.given_as.name
    if traffic.demand is not None:
        source = f"{traffic.demand.vehicles_per_hour:,g} vehicles an hour"
    runs = counted(2 * traffic.realisations, "run")
    yield "traffic", f"{source}, from {clock(traffic.at_s)} on, in {runs}"
    taken = tuple(f"{name} = {value}" for name, value in traffic.options)
    for title, names in (("taken of it", taken), ("left out of it", traffic.left_out)):
        if names:
            yield title, ", ".join(names)


def _told_costs(cost: _Costs) -> Iterator[tuple[str, str]]:
    particles, holdout, fresh = cost.targets
    first = f"{particles:,} particles until {clock(cost.horizon_s)}"
    more = f"these, {holdout:,} to choose on and {fresh:,} fresh targets"
    yield "a recording", f"{first}: {_core(cost.recording)}"
    yield "a plan", f"{more}: {_core(cost.plan)}"


def _core(cost: "Cost") -> str:
    return f"{counted(cost.runs, 'SUMO run')}, about {rough(cost.load_s + cost.cpu_s)} of one core"
