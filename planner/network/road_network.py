"""The road network as columns: nodes, roads with their polylines, and the edges targets drive."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, freeze, rows_taken
from planner.checked import finite, indices, lengths, offsets, weights
from planner.errors import InputError
from planner.network.lines import Lines

POINT_M = 0.02  # lengths in net files have two decimals


@dataclass(frozen=True, eq=False)
class RoadNetwork(Frozen):
    """Nodes and roads as the UAV flies them, edges and turns as a target drives them.

    A road is what the paper calls one: a polyline between two nodes. An edge is SUMO's. On abstract
    nets every edge is its own road; in towns a road is what `planner.network.roads` merges.
    """

    node_ids: tuple[str, ...]  # V names
    node_xy_m: Floats  # (V, 2) metres, x east, y north
    road_ids: tuple[str, ...]  # R names
    road_from: Ints  # (R,) node index
    road_to: Ints  # (R,) node index
    first_point: Offsets  # (R + 1,) where a road's points start in shape_xy_m
    shape_xy_m: Floats  # (P, 2) metres; each road from its first to its last node
    edge_ids: tuple[str, ...]  # E names
    edge_road: Ints  # (E,) road index
    edge_length_m: Floats  # (E,) metres, as SUMO drives it
    edge_limit_mps: Floats  # (E,) speed limit
    edge_lanes: Ints  # (E,) number of lanes a car may use
    first_turn: Offsets  # (E + 1,) where an edge's turns start in turn_edge
    turn_edge: Ints  # (T,) the edge that a turn leads to
    path: Path  # the .net.xml that SUMO loads
    sha256: str  # of that file
    # (R,) metres from the drawn line to where a target may be beside it; left out: none
    half_width_m: Floats = field(default_factory=lambda: np.zeros(0))
    # (R,) whether targets drive a road in its own direction and against it; left out: none
    both_ways: Flags = field(default_factory=lambda: np.zeros(0, bool))
    # (E + 1,) where an edge's points start in edge_shape_xy_m; left out: those of its road
    edge_first_point: Offsets = field(default_factory=lambda: np.zeros(0, np.int64))
    edge_shape_xy_m: Floats = field(default_factory=lambda: np.zeros((0, 2)))  # (Q, 2) metres
    junction_ids: tuple[str, ...] = ()  # J names of the net's own nodes; left out: node_ids
    junction_xy_m: Floats = field(default_factory=lambda: np.zeros((0, 2)))  # (J, 2) metres
    projection: str | None = None  # PROJ's parameters, as the net gives them; None: it has none
    net_offset_m: tuple[float, float] = (0.0, 0.0)  # added to what PROJ makes of lon and lat
    edge_street: tuple[str, ...] = ()  # E names of streets, "" where there is none; left out: none
    # (T,) straight back where there is another way on: taken only by who is said to; left out: none
    turn_back: Flags = field(default_factory=lambda: np.zeros(0, bool))
    # (E,) whether a target that reaches the end has left the map; no turn follows; left out: none
    edge_exit: Flags = field(default_factory=lambda: np.zeros(0, bool))
    closed_edge_ids: tuple[str, ...] = ()  # of edges that no car may use, which have no index
    source: Path | None = None  # the file that the user gave, if it is not ``path``
    attribution: str = ""  # whose data it is: what all that is made from it has to say

    def __post_init__(self) -> None:
        if len(self.half_width_m) == 0:
            object.__setattr__(self, "half_width_m", np.zeros(len(self.road_ids)))
        if len(self.both_ways) == 0:
            object.__setattr__(self, "both_ways", np.zeros(len(self.road_ids), bool))
        if not self.junction_ids:
            object.__setattr__(self, "junction_ids", self.node_ids)
            object.__setattr__(self, "junction_xy_m", self.node_xy_m)
        if len(self.turn_back) == 0:
            object.__setattr__(self, "turn_back", np.zeros(len(self.turn_edge), bool))
        if len(self.edge_exit) == 0:
            object.__setattr__(self, "edge_exit", np.zeros(len(self.edge_ids), bool))
        if len(self.edge_street) == 0:
            object.__setattr__(self, "edge_street", ("",) * len(self.edge_ids))
        freeze(
            self,
            node_xy_m=np.float64,
            road_from=np.int32,
            road_to=np.int32,
            first_point=np.int64,
            shape_xy_m=np.float64,
            edge_road=np.int32,
            edge_length_m=np.float64,
            edge_limit_mps=np.float64,
            edge_lanes=np.int32,
            first_turn=np.int64,
            turn_edge=np.int32,
            half_width_m=np.float64,
            both_ways=np.bool_,
            junction_xy_m=np.float64,
            turn_back=np.bool_,
            edge_exit=np.bool_,
        )
        self._check()
        if len(self.edge_first_point) == 0:
            drawn, first = rows_taken(self.first_point, self.edge_road)
            object.__setattr__(self, "edge_first_point", first)
            object.__setattr__(self, "edge_shape_xy_m", self.shape_xy_m[drawn])
        freeze(self, edge_first_point=np.int64, edge_shape_xy_m=np.float64)
        points = len(self.edge_shape_xy_m)
        offsets("edge_first_point", self.edge_first_point, len(self.edge_ids), points)
        finite(edge_shape_xy_m=self.edge_shape_xy_m)

    def _check(self) -> None:
        nodes, roads, edges = len(self.node_ids), len(self.road_ids), len(self.edge_ids)
        if not roads or not edges:
            raise InputError("road_ids, edge_ids: a network needs a road")
        if self.node_xy_m.shape != (nodes, 2) or self.shape_xy_m.shape[1:] != (2,):
            raise InputError("node_xy_m, shape_xy_m: should be x and y of each node and point")
        road = {"road_from": self.road_from, "road_to": self.road_to}
        lengths(roads, **road, half_width_m=self.half_width_m, both_ways=self.both_ways)
        edge = {"edge_length_m": self.edge_length_m, "edge_limit_mps": self.edge_limit_mps}
        lengths(edges, edge_road=self.edge_road, edge_lanes=self.edge_lanes, **edge)
        lengths(edges, edge_exit=self.edge_exit, edge_street=self.edge_street)
        weights("half_width_m", self.half_width_m)
        offsets("first_point", self.first_point, roads, len(self.shape_xy_m))
        offsets("first_turn", self.first_turn, edges, len(self.turn_edge))
        lengths(len(self.turn_edge), turn_back=self.turn_back)
        if self.junction_xy_m.shape != (len(self.junction_ids), 2):
            raise InputError("junction_xy_m: should be x and y of each junction")
        indices(nodes, **road)
        indices(roads, edge_road=self.edge_road)
        indices(edges, turn_edge=self.turn_edge)
        finite(node_xy_m=self.node_xy_m, shape_xy_m=self.shape_xy_m, **edge)
        if np.any(self.edge_exit & (np.diff(self.first_turn) > 0)):
            raise InputError("edge_exit: a turn leads out of an exit; see `with_exits`")
        finite(junction_xy_m=self.junction_xy_m)

    @cached_property
    def road_lines(self) -> Lines:
        """The roads as they are flown, R lines."""
        return Lines(self.first_point, self.shape_xy_m)

    @cached_property
    def edge_lines(self) -> Lines:
        """The edges as the net draws them, E lines, each from its first to its last junction."""
        return Lines(self.edge_first_point, self.edge_shape_xy_m)

    @property
    def road_length_m(self) -> Floats:
        """Length of each road's polyline, (R,) metres: what the UAV flies."""
        return self.road_lines.length_m

    @cached_property
    def edge_index(self) -> dict[str, int]:
        """Index of each edge by its name."""
        return {name: i for i, name in enumerate(self.edge_ids)}

    @cached_property
    def road_index(self) -> dict[str, int]:
        """Index of each road by its name."""
        return {name: i for i, name in enumerate(self.road_ids)}

    @cached_property
    def node_index(self) -> dict[str, int]:
        """Index of each node by its name."""
        return {name: i for i, name in enumerate(self.node_ids)}

    @cached_property
    def junction_index(self) -> dict[str, int]:
        """Index of each of the net's own nodes by its name."""
        return {name: i for i, name in enumerate(self.junction_ids)}

    def turns(self, edge: int, *, back: bool = False) -> Ints:
        """Return the edges that a target may drive after ``edge``, (k,).

        Parameters
        ----------
        back
            Whether to return ways straight back as well where there is another way on.
        """
        ways = slice(self.first_turn[edge], self.first_turn[edge + 1])
        return self.turn_edge[ways] if back else self.turn_edge[ways][~self.turn_back[ways]]

    @property
    def given_as(self) -> Path:
        """The file that messages name: the user's own."""
        return self.source or self.path

    @property
    def credit(self) -> dict[str, str]:
        """Whose data it is, as files hold it: an entry, or none where nothing has to be said."""
        return {"attribution": self.attribution} if self.attribution else {}

    @cached_property
    def is_abstract(self) -> bool:
        """Whether edges run straight from node to node: junctions are points, all is exact."""
        straight = len(self.edge_shape_xy_m) == 2 * len(self.edge_ids)
        away_m = self.edge_length_m - self.edge_lines.length_m
        return straight and bool(np.all(np.abs(away_m) <= POINT_M))

    @cached_property
    def is_merged(self) -> bool:
        """Whether roads are made of several edges; else they are the edges."""
        return self.road_ids != self.edge_ids

    @cached_property
    def closed_edges(self) -> frozenset[str]:
        """Names of the edges that no car may use."""
        return frozenset(self.closed_edge_ids)

    def shape(self, road: int) -> Floats:
        """Return a road's polyline, (k, 2) metres."""
        return self.road_lines[road]

    def edge_shape(self, edge: int) -> Floats:
        """Return an edge's polyline, (k, 2) metres."""
        return self.edge_lines[edge]

    def xy(self, road: Ints | int, distance_m: Floats | float) -> Floats:
        """Return the points at given distances along roads, (..., 2) metres.

        Distances below zero or beyond a road's length give its ends.
        """
        return self.road_lines.at(road, distance_m)

    def edge_xy(self, edge: Ints | int, distance_m: Floats | float) -> Floats:
        """Return the points of the drawn edges at distances as SUMO measures them, (..., 2) metres.

        SUMO's length of an edge may differ from the drawn one; distances are scaled.
        """
        share = np.asarray(distance_m) / self.edge_length_m[edge]
        return self.edge_lines.at(edge, share * self.edge_lines.length_m[edge])
