"""Motion that cannot be of this net or of this search is refused in one line, or told of."""

import gzip
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from planner.errors import InputError
from planner.futures.futures import Futures
from planner.futures.nearness import Nearness, off_edges
from planner.futures.store import read_recording
from support.instances import edge_of_knots, figure3

NET = figure3()
KEYS = ("x", "y", "speed", "pos", "lane")
Row = tuple[str, float, float, Any, Any, Any]


def fcd(steps: Iterable[tuple[object, list[Row]]]) -> str:
    lines = ["<fcd-export>"]
    for time, rows in steps:
        lines.append(f'<timestep time="{time}">')
        for name, *values in rows:
            said = zip(KEYS, values, strict=True)
            given = " ".join(f'{key}="{value}"' for key, value in said if value is not None)
            lines.append(f'<vehicle id="{name}" {given}/>')
        lines.append("</timestep>")
    return "\n".join([*lines, "</fcd-export>"])


def drive(times: Iterable[float] = (0, 100, 200), unit: float = 1.0) -> list[Any]:
    """A vehicle at 20 m/s along AB, its recorded times in another unit."""
    return [(f"{t * unit:.12g}", [("v", 20.0 * t, 0.0, 20, 20.0 * t, "AB_0")]) for t in times]


def read(tmp_path: Path, steps: Iterable[Any], **clock: float) -> Futures:
    path = tmp_path / "f.xml"
    path.write_text(fcd(steps))
    return read_recording(path, NET, **clock).futures


def bare(steps: Iterable[Any]) -> list[Any]:
    """The same with places alone."""
    return [(time, [(*row[:3], None, None, None) for row in rows]) for time, rows in steps]


def refused(tmp_path: Path, steps: Iterable[Any], told: str, **clock: float) -> None:
    with pytest.raises(InputError, match=told) as caught:
        read(tmp_path, steps, **clock)
    assert "\n" not in str(caught.value)
    assert "f.xml: " in str(caught.value)


def test_honest_motion_is_read_without_a_word(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    futures = read(tmp_path, drive(), horizon_s=3600.0)
    assert futures.xy(0, 150.0).tolist() == [3000.0, 0.0]
    assert caplog.text == ""


@pytest.mark.parametrize("only_places", [False, True])
@pytest.mark.parametrize(
    ("unit", "told"),
    [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")],
)
def test_other_units_of_time_are_recognised(
    tmp_path: Path, unit: float, told: str, only_places: bool
) -> None:
    steps = drive(unit=unit)
    told = f"no vehicle moves faster than .* m/s, .* are the times {told}"
    refused(tmp_path, bare(steps) if only_places else steps, told, horizon_s=3600.0)


def test_hours_and_kilometres_are_recognised(tmp_path: Path) -> None:
    refused(tmp_path, drive(unit=1 / 3600), "moves 72,000 m/s .* write times in seconds")
    refused(tmp_path, drive(unit=1 / 40), "places and times say 800 m/s, but the recorded .* 20 ")
    kilometres = [(t, [("v", row[1] / 1000, 0, 20, None, None)]) for t, (row,) in drive()]
    refused(tmp_path, kilometres, "places and times say 0.02 m/s, but the recorded speeds 20 m/s")


def faster(steps: Iterable[Any], factor: float) -> list[Any]:
    """The same with other recorded speeds."""
    return [
        (t, [(*row[:3], row[3] * factor, *row[4:]) for row in rows]) for t, rows in steps
    ]  # fmt: skip


def test_speeds_in_kilometres_per_hour_are_recognised(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "f.xml"
    path.write_text(fcd(faster(drive(), 3.6)))
    told = read_recording(path, NET)
    assert caplog.text.count("taken for km/h") == 1
    path.write_text(fcd(drive()))
    rightly = read_recording(path, NET)
    assert told.speed_mps == rightly.speed_mps
    np.testing.assert_allclose(told.futures.x_m, rightly.futures.x_m)
    np.testing.assert_allclose(told.futures.time_s, rightly.futures.time_s)


@pytest.mark.parametrize("factor", [1.0, 2.237, 3.3, 4.0])
def test_other_speeds_stay_as_they_are(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, factor: float
) -> None:
    read(tmp_path, faster(drive(), factor))
    assert "km/h" not in caplog.text


def test_speeds_that_differ_from_sample_to_sample_are_no_unit(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Between sparse samples a car stands for some time, here longer and longer."""
    times = (0, 36, 60, 180, 300)
    steps = [(f"{t}", [("v", 300.0 * k, 0.0, 20, 300.0 * k, "AB_0")]) for k, t in enumerate(times)]
    read(tmp_path, steps)
    assert "km/h" not in caplog.text


@pytest.mark.parametrize("only_places", [False, True])
def test_degrees_are_recognised(tmp_path: Path, only_places: bool) -> None:
    steps = [
        (t, [("v", 13.5 + row[1] / 71_000, 52.4, *row[3:])]) for t, (row,) in drive()
    ]  # fmt: skip
    told = "the places are not on this net: .* look like degrees; record without --fcd-output.geo"
    refused(tmp_path, bare(steps) if only_places else steps, told)


def test_another_frame_is_told_with_both_ranges(tmp_path: Path) -> None:
    moved = [(t, [("v", row[1] + 392_000, 5_820_000, *row[3:])]) for t, (row,) in drive()]
    told = "x 392000 to 396000, y 5820000 .* at x 0 to 15000, y -8000 to 8000 m; 0 of 3 are within"
    refused(tmp_path, moved, told)


def test_who_strays_is_kept_with_a_note(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    strays = ("far", -9000.0, 4000.0, None, None, None)
    steps = [(t, [*rows, strays]) for t, rows in drive()]
    assert len(read(tmp_path, [*steps, *drive([300])])) == 2
    assert "4 of 7 are within about 1,000 m of a road" in caplog.text
    assert "vehicle 'far', (-9000, 4000) at 0 s" in caplog.text


def test_a_spike_is_told_with_who_and_when(tmp_path: Path) -> None:
    steps = bare(drive(range(6)))
    steps[3] = (3, [("v", 90_000.0, 90_000.0, None, None, None)])
    refused(tmp_path, steps, "vehicle 'v' moves 127,2.. m/s between 2 and 3 s .*leave the sample")


def test_sumos_value_for_no_place_is_told(tmp_path: Path) -> None:
    steps = bare(drive())
    steps[1] = (100, [("v", -1073741824.0, -1073741824.0, None, None, None)])
    refused(tmp_path, steps, "vehicle 'v' is at .-1073741824, .* at 100 s, .*no place")


def test_sumos_value_for_no_speed_is_none(tmp_path: Path) -> None:
    steps = [(t, [(*row[:3], -1073741824.0, -1073741824.0, row[5])]) for t, (row,) in drive()]
    assert read(tmp_path, steps).xy(0, 150.0).tolist() == [3000.0, 0.0]


def test_two_places_at_one_time(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (time, (row,)), *rest = drive()
    other = (row[0], 900.0, *row[2:])
    told = r"vehicle 'v' is at two places at 0 s, \(0, 0\) and \(900, 0\) m"
    refused(tmp_path, [(time, [row, other]), *rest], told)
    twice = read(tmp_path, [(time, [row, row]), *rest])
    assert twice.xy(0, 150.0).tolist() == [3000.0, 0.0]
    assert "1 samples stand in it twice; read once" in caplog.text


def test_an_edge_that_lies_elsewhere(tmp_path: Path) -> None:
    elsewhere = [(t, [(*row[:5], "DG_0")]) for t, (row,) in drive()]
    refused(tmp_path, elsewhere, "vehicle 'v' is at .* m from its edge 'DG'")
    knots = {"particle": ["p"] * 2, "time_s": [0.0, 100.0], "x_m": [0.0, 900.0], "y_m": [0.0] * 2}
    pq.write_table(pa.table({**knots, "edge": ["CF"] * 2}), tmp_path / "futures.parquet")
    with pytest.raises(InputError, match=r"particle 'p' is at \(0, 0\) at 0 s, 10,770 m from"):
        read_recording(tmp_path / "futures.parquet", NET)


def test_the_clock_of_the_day(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    steps = [*drive(), ("400", [("late", 0.0, 0.0, 20, 0.0, "AB_0")])]
    steps = [(28_800 + float(t), rows) for t, rows in steps]
    told = "all 2 vehicles set out after the horizon of 3600 s, .* --begin 8:00:00"
    refused(tmp_path, steps, told, horizon_s=3600.0)
    assert read(tmp_path, steps, horizon_s=36_000.0).time_s[0] == 28_800.0
    assert "no vehicle sets out before 8:00:00" in caplog.text
    caplog.clear()
    futures = read(tmp_path, steps, begin_s=28_850.0, horizon_s=3600.0)
    assert futures.xy(0, [-1.0, 0.0, 100.0])[1:].tolist() == [[1000.0, 0.0], [3000.0, 0.0]]
    assert np.isnan(futures.xy(0, -1.0)).all()
    assert caplog.text == ""
    futures = read(tmp_path, steps, begin_s=29_100.0, horizon_s=3600.0)
    assert futures.weight.tolist() == [1.0]
    assert futures.time_s.tolist() == [100.0]
    assert "left out: vehicles that end before --begin (1 of 2, the first 'v')" in caplog.text
    refused(tmp_path, steps, "all 2 vehicles ended before --begin 9:00:00", begin_s=32_400.0)
    caplog.clear()
    assert len(read(tmp_path, steps, begin_s=28_800.0, horizon_s=300.0)) == 2
    assert "1 of 2 vehicles set out after the horizon of 300 s" in caplog.text


def test_gaps_are_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    futures = read(tmp_path, drive([0, 1, 2, 3, 4, 200, 201, 202]))
    assert futures.xy(0, 100.0)[0] == pytest.approx(2000.0)
    assert "vehicle 'v' is not recorded between 4 and 200 s" in caplog.text


# --- times of crossing

NEAR_END = ("0", [("v", 4900.0, 0.0, 10, 4900.0, "AB_0")])


def edges_at(futures: Futures) -> list[tuple[float, str]]:
    return [
        (time, "" if edge < 0 else NET.edge_ids[edge])
        for time, edge in zip(futures.time_s.tolist(), edge_of_knots(futures).tolist(), strict=True)
    ]


def test_who_stands_when_sampled_has_crossed_in_between(tmp_path: Path) -> None:
    """100 m to the end, 25 m beyond it: after 8 of 10 s."""
    beyond = [(t, [("v", *NET.edge_xy(1, 25.0), 0, 25.0, "BC_0")]) for t in ("10", "20")]
    futures = read(tmp_path, [NEAR_END, *beyond])
    assert edges_at(futures)[1] == (pytest.approx(8.0), "BC")
    assert futures.xy(0, 8.0).tolist() == pytest.approx([5000.0, 0.0])


@pytest.mark.parametrize("along_m", [5000.0, 5000.01])
def test_who_stands_at_an_edges_end_is_there(tmp_path: Path, along_m: float) -> None:
    steps = [
        ("0", [("v", 5000.0, 0.0, 0, along_m, "AB_0")]),
        ("10", [("v", 5000.0, 0.0, 0, 0.0, "BC_0")]),
    ]
    futures = read(tmp_path, steps)
    for time_s in (0.0, 5.0, 10.0, 1e6):
        assert futures.xy(0, time_s).tolist() == [5000.0, 0.0]


# --- what compiled code relies on


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ([0.0, 0.0, 1.0], "particle 0 has a knot at 0 s, .* after one at 0 s"),
        ([0.0, np.nan, 1.0], "particle 0 has a knot at nan s"),
        ([0.0, 1.0, np.inf], "particle 1 has a knot at inf s"),
        ([5.0, 4.0, 0.0], "particle 0 has a knot at 4 s"),
    ],
)
def test_futures_of_other_times_cannot_be_made(times: list[float], told: str) -> None:
    with pytest.raises(InputError, match=told):
        Futures(times, [0, 1, 2], [0, 0, 0], [0, 2, 3], [0.5, 0.5], [False, False])
    with pytest.raises(InputError, match=r"particle 1 has a knot at 0 s, \(nan, 0\) m"):
        Futures([0, 1, 0], [0, 1, np.nan], [0] * 3, [0, 2, 3], [0.5] * 2, [0, 0])
    Futures([5, 6, 0], [0, 1, 2], [0] * 3, [0, 2, 3], [0.5] * 2, [0, 0])


# --- the tools


def test_nearness_is_that_of_the_nearest_road() -> None:
    rng = np.random.default_rng(1)
    roads = Nearness(NET)
    x, y = rng.uniform(-9e3, 24e3, 2000), rng.uniform(-17e3, 17e3, 2000)
    everywhere = np.concatenate([NET.xy(road, np.linspace(0, 7000, 700)) for road in range(7)])
    away = np.array([np.hypot(*(everywhere - place).T).min() for place in zip(x, y, strict=True)])
    near = roads.near(x, y)
    assert near[away < roads.near_m].all()
    assert not near[away > 3 * roads.near_m].any()
    assert roads.near(np.array([1e300, -1e300]), np.zeros(2)).tolist() == [False, False]


def test_off_edges_is_the_distance_to_the_drawn_road() -> None:
    edge = np.array([0, 0, 0, 1])
    x, y = np.array([2000.0, -30.0, 2000.0, 5000.0]), np.array([70.0, 40.0, 70.0, 0.0])
    np.testing.assert_allclose(off_edges(NET, edge, x, y), [70.0, 50.0, 70.0, 0.0])


def test_gzipped_csv_is_read(tmp_path: Path) -> None:
    lines = ["timestep_time,vehicle_id,vehicle_x,vehicle_y", "0:00:00,a,0,0", "0:01:40,a,2000,0"]
    path = tmp_path / "f.csv.gz"
    path.write_bytes(gzip.compress("\n".join(lines).encode("utf-8-sig")))
    assert read_recording(path, NET).futures.xy(0, 50.0).tolist() == [1000.0, 0.0]
