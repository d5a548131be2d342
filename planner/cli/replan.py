"""`planner replan`: what is left of a run, planned anew with what has come in."""

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.cli.arguments import add_jobs, add_run, count, path, permit_of, span
from planner.cli.printing import print_result
from planner.errors import InputError
from planner.messages import as_written

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.detection.paired import Ahead
    from planner.mission.heard import Heard
    from planner.mission.opening import OpenScenario
    from planner.mission.plan_file import StoredPlan
    from planner.mission.replan import Replanned
    from planner.mission.resume import Resumed
    from planner.report.tables import MethodRow

SUMMARY = "plan the rest of a flight anew with what has come in"
DETAILS = """\
UAVs fly on from where their plan has them at TIME, or from where you say they
are. What they have flown without finding the target counts, and so does the
news. The plan there was goes on unless a new one is better on the same
particles. PLACE is a street, a crossing, coordinates or a node, as `planner
now` takes it. Writes a new run, which names the one it is the rest of. UAVs
keep their numbers; one that is lost flies no more."""
EXAMPLES = (
    ('replan runs/town --at 540 --report "seen at Am Studio at -2min, 70 %"', ""),
    ("replan runs/town --at 540 --searched other.gpx --radius-m 200", ""),
    ("replan runs/town --at 540 --delay 120", "an alarm was checked"),
    ("replan runs/town --at 900 --lost-at 52.43,13.53", "found, and lost"),
    ("replan runs/two --at 540 --uav-lost 2", "all others go on"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner replan`."""
    from planner.cli.news_arguments import add_news

    add_run(parser)
    parser.add_argument(
        "--at",
        required=True,
        metavar="TIME",
        help="now: seconds or H:M:S since the target was last seen, or a time of day",
    )
    add_news(parser)
    parser.add_argument(
        "--delay", type=span, metavar="S", help="for how long the UAV has stood still until now"
    )
    parser.add_argument(
        "--uav-at", metavar="PLACE", help="where the UAV is (default: where its plan has it)"
    )
    parser.add_argument(
        "--battery", metavar="9min", help="for how long it can be in the air from now on"
    )
    parser.add_argument(
        "--uav", metavar="N", help="whose these three are, 1 for UAV 1 (default: the only one's)"
    )
    parser.add_argument(
        "--uav-lost",
        action="append",
        default=[],
        metavar="N",
        help="that UAV N flies no more; repeatable",
    )
    parser.add_argument(
        "--joined",
        action="append",
        default=[],
        metavar="PLACE",
        help="that one more UAV, like UAV 1, takes off from there now; repeatable (more by --news)",
    )
    parser.add_argument(
        "--lost-at",
        metavar="PLACE",
        help="where a found target was lost again (of several UAVs say with --uav who followed it)",
    )
    parser.add_argument(
        "--gap", type=span, metavar="S", help="with --lost-at: how long ago (default: 30)"
    )
    parser.add_argument(
        "--method", default="best", metavar="NAME", help="who plans (default: %(default)s)"
    )
    parser.add_argument("--targets", type=count, metavar="N", help="how many fresh targets")
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="DIR",
        help="folder for the new run (default: DIR of the run and the seconds of --at)",
    )
    add_jobs(parser)
    parser.add_argument("--force", action="store_true", help="overwrite the run there")


def run(arguments: argparse.Namespace) -> int:
    """Plan what is left of a run anew, and write it."""
    from planner.cli.backends import recorder_of
    from planner.cli.planning import write_replanned
    from planner.cli.session import holdout_recorded, output_folder, planning_recorded
    from planner.detection.evaluate import evaluate
    from planner.mission import certificate_file, run_folder
    from planner.mission.follow import contact
    from planner.mission.plan_file import figures
    from planner.mission.replan import replanned, sooner
    from planner.report import news_lines
    from planner.search.methods import method_named

    method = method_named(arguments.method)
    run_folder.refuse_no_run(arguments.directory)
    _refuse_own_futures(arguments.directory)
    opened, stored = run_folder.open_run(arguments.directory, permit_of(arguments))
    at_s, heard = _heard(arguments, opened, stored)
    if arguments.output is None:
        whole = arguments.directory.resolve()
        arguments.output = whole.with_name(f"{whole.name}-{at_s:.0f}s")
    with ExitStack() as stack:
        names = (*run_folder.RUN, *certificate_file.PROOF)
        folder = output_folder(stack, arguments, names)
        going_on = _resumed(arguments, opened, stored, heard, at_s)
        planning = planning_recorded(arguments, going_on.opened)
        holdout = holdout_recorded(arguments, going_on.opened, method)
        recorder = recorder_of(arguments, going_on.opened)
        found = replanned(going_on, recorder, method, planning.futures, holdout=holdout)
        parent = _parent(arguments.directory, found)
        row, new, fresh = write_replanned(folder, arguments, found, planning, parent)
    problem = found.problem
    old = evaluate(going_on.incumbent.tracks, fresh, problem.sensor, problem.objective)
    lead = sooner(new, old, going_on.at_s)
    summary: dict[str, Any] = {
        "parent": parent,
        "understood": list(heard.said),
        "evaluated": figures(new),
        "as_it_was": figures(old),
        "sooner": lead._asdict() if lead.is_known else {"share": lead.share},
        "directory": str(arguments.output),
    }
    blocks = [*_blocks(found, row, lead, heard)]
    if arguments.lost_at is not None:
        summary["in_contact"] = contact(new)
        blocks.append(news_lines.contact_line(new, old))
    print_result(arguments, summary, [*blocks, f"written to {arguments.output}"])
    return 0


def _parent(folder: Path, found: "Replanned") -> dict[str, Any]:
    """Return of which run a new one is the rest, as ``plan.json`` has it."""
    from planner.mission.run_folder import PLAN
    from planner.provenance import sha256_of_file

    return {
        "run": folder.resolve().name,
        "sha256": sha256_of_file(folder / PLAN),
        "at_s": found.resumed.at_s,
        "kept": found.is_kept,
    }


def _refuse_own_futures(folder: Path) -> None:
    from planner.mission.run_folder import own_futures

    if own_futures(folder) is not None:
        raise InputError(
            f"{folder}: was planned on --futures, of which nothing is believed that news could "
            "change; plan on the scenario's belief"
        )


def _heard(
    arguments: argparse.Namespace, opened: "OpenScenario", stored: "StoredPlan"
) -> "tuple[float, Heard]":
    """Return the time, and what all that was said means."""
    from planner.cli.news_arguments import heard_of, setting_of
    from planner.mission.news_values import time_of
    from planner.mission.news_words import heard

    setting = setting_of(opened, stored, stored.plan.take_off_s, Path())
    at_s = time_of("--at", arguments.at, setting)
    if at_s < 0.0:
        raise InputError(
            f"--at: {as_written(arguments.at)} is before the target was last seen; give seconds "
            "since then, or a time of day"
        )
    setting = setting._replace(now_s=at_s)
    found = heard_of(arguments, setting)
    for line in _lines(arguments):
        found = found.then(heard(line, setting))
    return at_s, found


def _lines(arguments: argparse.Namespace) -> "Iterator[dict[str, Any]]":
    """Yield what options say of UAVs, as lines of news."""
    whose = {} if arguments.uav is None else {"uav": arguments.uav}
    said: dict[str, Any] = {"place": arguments.uav_at, "battery": arguments.battery}
    said = {key: value for key, value in said.items() if value is not None}
    if whose and not said and arguments.delay is None:
        raise InputError("--uav: goes with --delay, --uav-at or --battery; give one of them")
    if said:
        yield {"kind": "uav", **said, **whose}
    if arguments.delay is not None:
        yield {"kind": "delay", "lasts": arguments.delay, **whose}
    for number in arguments.uav_lost:
        yield {"kind": "lost", "uav": number}
    for place in arguments.joined:
        yield {"kind": "joined", "place": place}


def _resumed(
    arguments: argparse.Namespace,
    opened: "OpenScenario",
    stored: "StoredPlan",
    heard: "Heard",
    at_s: float,
) -> "Resumed":
    """Return the mission from now on."""
    from planner.cli.session import planning_recorded
    from planner.mission import follow
    from planner.mission.replan import refuse_unlikely_reports, with_news, without_news
    from planner.mission.resume import refuse_long_delay, resumed
    from planner.network.place_words import where

    standing = heard.standing_at(at_s)
    refuse_long_delay(opened, stored.plan, standing)
    if arguments.lost_at is not None:
        if heard.news:
            raise InputError("--lost-at: is where it was seen last; leave all other news out")
        place = where(arguments.lost_at, opened.network)
        gap_s = follow.GAP_S if arguments.gap is None else arguments.gap
        permit = permit_of(arguments)
        followed = follow.at_loss(opened, stored.plan, place, standing)
        going_on = resumed(opened, stored.plan, followed)
        return follow.lost(arguments.directory, going_on, place, at_s, gap_s, permit)
    if arguments.gap is not None:
        raise InputError("--gap: goes with --lost-at; give both, or leave it out")
    known = with_news(opened.news, heard.news, same_source=heard.same_source)
    found = resumed(opened, stored.plan, standing, known)
    if heard.news and not heard.insist:
        believed = planning_recorded(arguments, without_news(opened)).futures
        refuse_unlikely_reports(found.opened, believed, heard.news)
    return found


def _blocks(found: "Replanned", row: "MethodRow", lead: "Ahead", heard: "Heard") -> "Iterator[Any]":
    """Yield what to print."""
    from planner.cli.preview import flight_table
    from planner.report import finds, news_lines, tables

    opened = found.resumed.opened
    yield from heard.said
    yield flight_table(found.attempt.plan, opened)
    yield tables.plan_table(row, in_town=not opened.network.is_abstract)
    if row.evaluated is not None and opened.sought > 1:
        yield finds.targets_table(row.evaluated, opened.scenario.target_names)
    yield news_lines.verdict(found, lead)
