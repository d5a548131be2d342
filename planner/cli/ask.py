"""`planner ask`: which question about the target saves most time."""

import argparse
from typing import TYPE_CHECKING

from planner.cli.arguments import add_jobs, add_run, count, moment, permit_of
from planner.cli.printing import print_result
from planner.errors import InputError
from planner.messages import suggestion

if TYPE_CHECKING:
    from planner.network.road_network import RoadNetwork

SUMMARY = "which question about the target saves most time"
DETAILS = """\
Of what somebody could be rung up and asked: on which side it is, which road it
took first, how fast it drove, whether a camera has seen it. A plan is made for
each answer, and what that saves is measured on targets that had no part in it.
The surest gain comes first; what may be nothing is not shown."""
EXAMPLES = (
    ("ask runs/first", "before take-off"),
    ("ask runs/first --at 0:20:00 --camera r1c2", "in flight"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner ask`."""
    add_run(parser)
    parser.add_argument(
        "--at",
        type=moment,
        metavar="TIME",
        help="when the answer comes, seconds or H:M:S since the target was last seen (default: "
        "at take-off)",
    )
    parser.add_argument(
        "--camera",
        action="append",
        default=[],
        metavar="NODE",
        help="a node with a camera; repeatable (default: nodes that every other target passes)",
    )
    parser.add_argument(
        "--targets", type=count, metavar="N", help="how many fresh targets judge the plans"
    )
    add_jobs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print which questions are worth asking, the surest gain first."""
    from planner.cli.progress import progress_bar
    from planner.mission import ask, questions
    from planner.mission.online import Mission, Remembering
    from planner.mission.run_folder import open_run, refuse_no_run
    from planner.mission.several import refuse_several
    from planner.mission.standing import Standing
    from planner.report import news_lines
    from planner.search.methods import method_named

    refuse_no_run(arguments.directory)
    opened, stored = open_run(arguments.directory, permit_of(arguments))
    refuse_several(opened, "ask")
    cameras = [_node(name, opened.network) for name in arguments.camera]
    mission = Mission(Remembering(opened, arguments.jobs), stored.plan, method_named("best"))
    at_s = stored.plan.take_off_s if arguments.at is None else arguments.at
    going_on = mission.heard(Standing(at_s))
    believed = mission.recorder.now(going_on.opened).planning().futures
    targets = ask.fresh_now(mission, going_on, arguments.targets or stored.evaluated["targets"])
    asked_s = max(at_s, questions.BEGINS_S)
    asked = questions.of_a_flight(questions.About(believed, opened.network, asked_s, cameras))
    with progress_bar("questions") as progress:
        found = ask.ask(mission.recorder, going_on, mission.method, asked, targets, progress)
    most_s = ask.most_s(going_on, targets)
    summary = {
        "most_s": most_s,
        "questions": [
            {
                "asked": one.question.asked,
                "answers": dict(zip(one.question.answers, one.likely, strict=True)),
                "saves_s": one.saves_s,
                "ci95_s": [one.low_s, one.high_s],
            }
            for one in found
        ],
    }
    print_result(arguments, summary, news_lines.worth_blocks(found, most_s, len(targets)))
    return 0


def _node(name: str, network: "RoadNetwork") -> int:
    if name not in network.junction_index:
        hint = suggestion(name, network.junction_ids)
        raise InputError(f"--camera: {name} is not a node of the network; {hint}")
    return int(network.junction_index[name])
