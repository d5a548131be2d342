"""The folder of a run: the names of its files, and the way back from them to the plan."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.files import RECORD
from planner.futures.store import Recording
from planner.mission.certificate_file import sha256_of_motion, sha256_of_net
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.plan_file import StoredPlan, read_plan
from planner.provenance import sha256_of_file, sha256_of_json

# What `planner plan` and `planner fly` write; a certificate's files are named where it is written.
PLAN, EVALUATION, PROVENANCE = "plan.json", "evaluation.parquet", RECORD
PICTURE, OVERLAY, FLIGHTS = "plan.png", "plan.add.xml", "flights.csv"
OWN_FUTURES = "futures_path"  # key of the record: the file of --futures, if the plan is for that
RUN = (PLAN, EVALUATION, PROVENANCE, PICTURE, OVERLAY, FLIGHTS)


def open_run(folder: Path) -> tuple[OpenScenario, StoredPlan]:
    """Return the scenario of a run as it was planned for, and the plan.

    Raises
    ------
    InputError
        If the folder holds no run, its files are broken, or its network is another one now.
    """
    record = folder / PROVENANCE
    if not record.is_file():
        raise InputError(f"{folder}: holds no run; `planner plan SCENARIO -o {folder}` makes one")
    opened = open_scenario(record)
    sha256 = json.loads(record.read_text(encoding="utf-8")).get("sha256")
    if not isinstance(sha256, dict) or sha256.get("net") != opened.network.sha256:
        raise InputError(
            f"{record}: the plan was made on another network than there is now; plan again"
        )
    return opened, read_plan(folder / PLAN, opened.network)


def own_futures(folder: Path) -> Path | None:
    """Return the file of --futures that a run was planned on, None if it was on the scenario's.

    Raises
    ------
    InputError
        If its record holds something else there.
    """
    record = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
    found = record.get(OWN_FUTURES)
    if found is not None and not (isinstance(found, str) and found.isprintable()):
        raise InputError(f"{folder / PROVENANCE}: {OWN_FUTURES} is no path; plan again")
    return None if found is None else Path(found)


def refuse_other_futures(folder: Path, recording: Recording) -> None:
    """Raise InputError unless a run was planned on the futures given."""
    if not is_planned_on(folder, recording):
        raise InputError(
            f"{folder / PROVENANCE}: the plan was made on other futures than {recording.path} "
            "holds now (the file has changed, or another version recorded them); plan again"
        )


def is_planned_on(folder: Path, recording: Recording) -> bool:
    """Return whether a run was planned on the futures given."""
    record = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
    return bool(record["sha256"].get("futures") == sha256_of_file(recording.path))


def hashes(
    opened: OpenScenario, content: Mapping[str, Any], recording: Recording
) -> dict[str, str]:
    """Return the SHA-256 of what went into a plan and of the plan.

    Two are of what a certificate will hold of it: ``net.json``, and motion with weights.
    """
    return {
        "net": opened.network.sha256,
        "futures": sha256_of_file(recording.path),
        "plan": sha256_of_json(content),
        "roads": sha256_of_net(opened.network),
        "motion": sha256_of_motion(recording.futures),
    }
