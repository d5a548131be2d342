"""Plans that others submit for the frozen instances, and the page of their results."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.errors import InputError
from planner.experiments.instances import BEST_KNOWN, Instance, best_known
from planner.experiments.portable import JUDGED, folder_of
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.guard import read_json, read_text
from planner.messages import percent
from planner.mission.planning import problem_of
from planner.mission.recorder import Recorder
from planner.search.problem import Problem
from planner.search.result import SearchResult
from planner.search.sound import fault_of

# Of the seed of the third set of futures, which is opened with the next release.
SEED_SHA256 = "e2970a128e6d6dccf1860bb571b5dd011bef13ad19f0b350fe6b947c473e10be"
SEED_BYTES = 7  # of the digest that the futures are drawn by: a whole number that TOML holds

Scores = Mapping[tuple[str, str], Evaluation]  # by instance and whose plan


@dataclass(frozen=True, eq=False)
class Submission:
    """One plan for one instance."""

    whose: str  # the folder that it was in
    instance: str
    path: Path
    ways: tuple[Any, ...]  # the waypoints of each UAV as they were read


def read_seed(path: Path, sha256: str = SEED_SHA256) -> int:
    """Return the seed of the third set of futures.

    Raises
    ------
    InputError
        If it is not the one whose digest was published.
    """
    secret = read_text(path).strip()
    if hashlib.sha256(secret.encode()).hexdigest() != sha256:
        raise InputError(f"{path}: is not the seed that was promised, with SHA-256 {sha256}")
    digest = hashlib.sha256(f"third set {secret}".encode()).digest()
    return int.from_bytes(digest[:SEED_BYTES], "big")


def read_submissions(folder: Path, instances: Sequence[Instance]) -> list[Submission]:
    """Return the plans in ``folder/WHOSE/*.json``, sorted.

    Raises
    ------
    InputError
        If there are none, one is broken, or one is for no instance.
    """
    paths = sorted(folder.glob("*/*.json"))
    if not paths:
        raise InputError(f"{folder}: holds no plans; write them to {folder}/NAME/INSTANCE.json")
    known = {folder_of(one.name): one.name for one in instances}
    return [_submission(path, known) for path in paths]


def _submission(path: Path, known: Mapping[str, str]) -> Submission:
    content = read_json(path)
    try:
        name, ways = content["instance"], tuple(one["waypoints"] for one in content["uavs"])
    except (KeyError, TypeError) as error:
        raise InputError(f'{path}: should hold "instance" and "uavs" with "waypoints"') from error
    if folder_of(str(name)) not in known:
        raise InputError(f"{path}: instance: {name} is none; there are {', '.join(known)}")
    return Submission(path.parent.name, known[folder_of(name)], path, ways)


def plan_of(submission: Submission, problem: Problem) -> Plan:
    """Return a submitted plan.

    Raises
    ------
    InputError
        If the problem's UAV cannot fly it.
    """
    try:
        tracks = tuple(_track(np.array(way, dtype=np.float64)) for way in submission.ways)
    except ValueError as error:
        raise InputError(
            f"{submission.path}: waypoints: should be rows of time_s, x_m, y_m ({error})"
        ) from error
    plan = Plan(submission.whose, tracks, ((),) * len(tracks))
    fault = fault_of(problem, SearchResult(plan))
    if fault is not None:
        raise InputError(f"{submission.path}: {fault}")
    return plan


def _track(way: Any) -> Track:
    if way.ndim != 2 or way.shape[1] < 3 or len(way) == 0:
        raise ValueError("they are not")
    time_s, x_m, y_m = way[:, :3].T
    return Track(time_s, x_m, y_m, np.array([[time_s[0], time_s[-1]]]))


def targets_of(recorder: Recorder, seed: int | None, judged: int = JUDGED) -> Futures:
    """Return the third set of futures; without its seed, those that everybody judges by."""
    if seed is None:
        return recorder.evaluation(judged).futures
    return recorder.truths(judged, seed=seed).futures


def scores_on(
    instance: Instance, submissions: Sequence[Submission], recorder: Recorder, targets: Futures
) -> dict[tuple[str, str], Evaluation]:
    """Return what the submitted plans for an instance are worth, and the best plan known."""
    problem = problem_of(recorder.opened, targets)
    plans = {BEST_KNOWN: best_known(instance, problem)}
    plans |= {one.whose: plan_of(one, problem) for one in submissions}
    return {
        (instance.name, whose): evaluate(plan.tracks, targets, problem.sensor, problem.objective)
        for whose, plan in plans.items()
    }


def results_page(scores: Scores, *, seed: str) -> str:
    """Return the results as a page of Markdown.

    Parameters
    ----------
    seed
        Of the third set of futures; empty: it is still secret.
    """
    whose = list(dict.fromkeys(name for _, name in scores))
    instances = list(dict.fromkeys(name for name, _ in scores))
    targets = len(next(iter(scores.values())).weight)
    on = f"a third set of {targets:,} futures, seed `{seed}`" if seed else SECRET.format(targets)
    lines = [HEAD.format(on=on, sha256=SEED_SHA256)]
    lines += ["| instance | " + " | ".join(whose) + " |", "|---|" + "--:|" * len(whose)]
    for name in instances:
        values = {one: scores[name, one] for one in whose if (name, one) in scores}
        least_s = min(one.expected_detection_time_s for one in values.values())
        cells = [_cell(values.get(one), least_s) for one in whose]
        lines.append("| " + " | ".join([name, *cells]) + " |")
    return "\n".join(lines) + "\n"


def _cell(found: Evaluation | None, least_s: float) -> str:
    if found is None:
        return "-"
    expected_s = found.expected_detection_time_s
    half_s = found.ci95_s[1] - expected_s
    text = f"{expected_s:,.1f} ± {half_s:.1f} s, {percent(found.detection_probability)}"
    return f"**{text}**" if expected_s == least_s else text


SECRET = (
    "the {:,} futures that everybody judges by, and may have planned on; the third set is still "
    "secret"
)
HEAD = """\
# Results on the exported instances

E[min(tau, horizon)] with half its 95 % interval, and the probability of detection, on {on}.
The least time is bold.
SHA-256 of the seed of the third set: `{sha256}`.

`planner instances results` made this page.
"""
