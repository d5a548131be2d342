"""What a scenario says of each target, and of how it truly is: tables, written out."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from planner.errors import Fault
from planner.messages import as_written, counted
from planner.scenario.checks import faults_of_fields
from planner.scenario.listed import keys_of, listed
from planner.scenario.profiles import written_out

GOING = ("profile", "goes", "turning")  # in [truth], in place of the target's mixture

Table = Mapping[str, Any]


class Said(NamedTuple):
    """What is said of one target; what is no table is for others to refuse."""

    key: str  # "target", or "target[0]" and on
    known: Any  # its table
    truth_key: str
    true: Any  # the same with what [truth] says otherwise
    alone: Table  # what is said of the truth alone


def said_of_targets(said: Any, truth: Any, folder: Path, faults: list[Fault]) -> list[Said]:
    """Return what is said of each target; of none at all where the list of them is empty.

    Parameters
    ----------
    said, truth
        The sections; [truth] holds for all targets, each of [[truth]] for one.
    folder
        Where the paths of profiles start.
    faults
        What is wrong is added to these.
    """
    if said == []:
        faults.append(Fault("target", "is an empty list; give a table for each one, or [target]"))
    named = listed("target", said)
    keys = keys_of("truth", len(named))
    truths = _truths(truth, len(named), faults)
    known, true = list[Any](), list[tuple[Any, Table]]()
    for key, table in named:
        known.append(_written_out(key, table, folder, faults))
    for key, (_, table), alone in zip(keys, named, truths, strict=True):
        true.append(_true(key, table, alone, folder, faults))
    whole = zip(named, known, keys, true, strict=True)
    return [Said(key, one, name, table, alone) for (key, _), one, name, (table, alone) in whole]


def _truths(truth: Any, targets: int, faults: list[Fault]) -> Sequence[Table]:
    """Return what is said of the truth of each target alone."""
    named = listed("truth", truth)
    for key, table in named:
        if not isinstance(table, dict):
            text = f"should be a table, not {as_written(table)}; give keys as in [target]"
            faults.append(Fault(key, text))
    tables = [table if isinstance(table, dict) else {} for _, table in named]
    if len(tables) == 1:
        return tables * targets
    if len(tables) != targets:
        text = f"has {counted(len(tables), 'table')} for {counted(targets, 'target')}"
        faults.append(Fault("truth", f"{text}; give one for each, or [truth] for all"))
        return [{}] * targets
    return tables


def _true(
    key: str, known: Any, alone: Table, folder: Path, faults: list[Fault]
) -> tuple[Table, Table]:
    """Return the table of what is true of a target, and which of it is said of the truth alone."""
    table = {**(known if isinstance(known, dict) else {}), **alone}
    if "mix" not in alone and any(name in alone for name in GOING):
        table.pop("mix", None)
    found: list[Fault] = []
    table = _written_out(key, table, folder, found)
    faults += faults_of_fields(found, key, alone)
    return table, {**table, **alone} if "profile" in alone else alone


def _written_out(key: str, table: Any, folder: Path, faults: list[Fault]) -> Any:
    return written_out(key, table, folder, faults) if isinstance(table, dict) else table
