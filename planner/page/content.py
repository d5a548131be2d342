"""What the script of a page takes: places and times as columns, and all that it draws."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluation import Evaluation
from planner.flight.airspace import Airspace
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.futures.knots import Knots
from planner.messages import plain
from planner.mission.opening import OpenScenario
from planner.network.georeference import is_georeferenced, lonlat
from planner.network.road_network import RoadNetwork
from planner.page.earth import Box, earth_content
from planner.page.frame import Frame
from planner.page.ground import roads_once, under_content, view_of, with_room
from planner.page.rows import Row
from planner.page.shown import Shown
from planner.page.targets import drawn_knots, picked, targets_content
from planner.page.words import Clock, for_posix, for_powershell, soon_s

SCHEMA = "planner.page/1"
NOWHERE = dict.fromkeys(("knots", "t", "x", "y", "seen", "gone"), "")  # the columns of no targets
UNPLANNED: dict[str, Any] = {  # what a page knows of a search before there is a plan
    "schema": SCHEMA,
    "clock": None,
    "start_s": 0.0,
    "end_s": 1.0,
    "soon_s": 1.0,
    "radius_m": 0.0,
    "uavs": [],
    "targets": NOWHERE,
    "curves": [],
    "call": None,
}
POINTS = 240  # of a curve, after the first


@dataclass(frozen=True, eq=False)
class Drawn:
    """What the map of a page is made of."""

    targets: Futures
    seen_at: Floats  # (n,) seconds, when the plan sees each of these first
    knots: Knots
    frame: Frame
    whole: Box  # all of it
    view: Box  # what is shown first
    roads: list[Floats]  # polylines, (k, 2) metres

    @classmethod
    def of(cls, run: Shown) -> "Drawn":
        """Return the map of a run."""
        return cls.around(
            run.opened.network,
            run.fresh,
            run.evaluated.seen_at,
            [places_of(track) for track in run.plan.tracks],
            radius_m=run.radius_m,
            until_s=run.until_s,
        )

    @classmethod
    def around(
        cls,
        network: RoadNetwork,
        targets: Futures,
        seen_at: Floats,
        flown_m: list[Floats],
        *,
        radius_m: float,
        until_s: float,
    ) -> "Drawn":
        """Return the map of targets, (N,) of which are seen at some time, and flights.

        Parameters
        ----------
        seen_at
            (N,) seconds; infinity: never.
        flown_m
            The places of each flight, (W, 2) metres.
        radius_m
            Of the sensor.
        until_s
            When nothing happens any more.
        """
        index = picked(len(targets))
        shown = targets.take(index)
        knots = drawn_knots(shown, radius_m)
        places_m = np.concatenate([network.shape_xy_m, knots.xy_m, *flown_m])
        frame = Frame.around(places_m, max(until_s, float(knots.time_s.max(initial=0.0))))
        return cls(
            targets=shown,
            seen_at=seen_at[index],
            knots=knots,
            frame=frame,
            whole=Box(*places_m.min(axis=0).tolist(), *places_m.max(axis=0).tolist()),
            view=view_of(network, flown_m, knots),
            roads=roads_once(network, frame),
        )


def places_of(track: Track) -> Floats:
    """Return the waypoints of a flight, (W, 2) metres."""
    return np.stack([track.x_m, track.y_m], axis=1)


def page_content(run: Shown, drawn: Drawn) -> dict[str, Any]:
    """Return a run as plain data."""
    network = run.opened.network
    under = under_content(network, run.opened.airspace, drawn.roads, drawn.frame, drawn.view)
    earth = earth_content(network, drawn.whole, drawn.view)
    return {
        "schema": SCHEMA,
        "clock": run.clock.as_dict(),
        "start_s": round(run.plan.take_off_s, 2),
        "end_s": round(run.until_s, 2),
        "soon_s": soon_s(run.until_s),
        "radius_m": run.radius_m,
        **under,
        "uavs": _uavs(run),
        "targets": targets_content(drawn.targets, drawn.knots, drawn.seen_at, drawn.frame),
        # The plan's first; the last one is what no flight surpasses.
        "curves": [_curve(one, run.until_s) for one in run.curves.values()],
        "earth": earth,
        "call": _call(run) if earth is not None or network.projection is None else None,
    }


def net_content(network: RoadNetwork, airspace: Airspace | None) -> dict[str, Any]:
    """Return a net on which nothing is planned yet as plain data, as `page_content` has a run."""
    low_m, high_m = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    view, frame = with_room(low_m, high_m), Frame.around(network.shape_xy_m, 1.0)
    under = under_content(network, airspace, roads_once(network, frame), frame, view)
    return UNPLANNED | under | {"earth": earth_content(network, view, view)}


def guess_content(opened: OpenScenario, drawn: Drawn, clock: Clock) -> dict[str, Any]:
    """Return where the target may be, and the drone before it takes off, as plain data."""
    scenario, network = opened.scenario, opened.network
    under = under_content(network, opened.airspace, drawn.roads, drawn.frame, drawn.view)
    end_s = scenario.search.horizon_s
    return UNPLANNED | {
        "clock": clock.as_dict(),
        "start_s": round(float(scenario.take_off_s), 2),
        "end_s": end_s,
        "radius_m": scenario.sensor.radius_m,
        **under,
        "uavs": [
            {"waypoints": [[end_s, *place]], "sensor_on": [], "legs": []}
            for place in opened.starts_m
        ],
        "targets": targets_content(drawn.targets, drawn.knots, drawn.seen_at, drawn.frame),
        "earth": earth_content(network, drawn.whole, drawn.view),
    }


def _uavs(run: Shown) -> list[dict[str, Any]]:
    """Return all flights; where there are several, each with its name."""
    flights = [_uav(*one) for one in zip(run.plan.tracks, run.rows, strict=True)]
    if len(flights) > 1:
        for name, flight in zip(run.plan.names, flights, strict=True):
            flight["name"] = name.replace("UAV", "drone", 1)
    return flights


def _uav(track: Track, rows: list[Row]) -> dict[str, Any]:
    waypoints = np.column_stack([track.time_s, track.x_m, track.y_m])
    return {
        "waypoints": np.round(waypoints, 2).tolist(),
        "sensor_on": np.round(track.sensor_on, 2).tolist(),
        "legs": [[plain(row.name), round(row.start_s, 2), round(row.end_s, 2)] for row in rows],
    }


def _curve(evaluation: Evaluation, until_s: float) -> list[float]:
    """Return the probability of having found the target, at times evenly apart until the end.

    Of several it is their mean.
    """
    times_s = np.linspace(0.0, until_s, POINTS + 1).tolist()
    sought = evaluation.objective.sought
    return [round(evaluation.found_by_probability(time_s) / sought, 6) for time_s in times_s]


def _call(run: Shown) -> dict[str, Any] | None:
    """Return what the command begins and ends with that plans for a new sighting.

    None where no file of a net is known, or its name would do more than name it.
    """
    section, uav = run.opened.scenario.network, run.problem.flying[0]
    name = section.net or section.osm
    if name is None:
        return None
    posix, powershell = for_posix(name), for_powershell(name)
    if posix is None or powershell is None:
        return None
    place = f"{uav.x_m:.1f},{uav.y_m:.1f}"
    if is_georeferenced(run.opened.network):
        lon_deg, lat_deg = lonlat(run.opened.network, np.array([uav.x_m, uav.y_m])).tolist()
        place = f"{lat_deg:.5f},{lon_deg:.5f}"
    rest = [f"--drone-at={place}"]
    if np.isfinite(uav.max_flight_time_s):
        rest.append(f"--battery={uav.max_flight_time_s / 60:g}min")
    return {"sh": posix, "PowerShell": powershell, "rest": rest}
