"""What Python programs hand in: NumPy's scalars are numbers, and nonsense is refused by name."""

import copy
import pickle
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

import planner
from planner.errors import InputError
from planner.search.plan import plan_of_legs
from support.instances import figure3
from support.search_instances import random_problem

PROBLEM = random_problem(5)
FUTURES, NETWORK, UAV = PROBLEM.futures, PROBLEM.network, PROBLEM.uav
STATE, TRACK = PROBLEM.first_state, plan_of_legs(PROBLEM, "some", [0, 2]).tracks[0]
NAN, INF = float("nan"), float("inf")


def recorder() -> planner.Recorder:
    return planner.Recorder(planner.open_scenario("figure3"))


def changed(holder: Any, field: str, value: Any) -> Callable[[], Any]:
    return lambda: replace(holder, **{field: value})


def with_nan(column: Any) -> Any:
    return np.where(np.arange(len(column)) == 1, NAN, column)


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "sensor of radius -1": (lambda: planner.Sensor(-1.0), "radius_m: -1 "),
    "sensor of radius 0": (lambda: planner.Sensor(0), "radius_m: 0 "),
    "sensor of no radius": (lambda: planner.Sensor(NAN), "radius_m: nan "),
    "sensor without end": (lambda: planner.Sensor(INF), "radius_m: inf "),
    "sensor of a text": (lambda: planner.Sensor("500"), 'radius_m: "500" '),  # type: ignore[arg-type]
    "sensor of a truth value": (lambda: planner.Sensor(True), "radius_m: true "),
    "sensor on perhaps": (lambda: planner.Sensor(1.0, "false"), "detects_in_transit"),  # type: ignore[arg-type]
    "sensor of two radii": (lambda: planner.Sensor(np.ones(2)), "radius_m"),  # type: ignore[arg-type]
    "no speed": (changed(UAV, "speed_mps", 0.0), "speed_mps: 0 "),
    "speed backwards": (changed(UAV, "speed_mps", -3.0), "speed_mps: -3 "),
    "nowhere": (changed(UAV, "x_m", NAN), "x_m: nan "),
    "no take-off": (changed(UAV, "take_off_s", None), "take_off_s: null "),
    "flight of -1 s": (changed(UAV, "max_flight_time_s", -1.0), "max_flight_time_s: -1 "),
    "home of one number": (changed(UAV, "return_to_m", (1.0,)), "return_to_m"),
    "home nowhere": (changed(UAV, "return_to_m", (1.0, NAN)), "return_to_m: nan "),
    "horizon 0": (lambda: planner.Objective(0.0), "horizon_s: 0 "),
    "horizon NaN": (lambda: planner.Objective(NAN), "horizon_s: nan "),
    "deadline -1": (lambda: planner.Objective(100.0, -1.0), "by_s: -1 "),
    "budget of half a road": (lambda: planner.Budget(roads=1.5), "roads: 1.5 "),  # type: ignore[arg-type]
    "budget of -1": (lambda: planner.Budget(work=-1), "work: -1 "),
    "budget of a text": (lambda: planner.Budget(work="many"), 'work: "many"'),  # type: ignore[arg-type]
    "work done NaN": (lambda: planner.WorkDone(NAN), "most: nan "),  # type: ignore[arg-type]
    "elapsed NaN": (lambda: planner.Elapsed(NAN), "seconds: nan "),
    "greedy in circles": (lambda: planner.GreedyOptions(direction="circles"), "greedy.direction"),  # type: ignore[arg-type]
    "greedy, a tick of -1": (lambda: planner.GreedyOptions(tick_s=-1.0), "greedy.tick_s"),
    "seed -1": (lambda: planner.stream(-1), "seed: -1 "),
    "seed of a half": (lambda: planner.stream(0.5), "seed: 0.5 "),  # type: ignore[arg-type]
    "a stream named by a list": (lambda: planner.stream(1, ["a"]), "name"),  # type: ignore[list-item]
    "0 targets": (lambda: recorder().truths(0, seed=1), "targets: 0 "),
    "-1 targets": (lambda: recorder().evaluation(-1), "targets: -1 "),
    "targets of a text": (lambda: recorder().evaluation("9"), 'targets: "9" '),  # type: ignore[arg-type]
    "no seed": (lambda: recorder().truths(1, seed=-1), "seed: -1 "),
    "no workers": (lambda: planner.Recorder(recorder().opened, 0), "workers: 0 "),
    "a recorder of a name": (lambda: planner.Recorder("figure3"), "opened"),  # type: ignore[arg-type]
    "a target of no speed": (
        lambda: recorder().predefined(["AB"], speed_mps=NAN, seed=1),
        "target speed nan",
    ),
    "0 particles": (
        lambda: planner.sample(
            recorder().opened.prior, figure3(), 0, np.random.default_rng(1), horizon_s=9.0
        ),
        "n: 0 ",
    ),
    "sampled somehow": (
        lambda: planner.sample(
            recorder().opened.prior,
            figure3(),
            1,
            np.random.default_rng(1),
            sampling="somehow",  # type: ignore[arg-type]
            horizon_s=9.0,
        ),
        "sampling",
    ),
    "time of a knot NaN": (changed(FUTURES, "time_s", with_nan(FUTURES.time_s)), "time_s"),
    "place of a knot NaN": (changed(FUTURES, "x_m", with_nan(FUTURES.x_m)), "x_m"),
    "knots that fall": (changed(FUTURES, "time_s", -FUTURES.time_s), "time_s"),
    "knots too few": (changed(FUTURES, "y_m", FUTURES.y_m[:-1]), "y_m"),
    "negative weights": (changed(FUTURES, "weight", -FUTURES.weight), "weight"),
    "weights NaN": (changed(FUTURES, "weight", with_nan(FUTURES.weight)), "weight"),
    "weights too few": (changed(FUTURES, "gone", FUTURES.gone[:-1]), "gone"),
    "no weights": (changed(FUTURES, "weight", np.zeros(0)), "gone"),
    "a weight alone": (changed(FUTURES, "weight", 1.0), "weight"),
    "weights of texts": (changed(FUTURES, "weight", ["a"] * len(FUTURES)), "weight"),
    "offsets elsewhere": (changed(FUTURES, "first_knot", FUTURES.first_knot + 1), "first_knot"),
    "a fraction of a target": (
        changed(FUTURES, "target", np.full(len(FUTURES), 0.5)),
        "target: cannot be an array of int32",
    ),
    "a track back in time": (changed(TRACK, "time_s", TRACK.time_s[::-1]), "time_s"),
    "a track nowhere": (changed(TRACK, "x_m", with_nan(TRACK.x_m)), "x_m"),
    "a track too short": (changed(TRACK, "x_m", TRACK.x_m[1:]), "x_m"),
    "a sensor on in columns": (changed(TRACK, "sensor_on", np.zeros((1, 3))), "sensor_on"),
    "a sensor off before on": (changed(TRACK, "sensor_on", [[5.0, 1.0]]), "sensor_on"),
    "a node that is none": (changed(NETWORK, "road_to", NETWORK.road_to + 999), "road_to"),
    "roads too few": (changed(NETWORK, "road_from", NETWORK.road_from[1:]), "road_from"),
    "edges of NaN": (
        changed(NETWORK, "edge_length_m", with_nan(NETWORK.edge_length_m)),
        "edge_length_m",
    ),
    "turns to nowhere": (changed(NETWORK, "turn_edge", NETWORK.turn_edge - 99), "turn_edge"),
    "nodes in space": (changed(NETWORK, "node_xy_m", np.zeros((3, 3))), "node_xy_m"),
    "a state of others": (changed(STATE, "miss", STATE.miss[1:]), "seen_at"),
    "a state at no time": (changed(STATE, "time_s", NAN), "time_s: nan "),
    "a problem of a name": (changed(PROBLEM, "network", "figure3"), "network"),
    "a problem of no sensor": (changed(PROBLEM, "sensor", 500.0), "sensor"),
    "a start of others": (
        changed(PROBLEM, "start", replace(STATE, miss=STATE.miss[1:], seen_at=STATE.seen_at[1:])),
        "start",
    ),
    "a leg that is none": (lambda: plan_of_legs(PROBLEM, "some", [10**6]), "order"),
    "a leg before the first": (lambda: plan_of_legs(PROBLEM, "some", [-1]), "order"),
    "a leg of a text": (lambda: plan_of_legs(PROBLEM, "some", ["0"]), "order"),  # type: ignore[list-item]
    "legs that are none": (
        lambda: planner.WhatIf(PROBLEM).score(STATE, np.array([0, 10**6])),
        "legs",
    ),
    "legs in all directions": (
        lambda: planner.candidate_legs(PROBLEM, STATE, directions="all"),  # type: ignore[arg-type]
        "directions",
    ),
    "roads removed that are none": (
        lambda: planner.candidate_legs(PROBLEM, STATE, removed=[10**6]),
        "removed",
    ),
    "seen at NaN": (
        lambda: planner.Evaluation(np.array([NAN]), np.ones(1), np.ones(1), PROBLEM.objective),
        "seen_at",
    ),
    "seen by fewer": (
        lambda: planner.Evaluation(np.ones(2), np.ones(1), np.ones(1), PROBLEM.objective),
        "weight",
    ),
    "detected within NaN": (lambda: planner.first_detection(FUTURES, TRACK, NAN), "radius_m"),
    "where at NaN": (lambda: planner.state_at(FUTURES, NETWORK, NAN), "time_s: nan "),
    "a method unheard of": (lambda: planner.method_named("magic"), "magic"),
}


@pytest.mark.parametrize("nonsense", REFUSED)
def test_nonsense_is_refused_by_name(nonsense: str) -> None:
    call, name = REFUSED[nonsense]
    with pytest.raises(InputError) as refused:
        call()
    text = str(refused.value)
    assert name in text
    assert len(text.splitlines()) == 1


@pytest.mark.parametrize("scalar", [np.int64, np.float32, np.float64, np.array])
def test_numpys_scalars_are_numbers(scalar: Callable[[int], Any]) -> None:
    uav = planner.Uav(
        scalar(1), scalar(2), scalar(3), scalar(4), return_to_m=(scalar(5), scalar(6))
    )
    assert uav == planner.Uav(1.0, 2.0, 3.0, 4.0, return_to_m=(5.0, 6.0))
    names = [one.name for one in fields(uav) if one.name not in ("aircraft", "again")]
    assert {type(getattr(uav, name)) for name in names} == {float, int, bool, tuple}
    assert planner.Sensor(scalar(500), np.True_) == planner.Sensor(500.0, True)
    assert planner.Objective(scalar(9), scalar(8)) == planner.Objective(9.0, 8.0)
    assert planner.Elapsed(scalar(1)).seconds == 1.0
    assert planner.GreedyOptions(tick_s=scalar(2)).tick_s == 2.0


@pytest.mark.parametrize("scalar", [np.int64, np.uint8, np.int32])
def test_numpys_integers_are_counts_and_seeds(scalar: Callable[[int], Any]) -> None:
    assert planner.stream(scalar(7), "a", scalar(3)).random() == planner.stream(7, "a", 3).random()
    assert planner.stream(7, np.str_("a"), 3).random() == planner.stream(7, "a", 3).random()
    assert planner.Budget(roads=scalar(3), work=scalar(5)) == planner.Budget(roads=3, work=5)
    assert planner.WorkDone(scalar(3)) == planner.WorkDone(3)
    order = [scalar(0), scalar(2)]
    assert plan_of_legs(PROBLEM, "", order).legs == plan_of_legs(PROBLEM, "", [0, 2]).legs


def test_a_numpy_seed_records_the_same() -> None:
    own, numpys = (recorder().truths(kind(3), seed=kind(2)) for kind in (int, np.int64))
    assert own.path == numpys.path
    assert len(own.futures) == 3


COPIES: dict[str, Callable[[Any], Any]] = {
    "pickled": lambda holder: pickle.loads(pickle.dumps(holder)),
    "copied deeply": copy.deepcopy,
    "copied": copy.copy,
}


@pytest.mark.parametrize("way", COPIES)
def test_what_is_frozen_stays_frozen(way: str) -> None:
    """In problems, and in all that they hold; what is derived comes out the same again."""
    end_s, pieces = FUTURES.end_s, FUTURES.pieces
    problem = COPIES[way](PROBLEM)
    for holder in (problem.futures, problem.network, COPIES[way](TRACK), COPIES[way](STATE)):
        for field in fields(holder):
            value = getattr(holder, field.name)
            if isinstance(value, np.ndarray):
                assert not value.flags.writeable, field.name
                assert value.flags.c_contiguous
    np.testing.assert_array_equal(problem.futures.end_s, end_s)
    for mine, other in zip(problem.futures.pieces, pieces, strict=True):
        np.testing.assert_array_equal(mine, other)
        assert mine.flags.writeable == other.flags.writeable


def test_a_copy_needs_no_compilation() -> None:
    """Compiled code knows read-only arrays from others: a copy that thaws compiles it again."""
    from planner.detection.kernels.closest_approach import seen_by_flight

    planner.first_detection(FUTURES, TRACK, 100.0)
    before = len(getattr(seen_by_flight, "signatures"))  # noqa: B009
    thawed = pickle.loads(pickle.dumps((FUTURES, TRACK)))
    planner.first_detection(*thawed, 100.0)
    assert len(getattr(seen_by_flight, "signatures")) == before  # noqa: B009
