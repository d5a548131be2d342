"""SUMO's floating car data as it lies on disk (XML, CSV, Parquet): the same columns of each."""

import logging
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Flags, Floats
from planner.clock import seconds
from planner.errors import InputError
from planner.parquet import (
    Coded,
    coded,
    column,
    numbers_or_nan,
    one_line,
    read_table,
    refuse_twice,
    seconds_or_nan,
    texts,
)
from planner.xml_guard import xml_elements

log = logging.getLogger(__name__)

REMEDY = "write it with `sumo --fcd-output FILE.parquet` (or .xml, .csv)"
TEXTS = ("vehicle_id", "vehicle_lane", "vehicle_edge", "vehicle_type")
NO_HEADER = (
    "SUMO writes it so where nobody is there in the first step: begin when the first one is "
    "(--begin), or write Parquet or XML"
)
# SUMO's names for the types of those who are no vehicles, where they stand among them.
NO_VEHICLES = ("DEFAULT_PEDTYPE", "DEFAULT_CONTAINERTYPE")
UNKNOWN = -1073741824.0  # what SUMO writes for a number that it does not have


class Rows(NamedTuple):
    """Vehicles at sampled times, in the file's order."""

    vehicle: Coded  # (S,) their names
    time_s: Floats  # (S,) seconds, NaN where the file holds none
    x_m: Floats  # (S,) metres, NaN where the file holds none
    y_m: Floats  # (S,) metres, NaN where the file holds none
    speed_mps: Floats  # (S,) m/s, NaN where not recorded
    along_m: Floats  # (S,) metres driven on the edge, NaN where not recorded
    edge: Coded  # (S,) names of edges, of junctions' insides too
    on_lanes: bool  # False: SUMO drove from edge to edge only (its mesoscopic model)

    def take(self, kept: Flags) -> "Rows":
        """Return some of the rows."""
        return Rows(
            self.vehicle._replace(code=self.vehicle.code[kept]),
            self.time_s[kept],
            self.x_m[kept],
            self.y_m[kept],
            self.speed_mps[kept],
            self.along_m[kept],
            self.edge._replace(code=self.edge.code[kept]),
            self.on_lanes,
        )


def read_rows(path: Path) -> Rows:
    """Return the rows of an FCD file: Parquet or CSV by its suffix, else XML.

    CSV and XML may be gzipped.

    Persons and containers are left out, with a line in the log.

    Raises
    ------
    InputError
        If the file is no FCD.
    """
    if path.suffix == ".parquet":
        return rows_of_table(path, read_table(path, texts=TEXTS))
    if path.suffixes[-1:] == [".csv"] or path.suffixes[-2:] == [".csv", ".gz"]:
        return rows_of_table(path, _csv_table(path))
    return _xml_rows(path)


def rows_of_table(path: Path, table: Any) -> Rows:
    """Return the rows of FCD as a pyarrow table, with the columns of SUMO's Parquet.

    Raises
    ------
    InputError
        If a column is missing, or holds something else.
    """
    table = _of_vehicles(path, _renamed(table))
    vehicle = texts(path, table, "vehicle_id")
    lane, edge, kind = (_texts(path, table, name) for name in TEXTS[1:])
    is_person = _no_vehicles(lane, edge, kind)
    _tell_left_out(path, {vehicle.values[k] for k in np.unique(vehicle.code[is_person])})
    rows = Rows(
        vehicle,
        seconds_or_nan(path, table, "timestep_time"),
        numbers_or_nan(path, table, "vehicle_x"),
        numbers_or_nan(path, table, "vehicle_y"),
        _known(path, table, "vehicle_speed"),
        _known(path, table, "vehicle_pos"),
        _edges(lane, edge),
        bool((lane.code >= 0).any()),
    )
    out = is_person | _astray(lane, edge)
    return rows.take(~out) if out.any() else rows


def _renamed(table: Any) -> Any:
    """Return a table with the names of vehicles' columns: SUMO takes those of who comes first."""
    for who in ("person", "container"):
        if f"{who}_id" in table.column_names and "vehicle_id" not in table.column_names:
            names = [name.replace(f"{who}_", "vehicle_", 1) for name in table.column_names]
            return table.rename_columns(names)
    return table


def _astray(lane: Coded, edge: Coded) -> Flags:
    """Return which rows are inside a junction but on no lane: SUMO does not know their place."""
    inside = np.array([word.startswith(":") for word in edge.values] + [False])
    return np.asarray(inside[edge.code] & (lane.code < 0))


def _of_vehicles(path: Path, table: Any) -> Any:
    """Return a table without the rows of nulls that stand for steps without vehicles."""
    import pyarrow.compute

    named = pyarrow.compute.is_valid(column(path, table, "vehicle_id"))
    if pyarrow.compute.all(named).as_py() is not False:
        return table
    nameless = table.filter(pyarrow.compute.invert(named))
    placed = nameless.filter(pyarrow.compute.is_valid(column(path, nameless, "vehicle_x")))
    if len(placed):
        raise InputError(
            f"{path}: {len(placed)} rows have a place but no vehicle_id (null); name the vehicle, "
            "or remove them"
        )
    return table.filter(named)


def _texts(path: Path, table: Any, name: str) -> Coded:
    if name in table.column_names:
        return texts(path, table, name)
    return Coded((), np.full(len(table), -1))


def _known(path: Path, table: Any, name: str) -> Floats:
    """Return a column of numbers, NaN where they are not known; all are where there is none."""
    if name not in table.column_names:
        return np.full(len(table), np.nan)
    return _unless_unknown(numbers_or_nan(path, table, name))


def _unless_unknown(values: Floats) -> Floats:
    unknown = ~(np.abs(values - UNKNOWN) >= 1.0) | np.isinf(values)
    return np.where(unknown, np.nan, values) if unknown.any() else values


def _no_vehicles(lane: Coded, edge: Coded, kind: Coded) -> Flags:
    """Return which rows are of persons and containers, (S,).

    Where SUMO drives on lanes, these alone have an edge and no lane.
    """
    named = np.array([word in NO_VEHICLES for word in kind.values] + [False])[kind.code]
    on_lanes = np.array([word != "" for word in lane.values] + [False])[lane.code]
    if not on_lanes.any():
        return named
    off_lanes = np.array([word != "" for word in edge.values] + [False])[edge.code]
    return np.asarray(named | (off_lanes & ~on_lanes))


def _edges(lane: Coded, edge: Coded) -> Coded:
    """Return each row's edge: that of its lane, or where it has no lane, its own."""
    of_lane = coded([word.rpartition("_")[0] or None for word in lane.values], lane.code)
    if not edge.values:
        return of_lane
    own = coded([word or None for word in edge.values], edge.code)
    both = (*of_lane.values, *own.values)
    code = np.where(own.code >= 0, own.code + len(of_lane.values), -1)
    return coded(both, np.where(of_lane.code >= 0, of_lane.code, code))


def _tell_left_out(path: Path, names: Iterable[str]) -> None:
    """Say how many persons and containers a file holds, if any."""
    known = sorted(names)
    if known:
        log.warning(
            "%s: left out: persons and containers, which are no vehicles (%d, the first %r)",
            path,
            len(known),
            known[0],
        )


def _csv_table(path: Path) -> Any:
    """Return a CSV file as a pyarrow table, of texts and floats."""
    import pyarrow
    import pyarrow.csv

    try:
        with pyarrow.input_stream(str(path), compression="detect") as file:
            head = file.read(1 << 16).split(b"\n")[0]
        separator = max(";,\t", key=lambda one: head.count(one.encode()))
        names = head.decode("utf-8-sig").strip().replace('"', "").split(separator)
        if names == ["timestep_time"]:
            raise InputError(f"{path}: its header names no vehicle; {NO_HEADER}")
        refuse_twice(path, names)
        kinds = {name: pyarrow.string() for name in ("timestep_time", *TEXTS)}
        kinds |= {f"vehicle_{name}": pyarrow.float64() for name in ("x", "y", "speed", "pos")}
        for who in ("person", "container"):
            kinds |= {name.replace("vehicle", who): kind for name, kind in kinds.items()}
        with pyarrow.input_stream(str(path), compression="detect") as file:
            return pyarrow.csv.read_csv(
                file,
                parse_options=pyarrow.csv.ParseOptions(delimiter=separator),
                convert_options=pyarrow.csv.ConvertOptions(
                    column_types=kinds,
                    null_values=[""],
                    strings_can_be_null=True,
                    include_columns=[name for name in names if name in kinds],
                ),
            )
    except (pyarrow.ArrowException, OSError, UnicodeDecodeError) as error:
        text = one_line(error)
        raise InputError(f"{path}: is no floating car data ({text}); {REMEDY}") from error


class _XmlRows:
    """The rows of XML in the making."""

    def __init__(self) -> None:
        self.names: dict[str, int] = {}
        self.edges: dict[str, int] = {}
        self.vehicle: list[int] = []
        self.edge: list[int] = []
        self.numbers: list[tuple[float, float, float, float, float]] = []
        self.no_vehicles: set[str] = set()
        self.on_lanes = False

    def add(self, timestep: Any) -> None:
        """Take in a step."""
        time_s = seconds(timestep.attrib["time"])
        for element in timestep:
            said = element.attrib
            if element.tag != "vehicle":
                self.no_vehicles.add(said.get("id", ""))
                continue
            if said.get("edge", "").startswith(":") and "lane" not in said:
                continue  # as `_astray`
            numbers = (said["x"], said["y"], said.get("speed", "nan"), said.get("pos", "nan"))
            x, y, speed, pos = map(float, numbers)
            self.numbers.append((time_s, x, y, speed, pos))
            self.vehicle.append(self.names.setdefault(said["id"], len(self.names)))
            lane = said.get("lane", "")
            edge = lane.rpartition("_")[0] if lane else said.get("edge", "")
            self.on_lanes |= lane != ""
            self.edge.append(self.edges.setdefault(edge, len(self.edges)))

    def rows(self) -> Rows:
        """Return what was taken in."""
        numbers = np.array(self.numbers, dtype=np.float64).reshape(-1, 5).T
        time_s, x_m, y_m, speed_mps, along_m = map(np.ascontiguousarray, numbers)
        edges = [edge or None for edge in self.edges]
        return Rows(
            Coded(tuple(self.names), np.array(self.vehicle, dtype=np.int32)),
            time_s,
            x_m,
            y_m,
            _unless_unknown(speed_mps),
            _unless_unknown(along_m),
            coded(edges, np.array(self.edge, dtype=np.int32)),
            self.on_lanes,
        )


def _xml_rows(path: Path) -> Rows:
    rows = _XmlRows()
    try:
        for element in xml_elements(path):
            if element.tag == "timestep":
                rows.add(element)
                element.clear()
    except InputError as error:
        raise InputError(f"{error}; {REMEDY}") from error
    except (KeyError, ValueError) as error:
        text = f"an element lacks {error}" if isinstance(error, KeyError) else one_line(error)
        raise InputError(f"{path}: is no floating car data ({text}); {REMEDY}") from error
    _tell_left_out(path, rows.no_vehicles)
    return rows.rows()
