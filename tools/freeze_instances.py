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

from planner import Recorder, make_plan, method_named
from planner.experiments.instances import (
    FILE,
    Instance,
    bound_on,
    flown_again,
    instances_path,
    read_instances,
)
from planner.files import written_whole
from planner.flight.legs import leg_names, legs_named
from planner.mission.recorder import budget_of, problem_of
from planner.scenario.toml_text import toml_text
from planner.search.plan import plan_of_legs
from planner.search.sightings import holdout_value

HEADER = """\
# Search problems to compare methods on: `planner compare --instances` plans for each of them with
# every method. `plan` is the best plan of roads known, ! before a road flown against its
# direction; its value is E[min(tau, horizon)] in seconds on the 4,000 fresh targets of the seed,
# which no planner sees, with its 95 % interval. `bound_s` is a lower bound on what plans can have
# on the particles planned with, where the best plan known has `planned_s`: plans over roads, or,
# where that takes too large a table, any flights. tools/freeze_instances.py wrote this file.
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
        legs = [flown.leg for flown_by in plan.legs for flown in flown_by]
        candidates.append((holdout_value(problem, plan), name, legs))
    if instance.plan:
        legs = legs_named(opened.network, instance.plan)
        worth = holdout_value(problem, plan_of_legs(problem, instance.method, legs))
        candidates.append((worth, instance.method, legs))
    _, method, legs = max(candidates, key=lambda candidate: candidate[0])
    found = replace(instance, method=method, plan=tuple(leg_names(opened.network, legs)))
    seen = flown_again(found, opened, recorder.evaluation().futures)
    low_s, high_s = seen.ci95_s
    return replace(found, value_s=seen.expected_detection_time_s, low_s=low_s, high_s=high_s)


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
            f"{name}: {one.value_s:,.1f} s by {one.method}, {bound.gap:.1%} above the bound for "
            f"{bound.plan_class}",
            flush=True,
        )
        write(wanted.output, [one for one in found.values() if one.plan])


def write(path: Path, instances: Sequence[Instance]) -> None:
    """Write the file, whole or not at all."""
    with written_whole(path) as new:
        new.write_text("\n".join([HEADER, *map(text_of, instances)]), encoding="utf-8")


if __name__ == "__main__":
    main()
