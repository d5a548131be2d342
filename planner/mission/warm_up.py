"""All that is compiled, compiled once: thinning, clock, plans by every method, a certificate."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from planner.bounds.certificate import Effort, certified
from planner.errors import NotApplicableError
from planner.futures.kernels.thinning import SampleColumns, farthest_reach
from planner.mission.guess import planning_guess
from planner.mission.opening import open_scenario
from planner.mission.planning import holdout_for, problem_of
from planner.mission.recorder import Recorder
from planner.mission.trial import try_method
from planner.progress import Progress, silent
from planner.search.methods import METHODS, Method, method_named

SCENARIO = "figure3"
SETTINGS = ("search.work=300", "search.particles=8", "search.sampling=iid")
STREETS = ("network.abstract=false",)  # where there is a kinematic clock
GOES = ("target.goes=[{ edge = 'DG' }]",)
# What else is compiled than by each method on its own.
MORE = (
    ("best", "search.free=true"),
    ("cells", "search.work=100000"),  # enough for dashes
    ("greedy", "greedy.tick_s=5"),
    ("best", "search.objective='probability'", "search.by_s=600"),
    ("greedy", "uav.return_to='start'", "uav.max_flight_time_s=1800"),
    ("exact", "sensor.detects_in_transit=false"),
)
# A certificate's functions do not depend on which method made the plan: one of each kind will do.
Kind = tuple[bool, float | None, bool]


def compile_all(progress: Progress = silent) -> None:
    """Compile all kernels that are not compiled yet, for the types that planners call them with."""
    cases = [*((method.name,) for method in METHODS), *MORE]
    samples = SampleColumns(np.array([0, 1]), np.zeros(1), np.zeros(1), np.zeros(1))
    farthest_reach(samples, 1.0, np.zeros(1, dtype=bool))
    for more in ((), GOES):
        opened = open_scenario(SCENARIO, overrides=[*SETTINGS, *STREETS, *more])
        planning_guess(Recorder(opened))
    bounded: set[Kind] = set()
    for done, (name, *settings) in enumerate(cases):
        progress(done, len(cases), name)
        with suppress(NotApplicableError):
            _plan(method_named(name), settings, bounded)
    progress(len(cases), len(cases))


def _plan(method: Method, settings: list[str], bounded: set[Kind]) -> None:
    opened = open_scenario(SCENARIO, overrides=[*SETTINGS, *settings])
    recorder = Recorder(opened, workers=1)
    futures, fresh = recorder.planning().futures, recorder.evaluation(20).futures
    holdout = holdout_for(method, recorder)
    trial = try_method(method, recorder, futures, fresh, holdout=holdout)
    problem = problem_of(opened, futures, method=method)
    problem = problem.replace(uav=replace(problem.uav, take_off_s=trial.plan.take_off_s))
    kind = trial.plan.follows_roads, problem.objective.by_s, problem.sensor.detects_in_transit
    if kind not in bounded:
        certified(problem, trial.plan, Effort())  # its later steps take functions of their own
        bounded.add(kind)
