"""The environment: what Gymnasium asks of one, and two agents as witnesses."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.sensor import Sensor
from planner.errors import NotApplicableError
from planner.flight.legs import Legs
from planner.search.contract_problems import PROBLEMS
from planner.search.greedy import greedy
from planner.search.problem import Budget, Problem

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed: [gym]")

from gymnasium.utils.env_checker import check_env  # noqa: E402

from planner.search.road_search_env import RoadSearch  # noqa: E402

PAGE = Path(__file__).parents[2] / "docs" / "gym.md"


@pytest.mark.parametrize("name", PROBLEMS)
def test_it_is_an_environment(name: str) -> None:
    check_env(RoadSearch(PROBLEMS[name]()), skip_render_check=True)


def expected_s(problem: Problem, env: RoadSearch) -> float:
    return evaluate(env.plan().tracks, problem.futures, problem.sensor, problem.objective).figure


@pytest.mark.parametrize("name", ["paper_figure3", "short_return", "two_way", "far_grid"])
def test_a_random_agent_earns_what_its_plan_does(name: str) -> None:
    problem = PROBLEMS[name]()
    env, rng = RoadSearch(problem), np.random.default_rng(3)
    for _ in range(3):
        observed, info = env.reset(seed=1)
        total, over = 0.0, False
        while not over and len(env.state.order) < 12:
            action = int(rng.choice(np.flatnonzero(info["action_mask"])))
            gain = env.gains()[action]
            observed, reward, over, truncated, info = env.step(action)
            assert reward == pytest.approx(gain)
            assert not truncated
            assert env.observation_space.contains(observed)
            total += reward
        if env.problem.uav.return_to_m is None:  # the way home may see more
            assert problem.objective.value(total) == pytest.approx(expected_s(problem, env))
        else:
            assert problem.objective.value(total) >= expected_s(problem, env) - 1e-6


@pytest.mark.parametrize("name", ["paper_figure3", "far_grid", "by_deadline"])
def test_a_greedy_agent_flies_as_the_planner_does(name: str) -> None:
    problem = PROBLEMS[name]()
    env, roads = RoadSearch(problem), 5
    env.reset()
    for _ in range(roads):
        gains = env.gains()
        gains[1::2][~problem.network.both_ways] = -np.inf  # roads in their own direction,
        for road in env.state.roads:  # each once
            gains[list(Legs.both(road))] = -np.inf
        if np.isinf(gains.max()):
            break
        env.step(int(np.argmax(gains >= gains.max() - 1e-6)))
    made = greedy(problem, budget=Budget(roads), rng=np.random.default_rng(1))
    assert tuple(flown.leg for flown in made.plan.legs[0]) == env.state.order
    mine = evaluate(made.plan.tracks, problem.futures, problem.sensor, problem.objective)
    assert mine.figure == expected_s(problem, env)


def test_what_cannot_be_flown_ends_the_flight() -> None:
    env = RoadSearch(PROBLEMS["short_return"]())
    env.reset()
    over = False
    while not over:
        _, _, over, _, info = env.step(int(np.argmax(env.action_mask())))
    assert not info["action_mask"].any()
    before = env.state.order
    _, reward, over, _, _ = env.step(0)
    assert (reward, over, env.state.order) == (0.0, True, before)
    assert np.isinf(env.gains()).all()


def test_what_is_unseen_is_told_by_road() -> None:
    problem = PROBLEMS["paper_figure3"]()
    env = RoadSearch(problem)
    observed, _ = env.reset()
    ab = problem.network.road_ids.index("AB")
    assert observed["unseen"].argmax() == ab
    assert observed["unseen"].sum() == pytest.approx(1.0, abs=1e-6)
    env.state = env.state.absorb(np.zeros(len(problem.futures)))
    later, *_ = env.step(0)
    assert later["unseen"].sum() == 0.0


def test_an_imperfect_sensor_is_refused() -> None:
    problem = PROBLEMS["paper_figure3"]()
    misses = dataclasses.replace(problem, sensor=Sensor(200.0, rate_per_s=0.1))
    with pytest.raises(NotApplicableError, match="perfect sensor"):
        RoadSearch(misses)


def test_the_page_runs_as_it_stands(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    exec(compile(code, str(PAGE), "exec"), {"__name__": "page"})
    chance, best = (re.findall(r"(\d+) s", line) for line in capsys.readouterr().out.splitlines())
    assert int(best[1]) < int(chance[1])
