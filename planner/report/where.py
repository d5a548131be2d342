"""Where the target may be at a time: as a table, and as files."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.clock import clock
from planner.flight.track import Track
from planner.futures.state_at import QUANTILES, UNKNOWN, RoadState, State
from planner.messages import percent
from planner.mission.opening import OpenScenario
from planner.network.georeference import is_georeferenced, lonlat
from planner.network.road_network import RoadNetwork
from planner.network.street_names import has_street_names, road_phrase
from planner.report.csv_file import write_csv
from planner.report.formats import Column, FittingTable
from planner.report.picture import where_picture

TABLE, PICTURE = "where.csv", "where.png"
FILES = (TABLE, PICTURE)
MOST_ROWS = 20  # of a table on a terminal


def where_table(
    rows: Sequence[RoadState],
    network: RoadNetwork,
    *,
    time_s: float,
    elsewhere_probability: float,
    most: int = MOST_ROWS,
    called: str = "the target",
) -> FittingTable:
    """Return where the target is believed to be, road by road, the likeliest first.

    Parameters
    ----------
    network
        Where it has names of streets, roads are called by them.
    elsewhere_probability
        Probability that it is gone, never was there, or has not set out yet.
    most
        How many roads are named; the others stand in one row.
    called
        What the target is called.
    """
    named = has_street_names(network)
    quantiles = ", ".join(percent(share, 0) for share in QUANTILES)
    table = FittingTable(
        f"where {called} may be at {clock(time_s)}",
        (
            *([Column("street", left=True, wraps=True)] if named else []),
            Column("road", left=True, rank=3 if named else 0),
            Column("probability"),
            Column(f"m from its start\n({quantiles})", rank=1),
            Column("speed, m/s", rank=2),
        ),
    )
    for row in rows[:most]:
        distance = " ".join(f"{metres:>7,.0f}" for metres in row.distance_m)
        speed = " ".join(f"{mps:5.1f}" for mps in row.speed_mps)
        street = [_street(row, network)] * named
        table.add_row(*street, row.road, percent(row.probability), distance, speed)
    blank = [""] * named
    if len(rows) > most:
        rest = sum(row.probability for row in rows[most:])
        table.add_row(f"{len(rows) - most} other roads", *blank, percent(rest), "", "")
    if elsewhere_probability > 1e-9:
        elsewhere = "not on the roads" if network.is_abstract else "off the map, or not on it yet"
        table.add_row(elsewhere, *blank, percent(elsewhere_probability), "", "")
    return table


def _street(row: RoadState, network: RoadNetwork) -> str:
    """Return a road in words, named from where distances along it start."""
    return "" if row.road == UNKNOWN else road_phrase(network, 2 * network.road_index[row.road])


def where_content(
    rows: Sequence[RoadState],
    network: RoadNetwork,
    *,
    time_s: float,
    elsewhere_probability: float,
) -> dict[str, Any]:
    """Return where the target is believed to be as plain data; None for what is unknown."""
    return {
        "time_s": time_s,
        "elsewhere_probability": elsewhere_probability,
        "roads": [_road_content(row, network) for row in rows],
    }


def _road_content(row: RoadState, network: RoadNetwork) -> dict[str, Any]:
    distance_m = [None if math.isnan(metres) else metres for metres in row.distance_m]
    return {
        "road": row.road,
        "edge": row.edge,
        "probability": row.probability,
        "distance_m": distance_m,
        "speed_mps": row.speed_mps,
        **_whereabouts(row, network),
    }


def _whereabouts(row: RoadState, network: RoadNetwork) -> dict[str, Any]:
    """Return where the road of a state is for people: its street, and a place on the Earth.

    Where the net has them: ``street``, and ``lon_deg`` and ``lat_deg`` of the median distance.
    """
    found: dict[str, Any] = {}
    if has_street_names(network):
        found["street"] = _street(row, network)
    if is_georeferenced(network):
        place = [None, None]
        if row.road != UNKNOWN:
            place = lonlat(network, np.array(row.xy_m)).tolist()
        found |= dict(zip(("lon_deg", "lat_deg"), place, strict=True))
    return found


def write_where(
    folder: Path,
    opened: OpenScenario,
    state: State,
    roads: Sequence[RoadState],
    *,
    flown: Track | None = None,
) -> None:
    """Write ``where.csv`` and ``where.png``; in the picture, where a sensor has been, if any."""
    rows = []
    for road in roads:
        row: dict[str, Any] = {"target": road.target} if road.target else {}
        row |= {"road": road.road, "probability": road.probability}
        for name in ("distance_m", "speed_mps"):
            quantiles = zip(QUANTILES, getattr(road, name), strict=True)
            row |= {f"{name}_q{share * 100:02.0f}": value for share, value in quantiles}
        rows.append(row | _whereabouts(road, opened.network))
    write_csv(folder / TABLE, rows)
    title = opened.scenario.title
    where_picture(folder / PICTURE, opened.network, state, title=title, flown=flown)
