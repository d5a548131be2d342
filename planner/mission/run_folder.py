"""The folder of a run: the names of its files, and the way back from them to the plan."""

from collections.abc import Mapping
from itertools import count, takewhile
from pathlib import Path
from typing import Any

from planner.errors import InputError, ScenarioError
from planner.files import RECORD
from planner.futures.store import Recording
from planner.futures.traffic import NO_PERMIT, Permit
from planner.guard import read_json
from planner.mission.certificate_file import sha256_of_motion, sha256_of_net
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.own_futures import OwnFutures
from planner.mission.plan_file import StoredPlan, read_plan
from planner.provenance import sha256_of_file, sha256_of_json
from planner.scenario.source import there_now

# What `planner plan` and `planner fly` write; a certificate's files are named where it is written.
PLAN, EVALUATION, PROVENANCE = "plan.json", "evaluation.parquet", RECORD
PICTURE, OVERLAY, FLIGHTS = "plan.png", "plan.add.xml", "flights.csv"
PAGE = "page.html"
CONFIG, SETTINGS = "plan.sumocfg", "plan.view.xml"  # what sumo-gui opens, and how it draws it
NET = "plan.net.xml.gz"  # which it opens where the net is only in the cache
GUI = (CONFIG, OVERLAY, SETTINGS, NET)
# Keys of the record, if the plan is for --futures: the file, and its time that is time 0.
OWN_FUTURES, OWN_BEGIN = "futures_path", "futures_begin_s"
OTHER_TARGETS = (
    "these targets are drawn from the scenario's belief; the plan was made on --futures, "
    "which may differ"
)
RUN = (PLAN, EVALUATION, PROVENANCE, PICTURE, FLIGHTS, PAGE, *GUI)


def open_run(folder: Path, permit: Permit = NO_PERMIT) -> tuple[OpenScenario, StoredPlan]:
    """Return the scenario of a run as it was planned for, and the plan.

    Parameters
    ----------
    permit
        As `open_scenario` takes it.

    Raises
    ------
    InputError
        If the folder holds no run, its files are broken, or its network is another one now.
    """
    refuse_no_run(folder)
    record = folder / PROVENANCE
    try:
        opened = open_scenario(record, permit=permit)
    except ScenarioError as error:
        place = Path(error.source).parent
        if not place.is_dir():
            raise InputError(
                f"{record}: there is no file {error.source} any more, where its scenario lay; "
                "move it back together with the run, or plan again"
            ) from error
        raise
    sha256 = record_of(folder).get("sha256")
    if not isinstance(sha256, dict) or sha256.get("net") != opened.network.sha256:
        raise InputError(
            f"{record}: the plan was made on another network than there is now; plan again"
        )
    return opened, read_plan(folder / PLAN, opened.network)


def refuse_no_run(folder: Path) -> None:
    """Raise InputError unless a folder holds a run."""
    if not (folder / PROVENANCE).is_file():
        raise InputError(f"{folder}: holds no run; `planner plan SCENARIO -o {folder}` makes one")


def record_of(folder: Path) -> dict[str, Any]:
    """Return what a run's ``run.json`` holds.

    Raises
    ------
    InputError
        If it cannot be read or holds no table.
    """
    record = read_json(folder / PROVENANCE)
    if not isinstance(record, dict):
        raise InputError(f"{folder / PROVENANCE}: is no record of a run; plan again")
    return record


def own_futures(folder: Path) -> OwnFutures | None:
    """Return the futures of --futures that a run was planned on, None if on the scenario's.

    Raises
    ------
    InputError
        If its record holds something else there.
    """
    record = record_of(folder)
    keys = takewhile(lambda key: record.get(key) is not None, map(own_key, count()))
    paths = [_there_now(folder / PROVENANCE, record, key) for key in keys]
    if not paths:
        return None
    begin_s = record.get(OWN_BEGIN)
    if not (begin_s is None or isinstance(begin_s, int | float)):
        raise InputError(f"{folder / PROVENANCE}: {OWN_BEGIN} is no number; plan again")
    return OwnFutures(paths[0], begin_s, tuple(paths[1:]))


def own_key(number: int) -> str:
    """Return by which key a run's record names a file of --futures, from 0 on."""
    return f"{OWN_FUTURES}_{number + 1}" if number else OWN_FUTURES


def _there_now(run: Path, record: Mapping[str, Any], key: str) -> Path:
    if not (isinstance(record[key], str) and record[key].isprintable()):
        raise InputError(f"{run}: {key} is no path; plan again")
    return there_now(run, record, key)


def refuse_other_futures(folder: Path, recording: Recording) -> None:
    """Raise InputError unless a run was planned on the futures given."""
    if not is_planned_on(folder, recording):
        raise InputError(
            f"{folder / PROVENANCE}: the plan was made on other futures than {recording.path} "
            "holds now (the file has changed, or another version recorded them); plan again"
        )


def is_planned_on(folder: Path, recording: Recording) -> bool:
    """Return whether a run was planned on the futures given."""
    sha256 = record_of(folder).get("sha256")
    return isinstance(sha256, dict) and sha256.get("futures") == recording.sha256


def hashes(
    opened: OpenScenario, content: Mapping[str, Any], recording: Recording
) -> dict[str, str]:
    """Return the SHA-256 of what went into a plan and of the plan.

    Two are of what a certificate will hold of it: ``net.json``, and motion with weights.
    """
    scenario = opened.scenario
    return {
        "net": opened.network.sha256,
        "futures": recording.sha256,
        "plan": sha256_of_json(content),
        "roads": sha256_of_net(opened.network),
        "motion": sha256_of_motion(recording.futures),
        **{
            f"airspace.{key}": sha256_of_file(scenario.folder / name)
            for key, name in scenario.airspace.files.items()
        },
        **({} if opened.traffic is None else {"traffic": opened.traffic.digest}),
    }
