"""Where the map ends: edges at whose end a vehicle has left the net.

A net is cut out of a larger one. At its edge netconvert leaves dead ends and lets vehicles turn
round there, which no driver does.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.arrays import Flags, Floats, first_kept
from planner.errors import InputError
from planner.network.road_network import RoadNetwork
from planner.network.street_names import no_edge

NEAR_HULL_M = 100.0  # an end as near to the convex hull of all roads lies at the edge of the map
FREE_DEG = 150.0  # and so does one before which so wide a sector holds no road
AROUND_M = 1500.0  # radius of the sector
OWN_M = 30.0  # what is nearer to the end tells no direction: it is the road itself
APART_M = 50.0  # between the points by which roads are looked for
MOST_POINTS = 2_000_000  # of these; on 100,000 km of roads and more they stand farther apart


def found_exits(shapes: Sequence[Floats], leads_on: Flags) -> Flags:
    """Return which edges end at the edge of the map, (E,).

    Such an edge leads nowhere but straight back, and its end lies within `NEAR_HULL_M` of the
    convex hull of all edges, or has `FREE_DEG` free of roads before it.

    Parameters
    ----------
    shapes
        (k, 2) metres each: the E edges' lines, in driving order.
    leads_on
        (E,) whether another edge than its own way back follows.
    """
    dead = np.flatnonzero(~leads_on)
    exits = np.zeros(len(shapes), bool)
    if len(dead):
        ends_m = np.array([shapes[edge][-1] for edge in dead.tolist()])
        at_hull = _hull_distance_m(ends_m, np.concatenate(shapes)) <= NEAR_HULL_M
        exits[dead] = at_hull | (_free_deg(ends_m, shapes) >= FREE_DEG)
    return exits


def _hull_distance_m(places_m: Floats, points_m: Floats) -> Floats:
    """Return how far places lie from the outline of the convex hull of points, (k,) metres."""
    import shapely

    hull = shapely.convex_hull(shapely.MultiPoint(points_m))
    # The hull of a single straight road is a line, which has no outline but itself.
    outline = hull.exterior if isinstance(hull, shapely.Polygon) else hull
    return np.asarray(shapely.distance(outline, shapely.points(places_m)), dtype=np.float64)


def _free_deg(places_m: Floats, shapes: Sequence[Floats]) -> Floats:
    """Return how wide the widest sector without roads is, seen from each place, (k,) degrees."""
    from scipy.spatial import KDTree

    alongs_m = [_along_m(shape) for shape in shapes]
    apart_m = max(APART_M, sum(float(along_m[-1]) for along_m in alongs_m) / MOST_POINTS)
    points_m = np.concatenate(
        [_resampled(*line, apart_m) for line in zip(shapes, alongs_m, strict=True)]
    )
    around = KDTree(points_m).query_ball_point(places_m, AROUND_M)
    return np.array(
        [_widest_deg(points_m[near] - place) for place, near in zip(places_m, around, strict=True)]
    )


def _along_m(shape_m: Floats) -> Floats:
    steps_m = np.linalg.norm(np.diff(shape_m, axis=0), axis=1)
    return np.concatenate(([0.0], np.cumsum(steps_m)))


def _resampled(shape_m: Floats, along_m: Floats, apart_m: float) -> Floats:
    """Return points along a line, about as far apart as given, its ends among them."""
    at_m = np.linspace(0.0, along_m[-1], max(2, int(along_m[-1] / apart_m) + 1))
    return np.stack([np.interp(at_m, along_m, shape_m[:, axis]) for axis in (0, 1)], axis=1)


def _widest_deg(away_m: Floats) -> float:
    """Return the widest angle between the directions of points that follow one another, degrees."""
    away_m = away_m[np.hypot(*away_m.T) > OWN_M]
    if len(away_m) == 0:
        return 360.0
    angles = np.sort(np.arctan2(away_m[:, 1], away_m[:, 0]))
    return float(np.degrees(np.max(np.diff(np.append(angles, angles[0] + 2.0 * np.pi)))))


def with_exits(network: RoadNetwork, edge_exit: Flags) -> RoadNetwork:
    """Return a network with exits: whoever reaches the end of one has left, and no turn follows.

    Parameters
    ----------
    network
        Without any so far.
    edge_exit
        (E,) which edges are exits.
    """
    if not edge_exit.any():
        return network
    kept = np.repeat(~edge_exit, np.diff(network.first_turn))
    return replace(
        network,
        edge_exit=edge_exit,
        first_turn=first_kept(network.first_turn, kept),
        turn_edge=network.turn_edge[kept],
        turn_back=network.turn_back[kept],
    )


def named_exits(network: RoadNetwork, names: Sequence[str]) -> Flags:
    """Return which edges of a network have the names given, (E,).

    Raises
    ------
    InputError
        If one is none of its edges.
    """
    exits = np.zeros(len(network.edge_ids), bool)
    for name in names:
        if name not in network.edge_index:
            raise InputError(f"{network.given_as}: exits: {name} {no_edge(name, network)}")
        exits[network.edge_index[name]] = True
    return exits
