"""Where the UAV may fly: around no-fly areas, never beyond the fence; and where it searches.

The one place that knows: planners get their ways from it, and whatever leaves the program is held
against it. Ways keep `MARGIN_M` clear of what is forbidden, so that a flight written with fewer
digits still keeps out; those of an aircraft that cannot hover keep clear by what its circles take.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner.arrays import Flags, Floats
from planner.errors import InputError
from planner.flight.track import Track
from planner.flight.ways import Area, Point, Ways
from planner.network.road_network import RoadNetwork

MARGIN_M = 0.1  # that flights stay clear of what is forbidden; degrees in files are good to 0.001
SHARPEST = 5.0  # margins: corners sharper than that are cut
FAR_M = 1e9  # beyond all places that a scenario may name
STEPS_M = (0.0, 1e-6, 1e-4, 1e-2, 1.0)  # from an edge inwards
TOUCH_M = 1e-6  # by which rounding may carry a flight over an edge


@dataclass(frozen=True, eq=False)
class Airspace:
    """No-fly areas, what the UAV never leaves, and where it searches; None: not given."""

    no_fly: Area | None = None
    fence: Area | None = None
    within: Area | None = None  # whatever is searched lies in it; on the way there it may be left
    link: Area | None = None  # where its radio reaches it, which it never leaves
    margin_m: float = MARGIN_M  # that planned ways stay clear of what is forbidden
    _searched: dict[Point, Area] = field(default_factory=dict, repr=False)

    @cached_property
    def free(self) -> Area:
        """All that may be flown over, with the margin kept."""
        import shapely

        free = shapely.box(-FAR_M, -FAR_M, FAR_M, FAR_M)
        for kept in (self.fence, self.link):
            if kept is not None:
                free = free.intersection(_grown(kept, -self.margin_m))
        if self.no_fly is not None:
            free = free.difference(_grown(self.no_fly, self.margin_m))
        shapely.prepare(free)
        return free

    @cached_property
    def ways(self) -> Ways:
        """The shortest ways from place to place."""
        return Ways(self.free, FAR_M)

    def outlines(self) -> Iterator[tuple[str, list[Floats]]]:
        """Yield the polygons: the key of the area, and its rings, (k, 2) m, the outer first."""
        import shapely

        for key in ("no_fly", "fence", "within"):
            area = getattr(self, key)
            for polygon in () if area is None else shapely.get_parts(area):
                rings = (polygon.exterior, *polygon.interiors)
                yield key, [np.array(ring.coords) for ring in rings]

    def allows(self, place: Point) -> bool:
        """Tell whether the UAV may be at a place."""
        import shapely

        return bool(self.free.covers(shapely.Point(place)))

    def forbids(self, place: Point) -> str:
        """Return why the UAV may not be at a place, in words; empty if it may."""
        import shapely

        if self.allows(place):
            return ""
        near = shapely.Point(place).buffer(self.margin_m)
        inside = self.no_fly is not None and self.no_fly.intersects(near)
        if inside:
            return "in a no-fly area or at its edge"
        beyond = self.link is not None and not self.link.covers(near)
        return "beyond uav.link_m" if beyond else "outside the fence or at its edge"

    def connects(self, place: Point, other: Point) -> bool:
        """Tell whether the UAV may fly from one place to another in some way."""
        import shapely

        return self.allows(place) and bool(self.reach(place).covers(shapely.Point(other)))

    def sees(self, place: Point, other: Point) -> bool:
        """Tell whether the UAV may fly straight from one place to another."""
        import shapely

        return bool(self.free.covers(shapely.LineString([place, other])))

    def reach(self, place: Point) -> Area:
        """Return the part of the free space that can be flown to from a place that is in it."""
        import shapely

        parts = shapely.get_parts(self.free)
        return parts[int(np.argmax(shapely.covers(parts, shapely.Point(place))))]

    def searched(self, place: Point) -> Area:
        """Return the part that can be flown to from a place and is to be searched."""
        import shapely

        if place not in self._searched:
            reach = self.reach(place)
            area = reach if self.within is None else _polygons(reach.intersection(self.within))
            shapely.prepare(area)
            self._searched[place] = area
        return self._searched[place]

    def nearest_searched(self, places: Floats, start: Point) -> list[Point]:
        """Return the nearest places to given ones, (k, 2), that are searched from a start."""
        import shapely

        searched = self.searched(start)
        inside = shapely.covers(searched, shapely.points(places))
        return [
            (float(place[0]), float(place[1])) if kept else _nearest(searched, place) or start
            for place, kept in zip(places, inside, strict=True)
        ]

    def roads_searched(self, network: RoadNetwork, place: Point) -> Flags:
        """Return which roads may be flown and are to be searched by who starts at a place, (R,)."""
        import shapely

        lines = [shapely.LineString(network.shape(k)) for k in range(len(network.road_ids))]
        reach = self.reach(place)
        shapely.prepare(reach)
        open_ = shapely.covers(reach, lines)
        if self.within is not None:
            shapely.prepare(self.within)
            open_ &= shapely.covers(self.within, lines)
        return np.asarray(open_, dtype=np.bool_)

    def shortest_path(self, a: Point, b: Point) -> list[Point]:
        """Return the shortest way from one place to another, its points with both ends.

        Raises
        ------
        InputError
            If there is none: a place is forbidden, or cut off.
        """
        path = self.ways.shortest(a, b)
        if path is None:
            raise InputError(
                f"airspace: there is no way from ({a[0]:.8g}, {a[1]:.8g}) to "
                f"({b[0]:.8g}, {b[1]:.8g}) m; correct the areas, or the places"
            )
        return path

    def way_from_flight(self, place: Point, to: Point) -> list[Point]:
        """Return the shortest way on from a place of a flight, which rounding may have moved out.

        Raises
        ------
        InputError
            If there is none.
        """
        if self.allows(place):
            return self.shortest_path(place, to)
        inside = _nearest(self.free, np.array(place)) or place
        return [place, *self.shortest_path(inside, to)[1:]]

    def refuse(self, track: Track) -> None:
        """Do nothing if a flight keeps to the airspace.

        Raises
        ------
        InputError
            If it flies through a no-fly area, leaves the fence, or gets too far from its start.
        """
        import shapely

        line = shapely.LineString(_twice(np.stack([track.x_m, track.y_m], axis=1)))
        if self.no_fly is not None and line.intersects(_grown(self.no_fly, -TOUCH_M)):
            raise InputError("the flight leads through a no-fly area of [airspace]; plan again")
        if self.fence is not None and not _grown(self.fence, TOUCH_M).covers(line):
            raise InputError("the flight leaves the fence of [airspace]; plan again")
        if self.link is not None and not _grown(self.link, TOUCH_M).covers(line):
            raise InputError("the flight gets farther from its start than uav.link_m; plan again")


def _polygons(area: Area) -> Area:
    """Return the polygons of an intersection, without the lines and points where two touch."""
    import shapely

    return shapely.MultiPolygon([part for part in shapely.get_parts(area) if part.area > 0.0])


def _nearest(area: Area, place: Floats) -> Point | None:
    """Return a place in an area near to one outside; None if it is too thin to find any."""
    import shapely

    edge = np.array(shapely.shortest_line(shapely.Point(place), area).coords[-1])
    onward = (edge - place) / np.hypot(*(edge - place))
    for step_m in STEPS_M:  # the edge itself is rounded
        x_m, y_m = (edge + step_m * onward).tolist()
        if area.covers(shapely.Point(x_m, y_m)):
            return x_m, y_m
    return None


def _grown(area: Area, by_m: float) -> Area:
    """Return an area with its edges moved outwards, its corners still corners."""
    return area.buffer(by_m, join_style="mitre", mitre_limit=SHARPEST)


def _twice(points: Floats) -> Floats:
    """Return at least two points: a line needs them."""
    return points if len(points) > 1 else np.repeat(points, 2, axis=0)
