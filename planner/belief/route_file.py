"""Routes and trips from SUMO's files."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.messages import as_written
from planner.xml_guard import xml_elements

Route = tuple[str, ...]


@dataclass
class Planned:
    """What a file says of where vehicles drive."""

    routes: dict[Route, float] = field(default_factory=dict)  # edges, and their weight
    ends: dict[str, float] = field(default_factory=dict)  # last edges of trips, and their weight


def read_routes(path: Path) -> Planned:
    """Return the routes of a file by their weights, or else the ends of its trips.

    Each vehicle weighs one, and its routes share that by their probabilities. Where a file holds no
    vehicles, each of its distributions weighs one, and where it holds none, each route by its own
    probability, or one.

    Raises
    ------
    InputError
        If the file is missing, or is not such a file, or holds routes as well as trips.
    """
    *_, root = xml_elements(path)  # the last one to end holds all others
    found = _File(path, list(root))
    planned = Planned()
    for route, weight in found.weighted():
        planned.routes[route] = planned.routes.get(route, 0.0) + weight
    for element in found.elements:
        if _tag(element) in ("trip", "flow") and "to" in element.attrib:
            end = element.attrib["to"]
            planned.ends[end] = planned.ends.get(end, 0.0) + 1.0
    if planned.routes and planned.ends:
        raise InputError(f"{path}: holds routes and trips; make routes of all with duarouter")
    if not any(planned.routes.values()) and not planned.ends:
        raise InputError(
            f"{path}: holds no route with a probability above 0 and no trip with an edge to; give "
            "a .rou.xml"
        )
    return planned


def _tag(element: Any) -> str:
    return str(element.tag).rpartition("}")[2]


@dataclass
class _File:
    """The elements of a file, and the routes that bear names."""

    path: Path
    elements: list[Any]

    def __post_init__(self) -> None:
        self.named: dict[str, Any] = {
            element.get("id"): element
            for element in self.elements
            if _tag(element) in ("route", "routeDistribution") and element.get("id")
        }

    def weighted(self) -> Iterator[tuple[Route, float]]:
        """Yield routes and what they weigh; one may come several times."""
        vehicles = [one for one in self.elements if _tag(one) in ("vehicle", "flow")]
        choices = [one for one in self.elements if _tag(one) == "routeDistribution"]
        loose = [one for one in self.elements if _tag(one) == "route"]
        if vehicles:
            for vehicle in vehicles:
                yield from self._of_vehicle(vehicle)
        elif choices:
            for choice in choices:
                yield from self._of_choice(choice)
        else:
            for route in loose:
                yield self._edges(route), self._number(route.get("probability", "1"))

    def _of_vehicle(self, vehicle: Any) -> Iterator[tuple[Route, float]]:
        own = [one for one in vehicle if _tag(one) in ("route", "routeDistribution")]
        name = vehicle.get("route")
        if not own and name is None:
            return  # a flow from an edge to another one
        if not own and name not in self.named:
            raise InputError(f"{self.path}: there is no route {as_written(name)}; add it")
        one = own[0] if own else self.named[name]
        if _tag(one) == "route":
            yield self._edges(one), 1.0
        else:
            yield from self._of_choice(one)

    def _of_choice(self, choice: Any) -> Iterator[tuple[Route, float]]:
        """Yield the routes of a distribution; their weights sum to one."""
        routes = [(one, one.get("probability", "1")) for one in choice if _tag(one) == "route"]
        names = choice.get("routes", "").split()
        shares = choice.get("probabilities", "1 " * len(names)).split()
        if len(shares) != len(names):
            raise InputError(
                f"{self.path}: a routeDistribution has {len(names)} routes but {len(shares)} "
                "probabilities; give one for each"
            )
        for name, share in zip(names, shares, strict=True):
            if name not in self.named:
                raise InputError(f"{self.path}: there is no route {as_written(name)}; add it")
            routes.append((self.named[name], share))
        weights = [self._number(share) for _, share in routes]
        total = math.fsum(weights)
        for (route, _), weight in zip(routes, weights, strict=True):
            if weight > 0:
                yield self._edges(route), weight / total

    def _edges(self, route: Any) -> Route:
        name = route.get("refId")
        if name is not None and name in self.named:
            route = self.named[name]
        edges = tuple((route.get("edges") or "").split())
        if not edges:
            raise InputError(f"{self.path}: a route has no edges; add them, or leave it out")
        return edges

    def _number(self, text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not 0 <= number < 1e15:
            raise InputError(
                f"{self.path}: {as_written(text)} is no probability; give a number from 0 on"
            )
        return number
