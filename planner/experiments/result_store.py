"""What is kept of each condition: files that are whole or not there, one for each."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planner.errors import InputError, OutputError, PlannerError
from planner.experiments.condition import Condition
from planner.experiments.run_condition import Outcome, reason_of
from planner.files import write_json
from planner.guard import parsed_json
from planner.network.read import source_files
from planner.provenance import versions
from planner.scenario.draft import read_scenario

MADE_BY = ("planner", "sumo", "numpy")  # other versions of these may give other results
CONDITIONS, TIMINGS = "conditions", "timings"  # folders of one file for each condition


def _made_by() -> list[str]:
    known = versions()
    return [f"{name} {known[name]}" for name in MADE_BY]


@dataclass(frozen=True)
class ResultStore:
    """The folder of an experiment's results."""

    folder: Path
    _files: dict[Path, str] = field(default_factory=dict)  # digests of network sources
    _made_by: list[str] = field(default_factory=_made_by)

    def clean(self) -> None:
        """Remove what a killed run left half-written.

        Raises
        ------
        OutputError
            If the place is taken by a file.
        """
        if self.folder.exists() and not self.folder.is_dir():
            raise OutputError(f"{self.folder}: is not a folder; choose another name")
        for name in (CONDITIONS, TIMINGS):
            for half in (self.folder / name).glob(".*.json"):
                half.unlink(missing_ok=True)

    def figures(self, condition: Condition) -> dict[str, Any] | None:
        """Return what came of a condition if it is finished, None if it has to be run."""
        found = _read(self._path(CONDITIONS, condition))
        if not found or not found.get("final") or found.get("made_from") != self._origin(condition):
            return None
        figures = found.get("figures")
        return figures if isinstance(figures, dict) else None

    def timing(self, condition: Condition) -> dict[str, Any]:
        """Return the wall-clock times of a condition and the like."""
        return _read(self._path(TIMINGS, condition)) or {}

    def keep(self, condition: Condition, outcome: Outcome) -> None:
        """Write what came of a condition.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        content = {
            "condition": condition.as_dict(),
            "made_from": self._origin(condition),
            "final": outcome.final,
            "figures": outcome.figures,
        }
        write_json(self._path(TIMINGS, condition), outcome.timing)
        write_json(self._path(CONDITIONS, condition), content)  # last: it is what counts

    def _path(self, folder: str, condition: Condition) -> Path:
        return self.folder / folder / f"{condition.id}.json"

    def _origin(self, condition: Condition) -> str:
        """Return a digest of the scenario and the program as they are now.

        What was run on another scenario, or by another version, counts no more.
        """
        try:
            scenario = read_scenario(
                condition.place, preset=condition.preset, overrides=condition.settings
            )
            named = sorted(source_files(scenario.network, scenario.folder).items())
        except PlannerError as error:
            return _digest([reason_of(error), *self._made_by])
        areas = [scenario.folder / name for _, name in sorted(scenario.airspace.files.items())]
        files = [self._file_digest(file) for file in [*(path for _, path in named), *areas]]
        return _digest([json.dumps(scenario.as_dict(), sort_keys=True), *files, *self._made_by])

    def _file_digest(self, path: Path) -> str:
        if path not in self._files:
            self._files[path] = hashlib.sha256(path.read_bytes()).hexdigest()
        return self._files[path]


def _digest(parts: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def _read(path: Path) -> dict[str, Any] | None:
    try:
        found = parsed_json(path.read_text(encoding="utf-8-sig"))
    except (FileNotFoundError, ValueError):
        return None  # not there, or damaged: it is run again
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); move it away") from error
    return found if isinstance(found, dict) else None
