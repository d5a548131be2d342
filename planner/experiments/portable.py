"""The frozen instances as files that need neither SUMO nor this program: a folder for each.

The same bytes on every machine with the same versions: NumPy's files are not compressed, as
compressors differ, and all numbers in them are rounded to float32.
"""

import re
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Floats, first_rows
from planner.detection.evaluate import evaluate
from planner.errors import InputError, NotApplicableError
from planner.experiments.instances import Instance, best_known
from planner.experiments.licences import licence_of, notice_of
from planner.files import kit, write_json, written_whole
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.mission.places import frame
from planner.mission.planning import problem_of
from planner.mission.recorder import Recorder
from planner.mission.several import refuse_several
from planner.network.road_network import RoadNetwork
from planner.npz import write_columns
from planner.provenance import sha256_of_file, versions
from planner.search.problem import Problem

SCHEMA, FLIGHT = "planner.instance/1", "planner.flight/1"
ABOUT, PLANNING, JUDGING, BEST = "instance.json", "planning.npz", "judging.npz", "best.json"
JUDGED = 8000  # futures to judge plans on
CHECKSUMS, NOTICE = "SHA256SUMS", "LICENCE.md"
SCORER, FORM, PAGE, TESTS = "score.py", "instance.schema.json", "README.md", "test"
ABOUT_ALL = "about.md"  # the page without its table
OF_AN_INSTANCE = (ABOUT, PLANNING, JUDGING, BEST, NOTICE)
OF_TESTS = (ABOUT, JUDGING, "flights.json", NOTICE)
OF_ALL = (SCORER, FORM, PAGE, CHECKSUMS)
TENTH = 1  # digits of figures: less than what chance moves them by


@dataclass(frozen=True, eq=False)
class Exported:
    """What was written for an instance."""

    name: str
    folder: str
    futures: int
    megabytes: float
    best_s: float  # of the best plan known, on the futures to judge by


def folder_of(name: str) -> str:
    """Return the name of an instance's folder: ``grid4x4-60-km`` for "grid4x4, 60 km"."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def export(here: Path, instance: Instance, recorder: Recorder, judged: int = JUDGED) -> Exported:
    """Write one instance into a folder of its own, and return what was written.

    Parameters
    ----------
    here
        The folder, empty.
    recorder
        Of the instance's scenario.
    judged
        How many futures plans are judged on.

    Raises
    ------
    NotApplicableError
        If its sensor or its UAV cannot be told in few words.
    """
    opened = recorder.opened
    refuse_several(opened, "an instance")
    planning = rounded(recorder.planning().futures)
    judging = rounded(recorder.evaluation(judged).futures)
    problem = problem_of(opened, planning)
    _refuse(instance, problem)
    plan = best_known(instance, problem)
    content = _about(instance, problem)
    content["best_known"] = {
        "method": instance.method,
        "file": BEST,
        PLANNING: _figures(plan, problem, planning),
        JUDGING: _figures(plan, problem, judging),
    }
    write_futures(here / PLANNING, planning)
    write_futures(here / JUDGING, judging)
    write_json(here / BEST, flight_content(plan, instance.name))
    write_json(here / ABOUT, content)
    write_text(here / NOTICE, notice_of(problem.network))
    size = sum(file.stat().st_size for file in here.iterdir()) / 1e6
    best_s = content["best_known"][JUDGING]["expected_detection_time_s"]
    return Exported(instance.name, folder_of(instance.name), len(planning) + judged, size, best_s)


def export_tests(here: Path) -> None:
    """Write the test flights into a folder of their own."""
    for file in kit(TESTS).iterdir():
        shutil.copyfile(file, here / file.name)


def export_rest(here: Path, folder: Path, exported: Sequence[Exported], seed_sha256: str) -> None:
    """Write what lies beside the instances: scorer, schema, a page about all, check sums.

    Parameters
    ----------
    here
        An empty folder for these files, all of which move to ``folder`` together afterwards.
    folder
        Where the exported instances and the test flights are already, a folder each.
    """
    for name in (SCORER, FORM):
        shutil.copyfile(kit(name), here / name)
    write_text(here / PAGE, _page(exported, seed_sha256))
    parts = [*(one.folder for one in exported), TESTS]
    files = {f"{part}/{file.name}": file for part in parts for file in (folder / part).iterdir()}
    files |= {file.name: file for file in here.iterdir()}
    lines = [f"{sha256_of_file(files[name])}  {name}\n" for name in sorted(files)]
    write_text(here / CHECKSUMS, "".join(lines))


def rounded(futures: Futures) -> Futures:
    """Return futures as float32 holds them; of knots that come to share a time, the last."""
    time_s, x_m, y_m = (
        column.astype(np.float32).astype(np.float64)
        for column in (futures.time_s, futures.x_m, futures.y_m)
    )
    whose = np.repeat(np.arange(len(futures)), np.diff(futures.first_knot))
    kept = np.ones(len(time_s), dtype=bool)
    kept[:-1] = (np.diff(time_s) > 0.0) | (np.diff(whose) > 0)
    counts = np.bincount(whose[kept], minlength=len(futures))
    return Futures(
        time_s=time_s[kept],
        x_m=x_m[kept],
        y_m=y_m[kept],
        first_knot=first_rows(counts),
        weight=futures.weight,
        gone=futures.gone,
    )


def write_futures(path: Path, futures: Futures) -> None:
    """Write futures as columns of a NumPy file; formats.md has them."""
    small = {name: getattr(futures, name).astype(np.float32) for name in ("time_s", "x_m", "y_m")}
    write_columns(
        path,
        {
            **small,
            "first_knot": futures.first_knot.astype(np.int64),
            "weight": futures.weight,
            "gone": futures.gone,
        },
    )


def flight_content(plan: Plan, name: str) -> dict[str, Any]:
    """Return a plan as `tools/score.py` reads it: waypoints alone."""
    ways = [np.stack([one.time_s, one.x_m, one.y_m], axis=1).tolist() for one in plan.tracks]
    return {"schema": FLIGHT, "instance": name, "uavs": [{"waypoints": way} for way in ways]}


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    with written_whole(path) as new:
        new.write_text(text, encoding="utf-8", newline="\n")


def _refuse(instance: Instance, problem: Problem) -> None:
    """Raise NotApplicableError for a problem that the files have no words for."""
    is_plain = problem.uav.aircraft is None and problem.airspace is None
    if not (is_plain and problem.sensor.detects_in_transit and problem.objective.by_s is None):
        raise NotApplicableError(
            f"{instance.name}: only instances with the ideal aircraft, no airspace, a sensor that "
            "is always on and the expected time as their objective can be exported"
        )


def _about(instance: Instance, problem: Problem) -> dict[str, Any]:
    network, bound = problem.network, instance.bound
    known, detects = versions(), problem.sensor.detects(problem.uav.speed_mps)
    return {
        "schema": SCHEMA,
        "name": instance.name,
        **network.credit,
        "licence": licence_of(network),
        "made_by": f"sumo-search-planner {known['planner']}, SUMO {known['sumo']}",
        "horizon_s": problem.horizon_s,
        "sensor": {"radius_m": problem.sensor.radius_m, "detects": detects},
        "uavs": [_uav(problem.uav)],
        "network": frame(network),
        "nodes": [
            {"id": name, "x_m": x_m, "y_m": y_m}
            for name, (x_m, y_m) in zip(network.node_ids, network.node_xy_m.tolist(), strict=True)
        ],
        "roads": [_road(network, road) for road in range(len(network.road_ids))],
        "bound": bound and {"bound_s": bound.bound_s, "plans": bound.plan_class, "on": PLANNING},
    }


def _uav(uav: Uav) -> dict[str, Any]:
    lands = np.isfinite(uav.max_flight_time_s)
    return {
        "x_m": uav.x_m,
        "y_m": uav.y_m,
        "take_off_s": uav.take_off_s,
        "speed_mps": uav.speed_mps,
        "landing_s": uav.landing_s if lands else None,
        "return_to_m": uav.return_to_m and list(uav.return_to_m),
    }


def _road(network: RoadNetwork, road: int) -> dict[str, Any]:
    ends = network.road_from[road], network.road_to[road]
    return {
        "id": network.road_ids[road],
        "from": network.node_ids[ends[0]],
        "to": network.node_ids[ends[1]],
        "both_ways": bool(network.both_ways[road]),
        "line_m": _shown(network.shape(road)),
    }


def _shown(line: Floats) -> list[list[float]]:
    points: list[list[float]] = np.round(line, 3).tolist()
    return points


def _figures(plan: Plan, problem: Problem, futures: Futures) -> dict[str, Any]:
    found = evaluate(plan.tracks, futures, problem.sensor, problem.objective)
    low, high = found.found_interval
    return {
        "expected_detection_time_s": round(found.expected_detection_time_s, TENTH),
        "ci95_s": [round(one, TENTH) for one in found.ci95_s],
        "detection_probability": round(found.detection_probability, 4),
        "detection_ci95": [round(low, 4), round(high, 4)],
    }


def chosen(instances: Iterable[Instance], names: Sequence[str]) -> list[Instance]:
    """Return the instances of these names, or folders; all if none is named.

    Raises
    ------
    InputError
        If there is no such instance.
    """
    every = {folder_of(one.name): one for one in instances}
    for name in names:
        if folder_of(name) not in every:
            raise InputError(f"{name}: is no instance; there are {', '.join(every)}")
    return [every[folder_of(name)] for name in names] or [*every.values()]


def _page(exported: Sequence[Exported], seed_sha256: str) -> str:
    rows = [
        f"| [{one.name}]({one.folder}/{ABOUT}) | {one.futures:,} | {one.best_s:,.1f} "
        f"| {one.megabytes:.1f} |\n"
        for one in exported
    ]
    return kit(ABOUT_ALL).read_text(encoding="utf-8").replace("@SEED@", seed_sha256) + "".join(rows)
