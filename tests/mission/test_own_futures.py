"""A user's futures: what is kept out of planning is kept out by vehicle, and nothing is lost."""

from pathlib import Path

import numpy as np

from planner.mission.opening import open_scenario
from planner.mission.own_futures import ENOUGH, OwnFutures, read_split
from planner.parquet import write_table


def days(folder: Path, vehicles: list[int]) -> OwnFutures:
    """So many vehicles on each day, whose number is how far they are to the north."""
    for day, many in enumerate(vehicles):
        (folder / str(day)).mkdir(exist_ok=True)
        recording(folder / str(day), many, y_m=float(day))
    first, *others = (folder / str(day) / "futures.parquet" for day in range(len(vehicles)))
    return OwnFutures(first, others=tuple(others))


def recording(folder: Path, vehicles: int, y_m: float = 0.0) -> OwnFutures:
    """Vehicle k stands at k metres on the first road."""
    name = np.repeat(np.arange(vehicles), 2)
    columns = {
        "particle": name,
        "time_s": np.tile([0.0, 60.0], vehicles),
        "x_m": name.astype(float),
        "y_m": np.full(2 * vehicles, y_m),
    }
    write_table(folder / "futures.parquet", columns, {})
    return OwnFutures(folder / "futures.parquet")


def test_a_fifth_of_the_vehicles_is_kept_out(tmp_path: Path) -> None:
    opened = open_scenario("figure3")
    split = read_split(recording(tmp_path, ENOUGH), opened)
    assert split.kept_out is not None
    planning, spared = split.planning.futures, split.kept_out.futures
    assert (len(planning), len(spared)) == (80, 20)
    both = np.concatenate([planning.x_m[::2], spared.x_m[::2]])
    assert sorted(both.tolist()) == list(range(ENOUGH))
    for part in (planning, spared):
        np.testing.assert_allclose(part.weight, 1 / len(part))
    again = read_split(OwnFutures(tmp_path / "futures.parquet"), opened)
    np.testing.assert_array_equal(again.planning.futures.x_m, planning.x_m)


def test_files_are_equally_likely_days(tmp_path: Path) -> None:
    own, opened = days(tmp_path, [30, 10]), open_scenario("figure3")
    split = read_split(own, opened)
    assert split.kept_out is None
    weight, first = split.planning.futures.weight, split.planning.futures.first_knot[:-1]
    day = split.planning.futures.y_m[first]
    for number in (0, 1):
        np.testing.assert_allclose(weight[day == number].sum(), 0.5)
    assert split.planning.others == own.others


def test_of_three_days_a_whole_one_is_kept_out(tmp_path: Path) -> None:
    own = days(tmp_path, [5, 9, 4])
    for seed in range(1, 5):
        opened = open_scenario("figure3", overrides=[f"search.seed={seed}"])
        split = read_split(own, opened)
        assert split.kept_out is not None
        planned, spared = (
            set(part.futures.y_m.tolist()) for part in (split.planning, split.kept_out)
        )
        assert (len(planned), len(spared)) == (2, 1)
        assert planned | spared == {0.0, 1.0, 2.0}
        np.testing.assert_allclose(split.planning.futures.weight.sum(), 1.0)
        np.testing.assert_allclose(split.kept_out.futures.weight.sum(), 1.0)


def test_a_digest_of_files_is_of_each_of_them(tmp_path: Path) -> None:
    own, opened = days(tmp_path, [2, 3]), open_scenario("figure3")
    first = read_split(own, opened).planning.sha256
    assert first != read_split(OwnFutures(own.path), opened).planning.sha256
    days(tmp_path, [2, 4])
    assert first != read_split(own, opened).planning.sha256


def test_another_seed_keeps_out_others(tmp_path: Path) -> None:
    own = recording(tmp_path, ENOUGH)
    one, other = (
        read_split(own, open_scenario("figure3", overrides=[f"search.seed={seed}"])).planning
        for seed in (1, 2)
    )
    assert one.futures.x_m.tolist() != other.futures.x_m.tolist()


def test_of_few_vehicles_none_is_kept_out(tmp_path: Path) -> None:
    split = read_split(recording(tmp_path, ENOUGH - 1), open_scenario("figure3"))
    assert split.kept_out is None
    assert len(split.planning.futures) == ENOUGH - 1


def test_of_traffic_whole_realisations_are_kept_out(tmp_path: Path) -> None:
    own = recording(tmp_path, ENOUGH)
    fates = {"late_s": 0, "took_over": 0, "teleports": 0, "driven_m": np.nan, "alone_m": np.nan}
    for number in (5, 1):
        columns = {
            "particle": np.arange(ENOUGH),
            "weight": np.full(ENOUGH, 1 / ENOUGH),
            "at_end": ["stays"] * ENOUGH,
            "speed_mps": np.ones(ENOUGH),
            "route": [""] * ENOUGH,
            "realisation": np.arange(ENOUGH) % number,
            **{name: np.full(ENOUGH, value) for name, value in fates.items()},
        }
        write_table(tmp_path / "particles.parquet", columns, {})
        split = read_split(own, open_scenario("figure3"))
        if number == 1:  # what is kept out of it would share its queues
            assert split.kept_out is None
            continue
        assert split.kept_out is not None
        there, spared = split.planning.futures.fates, split.kept_out.futures.fates
        assert there is not None
        assert spared is not None
        assert len(set(spared.realisation)) == 1
        assert set(spared.realisation).isdisjoint(there.realisation)
