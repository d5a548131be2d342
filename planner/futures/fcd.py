"""SUMO's floating car data (FCD, XML or Parquet) as columns."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from planner.arrays import Floats, Frozen, Ints, freeze
from planner.errors import InputError
from planner.futures.futures import NO_EDGE
from planner.network.road_network import RoadNetwork
from planner.parquet import indices

REMEDY = "write it with `sumo --fcd-output FILE.parquet` (or .xml)"


@dataclass(frozen=True, eq=False)
class Samples(Frozen):
    """Vehicles at sampled times, sorted by vehicle, then time."""

    names: tuple[str, ...]  # of the vehicles, in the order of their numbers
    vehicle: Ints  # (S,) number of the vehicle
    time_s: Floats  # (S,) seconds
    x_m: Floats  # (S,) metres
    y_m: Floats  # (S,) metres
    speed_mps: Floats  # (S,) in the step that ends at the sample; NaN where not recorded
    edge: Ints  # (S,) edge index; a junction's inside counts to the edge after it
    along_m: Floats  # (S,) metres driven on the edge; NaN where not recorded

    def __post_init__(self) -> None:
        freeze(
            self,
            vehicle=np.int32,
            time_s=np.float64,
            x_m=np.float64,
            y_m=np.float64,
            speed_mps=np.float64,
            edge=np.int32,
            along_m=np.float64,
        )


def read_samples(path: Path, network: RoadNetwork) -> Samples:
    """Return the samples of an FCD file, ``.parquet`` or ``.xml`` (also gzipped).

    Raises
    ------
    InputError
        If the file is missing, is no FCD, or names edges that are not in the network.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; {REMEDY}")
    columns = _parquet_columns(path) if path.suffix == ".parquet" else _xml_columns(path)
    if len(columns["id"]) == 0:
        raise InputError(f"{path}: holds no vehicle; {REMEDY}")
    if not all(np.isfinite(columns[name]).all() for name in ("time", "x", "y")):
        raise InputError(f"{path}: holds a time or a place that is not finite (NaN); {REMEDY}")
    names, vehicle = _codes(columns["id"])
    order = np.lexsort((columns["time"], vehicle))
    columns = {name: column[order] for name, column in columns.items() if name != "id"}
    vehicle = vehicle[order]
    edge, along_m = _places(path, columns, vehicle, network)
    return Samples(
        names=names,
        vehicle=vehicle,
        time_s=columns["time"],
        x_m=columns["x"],
        y_m=columns["y"],
        speed_mps=columns["speed"],
        edge=edge,
        along_m=along_m,
    )


def _parquet_columns(path: Path) -> dict[str, Any]:
    import pyarrow
    import pyarrow.compute
    import pyarrow.parquet

    try:
        text = ["vehicle_id", "vehicle_lane"]
        table = pyarrow.parquet.ParquetFile(path, read_dictionary=text).read()
        # Steps without vehicles are rows of nulls.
        table = table.filter(pyarrow.compute.is_valid(table["vehicle_id"]))
        columns: dict[str, Any] = {
            "time": _numbers(table["timestep_time"]),
            "x": _numbers(table["vehicle_x"]),
            "y": _numbers(table["vehicle_y"]),
            "id": _texts(table["vehicle_id"]),
        }
        for name in ("speed", "pos"):
            known = f"vehicle_{name}" in table.column_names
            unknown = np.full(len(table), np.nan)
            columns[name] = _numbers(table[f"vehicle_{name}"]) if known else unknown
        known = "vehicle_lane" in table.column_names
        columns["lane"] = _texts(table["vehicle_lane"]) if known else np.full(len(table), "")
    except (pyarrow.ArrowException, OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path}: is no floating car data ({error}); {REMEDY}") from error
    return columns


def _numbers(column: Any) -> Floats:
    """Return a column as numbers, NaN where it is null.

    pyarrow's own way to NumPy would load pandas, half a second in every process that runs SUMO.
    """
    import pyarrow
    import pyarrow.compute

    floats = column.cast(pyarrow.float64())
    if floats.null_count:
        floats = pyarrow.compute.fill_null(floats, np.nan)
    return np.asarray(np.from_dlpack(floats.combine_chunks()))


def _texts(column: Any) -> npt.NDArray[Any]:
    """Return a column of texts, "" where it is null."""
    encoded = column.combine_chunks()
    values = np.array([*encoded.dictionary.to_pylist(), ""], dtype=object)
    return np.asarray(values[indices(encoded)])


def _xml_columns(path: Path) -> dict[str, Any]:
    import gzip
    import zlib
    from xml.etree import ElementTree

    rows: list[tuple[str, float, float, float, float, float, str]] = []
    opened: Any = gzip.open if path.suffix == ".gz" else open
    try:
        with opened(path, "rb") as file:
            for _, element in ElementTree.iterparse(file):
                if element.tag == "timestep":
                    rows += _xml_rows(element)
                    element.clear()
    except (ElementTree.ParseError, KeyError, ValueError, OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path}: is no floating car data ({error}); {REMEDY}") from error
    names = ("id", "time", "x", "y", "speed", "pos", "lane")
    kinds = (object, float, float, float, float, float, object)
    columns = zip(*rows, strict=True) if rows else [[]] * len(names)
    return {
        name: np.array(column, dtype=kind)
        for name, column, kind in zip(names, columns, kinds, strict=True)
    }


def _xml_rows(timestep: Any) -> Iterable[tuple[str, float, float, float, float, float, str]]:
    time_s = float(timestep.attrib["time"])
    for vehicle in timestep.iter("vehicle"):
        said = vehicle.attrib
        numbers = (said["x"], said["y"], said.get("speed", "nan"), said.get("pos", "nan"))
        x, y, speed, pos = map(float, numbers)
        yield said["id"], time_s, x, y, speed, pos, said.get("lane", "")


def _codes(names: npt.NDArray[Any]) -> tuple[tuple[str, ...], Ints]:
    """Return the distinct names in order of appearance, and each row's number among them."""
    number: dict[str, int] = {}
    codes = [number.setdefault(str(name), len(number)) for name in names]
    return tuple(number), np.array(codes, dtype=np.int32)


def _places(
    path: Path, columns: dict[str, Any], vehicle: Ints, network: RoadNetwork
) -> tuple[Ints, Floats]:
    names, code = _codes(columns["lane"])
    edge_names = [name.rpartition("_")[0] for name in names]
    unknown = sorted(
        {edge for edge in edge_names if edge and edge[0] != ":" and edge not in network.edge_index}
    )
    if unknown:
        raise InputError(
            f"{path}: edge {unknown[0]!r} is not in {network.path.name} (nor are "
            f"{len(unknown) - 1} others); give the net that the file was recorded on"
        )
    of_lane = np.array(
        [network.edge_index.get(edge, NO_EDGE) for edge in edge_names], dtype=np.int32
    )
    inside = np.array([edge.startswith(":") for edge in edge_names])[code]
    return _out_of_junctions(of_lane[code], columns["pos"], vehicle, network, inside)


def _out_of_junctions(
    edge: Ints, along_m: Floats, vehicle: Ints, network: RoadNetwork, inside: npt.NDArray[np.bool_]
) -> tuple[Ints, Floats]:
    """Put samples inside a junction at the start of the edge that their vehicle enters next.

    A vehicle last seen inside a junction stays at the end of the edge that it has left.
    """
    rows = np.arange(len(edge))
    after = np.minimum.accumulate(np.where(inside, len(edge), rows)[::-1])[::-1]
    before = np.maximum.accumulate(np.where(inside, -1, rows))
    entered = after < len(edge)
    entered[entered] = vehicle[after[entered]] == vehicle[entered]
    left = ~entered & (before >= 0)
    left[left] = vehicle[before[left]] == vehicle[left]
    place = np.where(entered, after, np.where(left, before, rows))
    on = edge[place]
    end_m = np.where(on == NO_EDGE, np.nan, network.edge_length_m[on])
    return on, np.where(inside, np.where(left, end_m, 0.0), along_m)
