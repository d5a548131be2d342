"""The same table, as pandas, polars and DuckDB write it and in any types, is the same futures."""

from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import InputError
from planner.futures.futures import Futures
from planner.futures.store import read_recording
from support.instances import figure3

NET = figure3()
# Two vehicles on AB, one of which turns into BC; ids with gaps, one of seven digits.
FCD: dict[str, list[Any]] = {
    "timestep_time": [0.0, 0.0, 100.0, 200.0, 200.0, 300.0],
    "vehicle_id": [7, 1000003, 7, 7, 1000003, 7],
    "vehicle_x": [1000.0, 0.0, 3000.0, 5000.0, 2000.0, 6561.5],
    "vehicle_y": [0.0, 0.0, 0.0, 0.0, 0.0, 1249.2],
    "vehicle_speed": [20.0, 10.0, 20.0, 20.0, 10.0, 20.0],
    "vehicle_pos": [1000.0, 0.0, 3000.0, 5000.0, 2000.0, 2000.0],
    "vehicle_lane": ["AB_0", "AB_0", "AB_0", "AB_0", "AB_0", "BC_0"],
}
KNOTS: dict[str, list[Any]] = {
    "particle": [0, 0, 2, 2, 1000003],
    "time_s": [0.0, 400.0, 0.0, 400.0, 50.0],
    "x_m": [0.0, 4000.0, 0.0, 4800.0, 2500.0],
    "y_m": [0.0] * 5,
}
FLOATS = {
    "float32": pa.float32(),
    "float64": pa.float64(),
    "int64": pa.int64(),
    "uint16": pa.uint16(),
    "decimal": pa.decimal128(18, 3),
    "text": pa.string(),
}
TIMES = {
    **FLOATS,
    "duration[s]": pa.duration("s"),
    "duration[us]": pa.duration("us"),
    "duration[ns]": pa.duration("ns"),
    "time of day, ms": pa.time32("ms"),
    "time of day, ns": pa.time64("ns"),
}
NAMES = {
    "int32": pa.int32(),
    "uint64": pa.uint64(),
    "double": pa.float64(),
    "string": pa.string(),
    "large_string": pa.large_string(),
    "string_view": pa.string_view(),
    "binary": pa.binary(),
    "dictionary": pa.dictionary(pa.int8(), pa.large_string()),
    "dictionary of numbers": pa.dictionary(pa.int32(), pa.int64()),
}


def cast(values: list[Any], kind: pa.DataType) -> pa.Array:
    if pa.types.is_duration(kind) or pa.types.is_time(kind):
        factor = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[kind.unit]
        whole = pa.int32() if kind.bit_width == 32 else pa.int64()
        return pa.array([int(value * factor) for value in values], whole).cast(kind)
    if pa.types.is_decimal(kind):
        return pa.array([Decimal(str(value)) for value in values], kind)
    if pa.types.is_binary(kind):
        return pa.array([str(value).encode() for value in values], kind)
    if pa.types.is_dictionary(kind):
        return cast(values, kind.value_type).dictionary_encode().cast(kind)
    if pa.types.is_string(kind) or pa.types.is_large_string(kind) or kind == pa.string_view():
        return pa.array([str(value) for value in values], kind)
    return pa.array(values).cast(kind, safe=False)


def same(one: Futures, other: Futures, tolerance: float = 0.0) -> None:
    for name in ("time_s", "x_m", "y_m", "first_knot", "weight", "gone"):
        columns = getattr(one, name), getattr(other, name)
        np.testing.assert_allclose(*columns, atol=tolerance, rtol=0, err_msg=name)
    for name in ("first_change", "time_s", "edge"):
        columns = getattr(one.edges, name), getattr(other.edges, name)
        np.testing.assert_allclose(*columns, atol=tolerance, rtol=0, err_msg=f"edges.{name}")


def read(folder: Path, table: pa.Table) -> Futures:
    path = folder / "motion.parquet"
    pq.write_table(table, path)
    return read_recording(path, NET).futures


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("writers")


def test_the_values_themselves(folder: Path) -> None:
    fcd = read(folder, pa.table(FCD))
    assert len(fcd) == 2
    assert fcd.weight.tolist() == [0.5, 0.5]
    assert fcd.xy(0, 150.0).tolist() == pytest.approx([4000.0, 0.0])
    assert fcd.xy(1, 100.0).tolist() == pytest.approx([1000.0, 0.0])
    knots = read(folder, pa.table(KNOTS))
    assert knots.weight.tolist() == [1 / 3] * 3
    assert knots.first_knot.tolist() == [0, 2, 4, 5]
    assert knots.xy(1, 200.0).tolist() == [2400.0, 0.0]


@given(
    time=st.sampled_from(sorted(TIMES)),
    x=st.sampled_from(sorted(FLOATS)),
    name=st.sampled_from(sorted(NAMES)),
    lane=st.sampled_from(["string", "large_string", "string_view", "binary", "dictionary"]),
    chunks=st.integers(1, 3),
)
def test_types_do_not_matter(
    folder: Path, time: str, x: str, name: str, lane: str, chunks: int
) -> None:
    kinds = {
        "timestep_time": TIMES[time],
        "vehicle_id": NAMES[name],
        "vehicle_x": FLOATS[x],
        "vehicle_lane": NAMES[lane],
    }
    table = pa.table(
        {column: cast(values, kinds[column]) if column in kinds else values
         for column, values in FCD.items()}
    )  # fmt: skip
    step = -(-len(table) // chunks)
    parts = [table.slice(start, step) for start in range(0, len(table), step)]
    # Whole numbers leave half a metre out.
    same(read(folder, pa.concat_tables(parts)), read(folder, pa.table(FCD)), 0.6)
    kinds = {"particle": NAMES[name], "time_s": TIMES[time], "x_m": FLOATS[x]}
    table = pa.table(
        {column: cast(values, kinds[column]) if column in kinds else values
         for column, values in KNOTS.items()}
    )  # fmt: skip
    same(read(folder, table), read(folder, pa.table(KNOTS)))


def by_pandas(columns: dict[str, list[Any]], path: Path, texts: str) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns)
    for name in frame.columns:
        if name in ("vehicle_id", "vehicle_lane", "particle"):
            frame[name] = frame[name].astype(str).astype(texts)
        elif "time" in name:
            frame[name] = pandas.to_timedelta(frame[name], unit="s")
    frame.to_parquet(path)


def by_polars(columns: dict[str, list[Any]], path: Path, texts: str) -> None:
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame(columns)
    kind = polars.Categorical if texts == "category" else polars.String
    named = [name for name in columns if name in ("vehicle_id", "vehicle_lane", "particle")]
    times = [name for name in columns if "time" in name]
    frame.with_columns(
        *(polars.col(name).cast(polars.String).cast(kind) for name in named),
        *(polars.duration(seconds=polars.col(name).cast(polars.Int64)).alias(name)
          for name in times),
    ).write_parquet(path)  # fmt: skip


def by_duckdb(columns: dict[str, list[Any]], path: Path, texts: str) -> None:
    duckdb = pytest.importorskip("duckdb")
    rows = pa.table(columns)
    kind = "BLOB" if texts == "category" else "VARCHAR"
    numbers = [f"CAST({name} AS DECIMAL(12, 2)) AS {name}" if name[-1] in "xy" else name
               for name in columns if name not in ("vehicle_id", "particle")]  # fmt: skip
    named = next(name for name in columns if name in ("vehicle_id", "particle"))
    database = duckdb.connect()
    database.register("rows", rows)
    chosen = ", ".join([f"CAST(CAST({named} AS VARCHAR) AS {kind}) AS {named}", *numbers])
    database.sql(f"COPY (SELECT {chosen} FROM rows) TO '{path}' (FORMAT parquet)")
    database.close()


@pytest.mark.parametrize("write", [by_pandas, by_polars, by_duckdb])
@pytest.mark.parametrize("texts", ["str", "category"])
@pytest.mark.parametrize("columns", [FCD, KNOTS], ids=["fcd", "knots"])
def test_writers_do_not_matter(
    tmp_path: Path, write: Callable[..., None], texts: str, columns: dict[str, list[Any]]
) -> None:
    path = tmp_path / "theirs.parquet"
    write(columns, path, texts)
    same(read_recording(path, NET).futures, read(tmp_path, pa.table(columns)), 0.01)


def test_vehicles_are_numbered_as_they_appear_whatever_the_dictionary(tmp_path: Path) -> None:
    codes = pa.array([2, 1, 2, 2, 1, 2], pa.int8())
    ids = pa.DictionaryArray.from_arrays(codes, pa.array(["never", "b", "a"]))
    futures = read(tmp_path, pa.table({**FCD, "vehicle_id": ids}))
    same(futures, read(tmp_path, pa.table(FCD)))


def test_particles_are_joined_by_name(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    beside = {
        "particle": ["1000003", "1", "0", "2"],
        "weight": [0.1, 0.2, 0.3, 0.4],
        "at_end": ["gone", "stays", "stays", "gone"],
        "speed_mps": [3.0, None, 10.0, 12.0],
        "route": ["CE", None, "AB", "AB"],
    }
    pq.write_table(pa.table(beside), tmp_path / "particles.parquet")
    pq.write_table(pa.table(KNOTS), tmp_path / "futures.parquet")
    recording = read_recording(tmp_path / "futures.parquet", NET)
    assert recording.futures.weight.tolist() == pytest.approx([0.375, 0.5, 0.125])
    assert recording.futures.gone.tolist() == [False, True, True]
    assert recording.speed_mps == (10.0, 12.0, 3.0)
    assert recording.route == ("AB", "AB", "CE")
    assert "1 of 4 particles have no row in futures.parquet" in caplog.text


@pytest.mark.parametrize(
    ("columns", "change", "told"),
    [
        (FCD, {"vehicle_id": [True] * 6}, "'vehicle_id' must hold names, not bool"),
        (FCD, {"vehicle_id": [0.5] * 6}, "'vehicle_id' must hold names"),
        (FCD, {"vehicle_id": pa.array([b"\xff"] * 6)}, "'vehicle_id' must hold names"),
        (FCD, {"vehicle_id": ["a", None, *"aaaa"]}, "1 rows have a place but no vehicle_id"),
        (FCD, {"vehicle_x": [1.0, None, 1.0, 1.0, 1.0, 1.0]}, "'1000003' has no finite x .* 0 s"),
        (FCD, {"vehicle_speed": ["fast"] * 6}, "'vehicle_speed' must hold numbers"),
        (FCD, {"vehicle_speed": [True] * 6}, "'vehicle_speed' must hold numbers, not bool"),
        (FCD, {"timestep_time": pa.array(range(6), pa.timestamp("us"))}, "holds dates"),
        (FCD, {"timestep_time": pa.array(range(6), pa.date32())}, "holds dates"),
        (FCD, {"timestep_time": ["noon"] * 6}, "'timestep_time' should be seconds"),
        (FCD, {"timestep_time": pa.array([None] * 6, pa.duration("s"))}, "'7' has no finite time"),
        (KNOTS, {"particle": [0, 0, 2, 2, None]}, "'particle' holds no name .null. in row 4"),
        (KNOTS, {"particle": [0, 2, 0, 2, 2]}, "sorted by particle"),
        (KNOTS, {"time_s": [5.0, 5.0, 0.0, 1.0, 0.0]}, "'0' goes from 5 to 5 s"),
        (KNOTS, {"x_m": [0.0, None, 0.0, 0.0, 0.0]}, "'x_m' holds no finite number .* in row 1"),
        (KNOTS, {"edge": [[1]] * 5}, "'edge' must hold names"),
    ],
)  # fmt: skip
def test_what_is_no_such_column_is_told(
    tmp_path: Path, columns: dict[str, list[Any]], change: dict[str, Any], told: str
) -> None:
    with pytest.raises(InputError, match=told) as caught:
        read(tmp_path, pa.table({**columns, **change}))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("columns", [FCD, KNOTS], ids=["fcd", "knots"])
def test_a_column_twice_is_told(tmp_path: Path, columns: dict[str, list[Any]]) -> None:
    for name in columns:
        table = pa.table(columns)
        with pytest.raises(InputError, match=f"column '{name}' stands in it twice"):
            read(tmp_path, table.append_column(name, table[name]))


def test_metadata_that_is_no_text_is_told(tmp_path: Path) -> None:
    table = pa.table(KNOTS).replace_schema_metadata({"net_sha256": b"\xff"})
    with pytest.raises(InputError, match="'net_sha256' is no text"):
        read(tmp_path, table)


def test_particles_that_do_not_fit_are_told(tmp_path: Path) -> None:
    pq.write_table(pa.table(KNOTS), tmp_path / "futures.parquet")
    beside = {"weight": [0.25] * 4, "at_end": ["stays"] * 4, "speed_mps": [1.0] * 4,
              "route": [""] * 4}  # fmt: skip
    for ids, told in (
        ([0, 2, 2, 1000003], "particle 2 has two rows"),
        ([0, 2, None, 1000003], "holds no name .null. in row 2"),
        ([0, 2, 3, 4], "particle 1000003 has no row in particles.parquet"),
    ):
        pq.write_table(pa.table({"particle": ids, **beside}), tmp_path / "particles.parquet")
        with pytest.raises(InputError, match=told):
            read_recording(tmp_path / "futures.parquet", NET)
    pq.write_table(pa.table(beside), tmp_path / "particles.parquet")
    with pytest.raises(InputError, match="has no column 'particle'"):
        read_recording(tmp_path / "futures.parquet", NET)
