"""tools/verify.py and certificates of fleets and of sensors that miss: honest ones, and forged."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pytest

from planner.detection.objective import Objective
from planner.detection.sensor import rate_of
from planner.flight.plan import Plan
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.rate import rate_order
from planner.search.what_if import WhatIf
from support.certified_runs import write_certified
from support.forger import TOOLS, Forger, climbs_for_ever, verdicts
from support.grid_instance import grid_futures, grid_problem


def problem_of(
    *,
    detects: float = 1.0,
    others: int = 0,
    by_s: float | None = None,
    transit: bool = True,
    sorties: int = 1,
) -> Problem:
    """UAVs of several speeds that start apart, and search a small grid; ``sorties`` of others."""
    problem = grid_problem(grid_futures(12, np.random.default_rng(3), size=3), size=3)
    rate_per_s = rate_of(detects, problem.sensor.radius_m, problem.uav.speed_mps)
    sensor = replace(problem.sensor, rate_per_s=rate_per_s, detects_in_transit=transit)
    more = tuple(
        replace(
            problem.uav,
            x_m=30_000.0 * number,
            y_m=5_000.0,
            speed_mps=80.0 + 10.0 * number,
            altitude_m=problem.uav.altitude_m + 20.0 * number,
            sorties=sorties,
        )
        for number in range(1, others + 1)
    )
    return problem.replace(objective=Objective(3000.0, by_s), sensor=sensor, others=more)


def plan_of(problem: Problem) -> Plan:
    """Each UAV's own plan turned round: none that a bound is met by."""
    alone = [problem.replace(uav=uav, others=()) for uav in problem.flying]
    plans = [plan_of_legs(one, "rate", rate_order(WhatIf(one))[::-1]) for one in alone]
    tracks, legs = (tuple(getattr(plan, key)[0] for plan in plans) for key in ("tracks", "legs"))
    return Plan("rate", tracks, legs)


@pytest.fixture
def verdict(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[[Path], int]:
    return verdicts(monkeypatch, capsys)


@pytest.mark.parametrize(
    "asked",
    [
        {"detects": 0.7},
        {"detects": 0.999},
        {"detects": 0.9, "by_s": 500.0},
        {"detects": 0.7, "transit": False},
        {"others": 1},
        {"others": 2, "detects": 0.6},
        {"others": 1, "detects": 0.8, "by_s": 400.0},
    ],
    ids=str,
)
def test_the_honest_pass(
    asked: dict[str, Any], tmp_path: Path, verdict: Callable[[Path], int]
) -> None:
    problem = problem_of(**asked)
    write_certified(tmp_path, problem, plan_of(problem))
    assert verdict(tmp_path) == 0


@pytest.fixture(scope="session")
def missing_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, problem = tmp_path_factory.mktemp("missing"), problem_of(detects=0.7)
    write_certified(folder, problem, plan_of(problem))
    return folder


@pytest.fixture(scope="session")
def fleet_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, problem = tmp_path_factory.mktemp("fleet"), problem_of(detects=0.7, others=1)
    write_certified(folder, problem, plan_of(problem))
    return folder


Forgery = Callable[[Forger], None]


def cert(key: str, value: Any) -> Forgery:
    return lambda forger: forger.put("plan.json", "certificate", key, value)


def of_uav(number: int, key: str, value: Any) -> Forgery:
    return lambda forger: forger.put("plan.json", "certificate", "uavs", number, key, value)


def scenario_of(number: int, key: str, value: Any) -> Forgery:
    return lambda forger: forger.put("run.json", "scenario", "uav", number, key, value)


def price(change: Callable[[np.ndarray], np.ndarray]) -> Forgery:
    """Change all prices."""

    def forge(forger: Forger) -> None:
        def changed(table: Any) -> Any:
            prices = [change(np.array(one)).tolist() for one in table["price"].to_pylist()]
            column = pyarrow.array(prices, pyarrow.list_(pyarrow.float64()))
            return table.set_column(table.schema.get_field_index("price"), "price", column)

        forger.table("prices.parquet", changed)

    return forge


def one_more_prefix(forger: Forger) -> None:
    def longer(table: Any) -> Any:
        first = table.slice(0, 1)
        flight = pyarrow.array([[0]], pyarrow.list_(pyarrow.int64()))
        place = table.schema.get_field_index("flight")
        return pyarrow.concat_tables([table, first.set_column(place, "flight", flight)])

    forger.table("prices.parquet", longer)


def one_flight_less(forger: Forger) -> None:
    forger.put("plan.json", "uavs", lambda uavs: uavs[:1])


OF_BOTH: dict[str, Forgery] = {
    "bound too good": cert("lower_bound_s", lambda bound: bound + 1.0),
    "lower prices": price(lambda prices: 0.9 * prices),
    "much higher prices": price(lambda prices: prices + 500.0),
    "negative prices": price(lambda prices: prices - 3000.0),
    "prices for one that misses more": cert("rate_per_s", lambda rate: 0.5 * rate),
    "prices for one that misses less": cert("rate_per_s", lambda rate: 2.0 * rate),
    "prices for one that misses nobody": lambda f: f.drop("plan.json", "certificate", "rate_per_s"),
    "a rate of zero": cert("rate_per_s", 0.0),
    "a rate of null": cert("rate_per_s", None),
    "another rate": lambda f: f.put("plan.json", "planned", "rate_per_s", lambda rate: 2 * rate),
    "misses nobody": lambda f: f.drop("plan.json", "planned", "rate_per_s"),
    "detects more": lambda f: f.put("run.json", "scenario", "sensor", "detects", 0.9),
    "detects all": lambda f: f.put("run.json", "scenario", "sensor", "detects", None),
    "found sooner": lambda f: f.put(
        "plan.json", "planned", "expected_detection_time_s", lambda value: 0.99 * value
    ),
}
OF_FLEETS: dict[str, Forgery] = {
    "a flight less": one_flight_less,
    "a UAV less": cert("uavs", lambda uavs: uavs[:1]),
    "a UAV more": cert("uavs", lambda uavs: [*uavs, uavs[0]]),
    "no UAVs": lambda f: f.drop("plan.json", "certificate", "uavs"),
    "UAVs are none": cert("uavs", []),
    "UAVs in another order": cert("uavs", lambda uavs: uavs[::-1]),
    "a slower one": of_uav(1, "speed_mps", 45.0),
    "one that takes off later": of_uav(1, "take_off_s", 500.0),
    "one elsewhere": of_uav(1, "x_m", 300_000.0),
    "one that lands": of_uav(0, "landing_s", 300.0),
    "one of no speed": of_uav(0, "speed_mps", None),
    "one UAV flies twice": lambda f: f.put("plan.json", "uavs", 1, "uav", 0),
    "a flight of nobody": lambda f: f.put("plan.json", "uavs", 1, "uav", 7),
    "aircraft that climb for ever": climbs_for_ever,
    "a higher one": lambda f: f.put("plan.json", "uavs", 1, "altitude_m", 1e4),
    "prices of a prefix": one_more_prefix,
    "one UAV in the scenario": lambda f: f.put(
        "run.json", "scenario", "uav", lambda uavs: uavs[:1]
    ),
    "one that flies no more": scenario_of(1, "sorties", 0),
    "one that may fly twice": scenario_of(1, "sorties", 2),
    "another scenario": lambda f: f.put("run.json", "scenario", "uav", lambda uavs: uavs[0]),
}


@pytest.mark.parametrize("forged", OF_BOTH)
def test_forgeries_of_misses_are_refused(
    forged: str, missing_run: Path, tmp_path: Path, verdict: Callable[[Path], int]
) -> None:
    shutil.copytree(missing_run, tmp_path / "run")
    OF_BOTH[forged](Forger(tmp_path / "run"))
    assert verdict(tmp_path / "run") in (1, 2)


@pytest.mark.parametrize("forged", OF_BOTH | OF_FLEETS)
def test_forgeries_of_fleets_are_refused(
    forged: str, fleet_run: Path, tmp_path: Path, verdict: Callable[[Path], int]
) -> None:
    shutil.copytree(fleet_run, tmp_path / "run")
    (OF_BOTH | OF_FLEETS)[forged](Forger(tmp_path / "run"))
    assert verdict(tmp_path / "run") in (1, 2)


def test_pieces_that_creep_from_their_line_are_not_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each begins near the end of the one before, and so they may go anywhere."""
    monkeypatch.syspath_prepend(TOOLS)
    motion, joined = import_module("verify_sight").Motion, import_module("verify_spans").joined
    from_s, rest = np.arange(4.0), np.zeros(4, dtype=complex)
    for step_m, left in ((0.0, 1), (0.9e-5, 4)):
        pieces = motion(np.zeros(4, dtype=int), from_s, from_s + 1.0, rest + step_m * from_s, rest)
        assert len(joined(pieces).particle) == left


def test_who_flies_after_all_makes_the_bound_wrong(
    tmp_path: Path, verdict: Callable[[Path], int], capsys: pytest.CaptureFixture[str]
) -> None:
    problem = problem_of(detects=0.7, others=2, sorties=0)
    write_certified(tmp_path, problem, plan_of(problem))
    assert verdict(tmp_path) == 0
    import_module("verify").main([str(tmp_path)])
    assert capsys.readouterr().out.splitlines()[0].count("left out of the bound") == 2
    scenario_of(2, "sorties", None)(Forger(tmp_path))
    assert verdict(tmp_path) == 1
