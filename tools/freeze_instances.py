"""Search long for the best plan of each frozen instance and write them into instances.toml.

A plan is chosen on particles that had no part in making it, never on the fresh targets on which
its value is then measured. A known plan is replaced only by one that those particles prefer.
"""

import argparse
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner import Plan, Recorder, RoadNetwork, make_plan, method_named
from planner.experiments.instances import (
    FILE,
    Instance,
    best_known,
    bound_on,
    flown_again,
    instances_path,
    read_instances,
)
from planner.files import written_whole
from planner.flight.legs import leg_names
from planner.messages import percent
from planner.mission.planning import budget_of, problem_of
from planner.mission.sample_sizes import FRESH_TARGETS
from planner.scenario.toml_text import toml_text
from planner.search.sightings import holdout_value

HEADER = """\
# Search problems to compare methods on: `planner compare --instances` plans for each of them with
# every method. `plan` is the best plan of roads known, ! before a road flown against its
# direction; `stops`, x and y in metres and seconds of hovering, stand in its place where the best
# plan known leaves the roads. Its value is E[min(tau, horizon)] in seconds on 4,000 fresh targets
# of the seed (or `targets`), which no planner sees, with its 95 % interval. `bound_s` is a lower
# bound on what plans can have on the particles planned with, where the best plan known has
# `planned_s`: plans over roads, or, where that takes too large a table or the plan leaves the
# roads, any flights. tools/freeze_instances.py wrote this file.
"""
METHODS = ("best", "lns", "beam")
GRIDS = (4, 5, 6, 7, 8)
DISTANCES_M = (0.0, 60e3, 120e3, 300e3)
TREES = (("figure3", -30e3), ("figure3", -60e3), ("figure3-gone", -30e3), ("figure3-gone", -60e3))


def problems() -> Iterator[Instance]:
    """Yield the instances, without plans."""
    for size in GRIDS:
        for u0_m in DISTANCES_M:
            scenario = f"grid{size}x{size}"
            settings = (f"uav.start.distance_m={toml_text(u0_m)}",)
            yield _open(f"{scenario}, {u0_m / 1000:.0f} km", scenario, settings)
    for scenario, x_m in TREES:
        settings = (f"uav.start.x_m={toml_text(x_m)}",)
        yield _open(f"{scenario}, {-x_m / 1000:.0f} km", scenario, settings)
    for scenario in TOWNS:
        yield replace(_open(scenario, scenario, IN_TOWN), targets=TOWN_TARGETS)


TOWNS = ("berlin", "a10kw", "bs3d")  # on nets that come with SUMO
IN_TOWN = ("search.particles=2000", 'uav.aircraft="ideal"')
TOWN_TARGETS = 2100


def _open(name: str, scenario: str, overrides: tuple[str, ...]) -> Instance:
    return Instance(name, scenario, overrides, 1, "", 0.0, 0.0, 0.0, ())


def searched(instance: Instance, work: int) -> Instance:
    """Return an instance with the best plan found, or the one it has if that is better."""
    opened = instance.opened()
    recorder = Recorder(opened)
    futures = recorder.planning().futures
    enumerated = opened.scenario.search.sampling == "all"
    holdout = None if enumerated else recorder.holdout().futures
    problem = problem_of(opened, futures).replace(holdout=holdout)
    candidates = []
    for name in METHODS:
        budget = replace(budget_of(opened), work=work)
        plan = make_plan(
            method_named(name), opened, recorder, futures, holdout=holdout, budget=budget
        ).plan
        found = _with_plan(replace(instance, method=name), opened.network, plan)
        candidates.append((holdout_value(problem, best_known(found, problem)), found))
    if instance.plan or instance.stops:
        candidates.append((holdout_value(problem, best_known(instance, problem)), instance))
    _, found = max(candidates, key=lambda candidate: candidate[0])
    seen = flown_again(found, opened, recorder.evaluation(instance.targets).futures)
    low_s, high_s = seen.ci95_s
    return replace(found, value_s=seen.expected_detection_time_s, low_s=low_s, high_s=high_s)


def _with_plan(instance: Instance, network: RoadNetwork, plan: Plan) -> Instance:
    """Return an instance with another plan: of roads, or of stops where it leaves them."""
    if plan.follows_roads:
        legs = [flown.leg for flown_by in plan.legs for flown in flown_by]
        return replace(instance, plan=tuple(leg_names(network, legs)), stops=())
    (track,) = plan.tracks
    at = np.round(np.stack([track.x_m, track.y_m], axis=1), 1)
    stays = np.append(np.all(at[1:] == at[:-1], axis=1), False)
    arrives = np.append(True, ~stays[:-1])  # the first point of each stay
    waits_s = np.where(stays, np.diff(track.time_s, append=track.end_s), 0.0)
    rows = np.column_stack([at, np.ceil(10 * waits_s) / 10])[arrives]
    return replace(instance, plan=(), stops=tuple(map(tuple, rows.tolist())))


def text_of(instance: Instance) -> str:
    """Return an instance as the file has it."""
    settings = dict(override.split("=", 1) for override in instance.overrides)
    lines = [
        "[[instance]]",
        f"name = {json.dumps(instance.name)}",
        f"scenario = {json.dumps(instance.scenario)}",
        f"seed = {instance.seed}",
        "set = { " + ", ".join(f'"{key}" = {value}' for key, value in settings.items()) + " }",
        f"method = {json.dumps(instance.method)}",
        f"value_s = {instance.value_s:.1f}",
        f"low_s = {instance.low_s:.1f}",
        f"high_s = {instance.high_s:.1f}",
        f'plan = "{" ".join(instance.plan)}"',
    ]
    lines += [f"stops = {[list(one) for one in instance.stops]}"] if instance.stops else []
    lines += [f"targets = {instance.targets}"] if instance.targets != FRESH_TARGETS else []
    bound = instance.bound
    if bound is not None:
        lines += [
            f"planned_s = {bound.planned_s:.1f}",
            f"bound_s = {math.floor(10 * bound.bound_s) / 10:.1f}",  # downwards: it is to hold
            f"bound_for = {json.dumps(bound.plan_class)}",
        ]
        lines += [f"bound_note = {json.dumps(bound.note)}"] if bound.note else []
    return "\n".join(lines) + "\n"


def main(argv: Sequence[str] | None = None) -> None:
    """Search and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", type=int, default=500_000, help="of each search (500,000)")
    parser.add_argument("--steps", type=int, default=600, help="towards each bound (600)")
    parser.add_argument(
        "--bounds-only", action="store_true", help="keep all plans; seek their bounds anew"
    )
    parser.add_argument("--only", action="append", help="name of an instance; the others stay")
    parser.add_argument("-o", "--output", type=Path, default=instances_path(), help=f"({FILE})")
    wanted = parser.parse_args(argv)
    old = read_instances(wanted.output) if wanted.output.exists() else []
    found = {one.name: one for one in problems()} | {one.name: one for one in old}
    unknown = sorted({*wanted.only} - {*found}) if wanted.only else []
    if unknown:
        parser.error(f"--only {unknown[0]}: there is no such instance")
    for name in wanted.only or list(found):
        if not wanted.bounds_only:
            found[name] = searched(found[name], wanted.work)
        one = found[name]
        futures = Recorder(one.opened()).planning().futures
        bound = bound_on(one, futures, wanted.steps)
        found[name] = replace(one, bound=bound)
        print(
            f"{name}: {one.value_s:,.1f} s by {one.method}, {percent(bound.gap)} above the bound "
            f"for {bound.plan_class}",
            flush=True,
        )
        write(wanted.output, [one for one in found.values() if one.plan or one.stops])


def write(path: Path, instances: Sequence[Instance]) -> None:
    """Write the file, whole or not at all."""
    with written_whole(path) as new:
        new.write_text("\n".join([HEADER, *map(text_of, instances)]), encoding="utf-8")


if __name__ == "__main__":
    main()
