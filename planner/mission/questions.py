"""What can be asked of a target: questions, and which answer is true of each particle."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from planner.arrays import Floats, Ints
from planner.detection.first_detection import first_detection
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork

ROADS = 4  # first roads that are told apart; all others are one answer
CAMERA_M = 50.0  # how far a camera at a node sees
CAMERAS = 8  # nodes that are tried where nobody names any
CLASSES = ("slower", "usual", "faster")  # thirds of the speeds
CLASS_S = 60.0  # by how far it gets in that time a target's speed is told
OTHER = "another"
ALWAYS = 0.02  # or less: what nearly every target passes, or none, is not asked


@dataclass(frozen=True)
class Question:
    """Something that somebody may know of the target."""

    asked: str
    answers: tuple[str, ...]
    of: Callable[[Futures], Ints]  # which answer is true of each particle, (N,)


def usual_questions(
    believed: Futures, network: RoadNetwork, at_s: float, cameras: Sequence[int] = ()
) -> list[Question]:
    """Return what can be asked of any target.

    Parameters
    ----------
    believed
        Particles, by which the questions are chosen.
    at_s
        Which time is asked about, seconds on the target's clock.
    cameras
        Junctions that have one; empty: some that about every other target passes.
    """
    found = [side(believed, at_s), first_road(believed, network), speed_class(believed)]
    nodes = [*cameras] or _passed_by_half(believed, network, at_s)
    return [*found, *(camera(network, node, at_s) for node in nodes)]


def side(believed: Futures, at_s: float) -> Question:
    """Return the question on which side of the middle a target is, across where they spread."""
    xy_m = believed.positions(at_s)
    there = np.isfinite(xy_m[:, 0])
    if there.sum() < 2:
        return Question("which side", ("here", "there"), lambda of: np.zeros(len(of), np.int64))
    middle_m = np.average(xy_m[there], axis=0, weights=believed.weight[there])
    spread = np.cov((xy_m[there] - middle_m).T, aweights=believed.weight[there])
    along = np.linalg.eigh(spread)[1][:, -1]
    along = along if along[0] + 1e-9 * along[1] >= 0.0 else -along
    names = ("west or south", "east or north")
    if along[1] < 0.0:
        names = ("west or north", "east or south")

    def of(futures: Futures) -> Ints:
        return np.asarray((futures.positions(at_s) - middle_m) @ along > 0.0, dtype=np.int64)

    return Question("on which side of the middle is it", names, of)


def first_road(believed: Futures, network: RoadNetwork) -> Question:
    """Return the question which road it took after its first one."""
    roads = _second_edge(believed)
    known = roads[roads >= 0]
    counts = np.bincount(known, weights=believed.weight[roads >= 0], minlength=1)
    most = [int(edge) for edge in np.argsort(-counts, kind="stable")[:ROADS] if counts[edge] > 0.0]
    names = [network.edge_street[edge] or network.edge_ids[edge] for edge in most]

    def of(futures: Futures) -> Ints:
        edges = _second_edge(futures)
        answer = np.full(len(edges), len(most))
        for number, edge in enumerate(most):
            answer[edges == edge] = number
        return answer

    return Question("which road did it turn into first", (*names, OTHER), of)


def speed_class(believed: Futures) -> Question:
    """Return the question how fast it drove at first."""
    limits = np.quantile(_speeds(believed), [1.0 / 3.0, 2.0 / 3.0])

    def of(futures: Futures) -> Ints:
        return np.asarray(np.searchsorted(limits, _speeds(futures)), dtype=np.int64)

    low, high = limits.tolist()
    return Question(f"how fast did it drive: below {low:.0f}, above {high:.0f} m/s", CLASSES, of)


def camera(network: RoadNetwork, node: int, at_s: float) -> Question:
    """Return the question whether a camera at a junction has seen it by a time."""
    x_m, y_m = network.junction_xy_m[node].tolist()

    def of(futures: Futures) -> Ints:
        return _passed(futures, x_m, y_m, at_s)

    asked = f"did it pass {network.junction_ids[node]}"
    return Question(asked, ("no", "yes"), of)


def _second_edge(futures: Futures) -> Ints:
    """Return the edge that each particle drives after its first one, (N,); -1: there is none."""
    first, count = futures.edges.first_change[:-1], np.diff(futures.edges.first_change)
    found = np.full(len(futures), -1, dtype=np.int64)
    found[count > 1] = futures.edges.edge[first[count > 1] + 1]
    return found


def _speeds(futures: Futures) -> Floats:
    """Return how fast each particle gets away from where it is first, (N,) m/s."""
    count = np.diff(futures.first_knot)
    begins_s = np.zeros(len(futures))
    begins_s[count > 0] = futures.time_s[futures.first_knot[:-1][count > 0]]
    step_m = futures.positions(begins_s + CLASS_S) - futures.positions(begins_s)
    return np.asarray(np.nan_to_num(np.hypot(*step_m.T) / CLASS_S))


def _passed(futures: Futures, x_m: float, y_m: float, at_s: float) -> Ints:
    spent = np.array([0.0, at_s])
    watch = Track(spent, np.full(2, x_m), np.full(2, y_m), spent[None, :])
    return np.asarray(np.isfinite(first_detection(futures, watch, CAMERA_M)), dtype=np.int64)


def _passed_by_half(believed: Futures, network: RoadNetwork, at_s: float) -> list[int]:
    """Return the junctions that nearest to every other target passes."""
    first = believed.take(np.arange(min(len(believed), 500)))
    total = float(first.weight.sum()) or 1.0
    nodes = _near_targets(first, network, at_s)
    share = [float(first.weight @ camera(network, node, at_s).of(first)) / total for node in nodes]
    order = np.argsort(np.abs(np.array(share) - 0.5), kind="stable")
    return [nodes[k] for k in order[:CAMERAS] if ALWAYS < share[k] < 1.0 - ALWAYS]


def _near_targets(some: Futures, network: RoadNetwork, at_s: float) -> list[int]:
    """Return junctions near which many knots of targets lie by a time, no more than a hundred."""
    knots = some.time_s <= at_s
    places_m = np.stack([some.x_m[knots], some.y_m[knots]], axis=1)
    if len(places_m) == 0:
        return []
    node = cKDTree(network.junction_xy_m).query(places_m)[1]
    counts = np.bincount(node, minlength=len(network.junction_ids))
    order = np.argsort(-counts, kind="stable")[:100]
    return sorted(int(one) for one in order if counts[one])
