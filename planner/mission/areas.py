"""The airspace of a scenario, on its network."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from planner.errors import Fault, InputError
from planner.flight.airspace import MARGIN_M, Airspace
from planner.flight.areas import area_of_file, area_of_points
from planner.flight.turning import room_m
from planner.flight.ways import Area, Point
from planner.mission.aircraft import aircraft_of
from planner.mission.uav_places import start_xy
from planner.network.road_network import RoadNetwork
from planner.scenario.checks import missing_areas
from planner.scenario.sections import AirspaceSection
from planner.scenario.uav import UavSection


def airspace_of(
    section: AirspaceSection | None,
    folder: Path,
    network: RoadNetwork,
    uav: UavSection | None = None,
) -> tuple[Airspace | None, list[Fault]]:
    """Return a scenario's airspace on its network, None where nothing is said, and its faults.

    Parameters
    ----------
    uav
        Who flies in it, without faults; None: who is faulty.
    """
    link = None if uav is None else link_of(uav, network)
    areas: dict[str, Area] = {} if link is None else {"link": link}
    faults: list[Fault] = []
    given = section.model_dump(exclude_none=True) if section else {}
    if section and any(missing_areas(section, folder)):
        return None, []  # which has been reported already
    for key, value in given.items():
        try:
            if isinstance(value, str):
                areas[key] = area_of_file(folder / value, network)
            else:
                areas[key] = area_of_points(value, network)
        except InputError as error:
            text = str(error)
            if isinstance(value, str):
                text = f"{value}: {text.removeprefix(f'{folder / value}: ')}"
            faults.append(Fault(f"airspace.{key}", text))
    if not areas or faults:
        return None, faults
    aircraft = None if uav is None else aircraft_of(uav)
    beside_m = 0.0 if aircraft is None else room_m(aircraft.law)
    return Airspace(**areas, margin_m=MARGIN_M + beside_m), faults


def link_of(uav: UavSection, network: RoadNetwork) -> Area | None:
    """Return where a UAV's radio reaches: a circle around its start, cut at the corners."""
    import shapely

    if uav.link_m is None:
        return None
    return shapely.Point(start_xy(uav.start, network)).buffer(uav.link_m)


def within_link(airspace: Airspace | None, link: Area | None) -> Airspace | None:
    """Return an airspace for a UAV whose radio reaches elsewhere; None: everywhere."""
    if airspace is None:
        return None if link is None else Airspace(link=link)
    return replace(airspace, link=link, _searched={})


def place_faults(
    airspace: Airspace, network: RoadNetwork, start: Point, home: Point | None
) -> Iterator[Fault]:
    """Yield what is wrong with where the UAV starts and lands, and with what is left to search."""
    why = airspace.forbids(start)
    if why:
        yield Fault("uav.start", f"lies {why}; start elsewhere, or correct [airspace]")
        return
    if home is not None and (why := airspace.forbids(home)):
        yield Fault("uav.return_to", f"lies {why}; land elsewhere, or correct [airspace]")
    elif home is not None and not airspace.connects(start, home):
        yield Fault("uav.return_to", "cannot be flown to within [airspace]; land elsewhere")
    if not airspace.roads_searched(network, start).any():
        if airspace.link is None:
            yield Fault("airspace", "leaves no road to be searched; correct its areas")
        else:
            text = "leaves no road to be searched; give more, or correct [airspace]"
            yield Fault("uav.link_m", text)
