"""One rider: a particle's car in a copy of the traffic, from where it is set down to its end."""

import math
from array import array
from collections.abc import Sequence
from typing import Any, NamedTuple

from planner.futures.rides import SHORT_M, Arrival, Ride, arrival_of
from planner.futures.simulation import Vehicle

OURS = "planner.rider"  # begins the names of cars, routes and the type that we add to the user's
NEAR_M = 12.0  # so near to where a particle starts a car is in its place
CAR = "passenger"
NOWHERE = (math.nan, math.nan)  # a place that is not known


class Fate(NamedTuple):
    """How a vehicle got into the traffic, and what it met there."""

    late_s: float  # seconds that it waited for a place; infinity: until the end
    took_over: bool  # a car that was there
    teleports: int


class Events(NamedTuple):
    """Which vehicles did what in a step."""

    entered: Sequence[str]
    left: Sequence[str]
    vanished: Sequence[str]  # to be put past a jam


def events_of(libsumo: Any) -> Events:
    """Return which vehicles did what in the step that was just made."""
    seen = libsumo.simulation
    return Events(
        seen.getDepartedIDList(), seen.getArrivedIDList(), seen.getStartingTeleportIDList()
    )


class Rider:
    """A particle's car, from where it is set down to its end."""

    def __init__(self, libsumo: Any, vehicle: Vehicle, step_s: float, end_s: float) -> None:
        self._libsumo, self._of_car, self._vehicle = libsumo, libsumo.vehicle, vehicle
        self._step_s, self._begins = step_s, round(vehicle.depart_s / step_s)
        self._last = math.ceil((min(end_s, vehicle.stop_s) - vehicle.depart_s) / step_s)
        self._calms = math.ceil(vehicle.flees_s / step_s)
        self._name = f"{OURS}.{vehicle.name}"
        self._is_in, self._is_over = False, False
        self._took_over, self._late, self._teleports = False, 0, 0
        self._xy_m = array("d")
        self._roads: list[tuple[int, str, str]] = []
        self._before_end: tuple[float, float] | None = None
        self._arrival: Arrival | None = None

    def prepare(self, sample: int, taken: set[str]) -> None:
        """Do what is due before a step.

        Parameters
        ----------
        taken
            The cars that particles have taken over.
        """
        since = sample - self._begins
        if since < 0 or self._is_over:
            return
        if since == 0:
            self._set_down(taken)
        elif since > self._last:
            self._leave()
        elif since == self._calms:
            self._drive_at(1.0)
        if self._is_in and not self._is_over:
            self._steer()

    def look(self, sample: int, events: Events) -> None:
        """See where it is after a step, or that it has arrived."""
        since = sample - self._begins
        if since < 0 or self._is_over:
            return
        self._is_in = self._is_in or self._name in events.entered
        if self._name in events.left:
            self._is_over = True
            self._arrival = arrival_of(self._xy_m, self._before_end, self._step_s)
        elif self._is_in:
            self._teleports += self._name in events.vanished
            self._see(since)
        else:
            self._late += 1
            self._xy_m.extend(NOWHERE)

    def ridden(self) -> tuple[Ride, Fate]:
        """Return what it did, and what became of it."""
        first = self._vehicle.edges[0]
        roads = tuple(self._roads) or ((0, first, first),)
        if not self._roads:  # it waits at its start for ever
            self._xy_m[:2] = array("d", self._start_xy_m())
        ride = Ride(self._xy_m.tobytes(), self._vehicle.depart_s, roads, self._arrival)
        late_s = self._late * self._step_s if self._is_in else math.inf
        return ride, Fate(late_s, self._took_over, self._teleports)

    @property
    def _start_m(self) -> float:
        return max(0.0, min(self._vehicle.start_m, self._vehicle.lengths_m[0] - SHORT_M))

    def _start_xy_m(self) -> tuple[float, float]:
        edge = self._vehicle.edges[0]
        lane = self._libsumo.edge.getLaneNumber(edge) - 1
        x_m, y_m = self._libsumo.simulation.convert2D(edge, self._start_m, lane)
        return x_m, y_m

    def _set_down(self, taken: set[str]) -> None:
        """Take over the car in its place, or wait there until one more car finds room."""
        car = self._car_there(taken)
        if car is None:
            self._add()
        else:
            self._name, self._took_over, self._is_in = car, True, True
            taken.add(car)
        self._drive_at(self._vehicle.flees if self._calms else 1.0)

    def _car_there(self, taken: set[str]) -> str | None:
        """Return the car in its place, now on its route; None if there is none."""
        near = []
        for car in self._libsumo.edge.getLastStepVehicleIDs(self._vehicle.edges[0]):
            away_m = abs(self._of_car.getLanePosition(car) - self._start_m)
            if away_m < NEAR_M and car not in taken and self._is_ordinary(car):
                # One that waits in a lane for another turn would wait for ever.
                near.append((not self._leads_on(self._of_car.getLaneID(car)), away_m, car))
        for _, _, car in sorted(near):
            try:
                self._of_car.setRoute(car, self._vehicle.edges)
            except self._libsumo.TraCIException:
                continue
            return str(car)
        return None

    def _is_ordinary(self, car: str) -> bool:
        """Return whether it is a car that stops nowhere by plan."""
        return self._of_car.getVehicleClass(car) == CAR and not self._of_car.getStops(car, 1)

    def _leads_on(self, lane: str) -> bool:
        """Return whether a lane leads to the second edge of the route."""
        edges, of_lane = self._vehicle.edges, self._libsumo.lane
        onto = (of_lane.getEdgeID(link[0]) for link in of_lane.getLinks(lane))
        return len(edges) == 1 or edges[1] in onto

    def _add(self) -> None:
        end_m = self._vehicle.end_m
        self._libsumo.route.add(self._name, self._vehicle.edges)
        self._of_car.add(
            self._name,
            self._name,
            OURS,
            depart="now",
            departLane="best",
            departPos=repr(self._start_m),
            departSpeed="max",
            arrivalPos=repr(end_m) if math.isfinite(end_m) else "max",
        )

    def _drive_at(self, factor: float) -> None:
        self._of_car.setMaxSpeed(self._name, self._vehicle.speeds_mps[0] * factor)
        self._of_car.setSpeedFactor(self._name, factor)  # after it, which would undo this

    def _steer(self) -> None:
        """Keep to the speed that is drawn for the road; note how far the route's end is."""
        speeds_mps = self._vehicle.speeds_mps
        if len(set(speeds_mps)) > 1:
            index = self._of_car.getRouteIndex(self._name)
            self._of_car.setMaxSpeed(self._name, speeds_mps[min(index, len(speeds_mps) - 1)])
        if self._roads and self._roads[-1][1] == self._vehicle.edges[-1]:
            self._before_end = self._to_end()
            if self._took_over and self._before_end is not None and self._before_end[0] <= 0.0:
                self._leave()

    def _to_end(self) -> tuple[float, float] | None:
        """Return how far the route's end is, in metres, and the speed; None while it is off."""
        lane = self._of_car.getLaneID(self._name)
        if not lane:
            return None
        end_m = min(self._libsumo.lane.getLength(lane), self._vehicle.end_m)
        return end_m - self._of_car.getLanePosition(self._name), self._of_car.getSpeed(self._name)

    def _leave(self) -> None:
        """Take the car off the road: it rests, or is at its goal."""
        self._is_over = True
        self._of_car.remove(self._name)

    def _see(self, since: int) -> None:
        """Note where it is."""
        road = self._of_car.getRoadID(self._name)
        if not road:  # while SUMO puts it past a jam
            self._xy_m.extend(NOWHERE)
            return
        self._xy_m.extend(self._of_car.getPosition(self._name))
        if not self._roads or road != self._roads[-1][1]:
            first = not self._roads  # it has waited there
            self._roads.append((0 if first else since, road, self._onto(road)))

    def _onto(self, road: str) -> str:
        """Return the edge that counts: in a junction the next one."""
        if not road.startswith(":"):
            return road
        route, index = self._of_car.getRoute(self._name), self._of_car.getRouteIndex(self._name)
        return str(route[min(index + 1, len(route) - 1)])
