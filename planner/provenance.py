"""The origin of a result: versions, arguments, scenario, seed, hashes and times."""

import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

SCHEMA = "planner.run/1"

# The packages that can change a result, with their names on PyPI.
PACKAGES = {
    "planner": "sumo-search-planner",
    "sumo": "eclipse-sumo",
    "libsumo": "libsumo",
    "sumolib": "sumolib",
    "numpy": "numpy",
    "numba": "numba",
    "scipy": "scipy",
    "networkx": "networkx",
    "pandas": "pandas",
    "pyarrow": "pyarrow",
    "pydantic": "pydantic",
    "matplotlib": "matplotlib",
}


def provenance(
    arguments: Sequence[str],
    scenario: Mapping[str, Any],
    *,
    seed: int,
    sha256: Mapping[str, str] | None = None,
    started: datetime | None = None,
    took_s: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Return what a ``run.json`` holds, ready for ``json.dumps``.

    Wall-clock times are in this file alone, so that all others repeat byte for byte.

    Parameters
    ----------
    arguments
        The command line, program first.
    scenario
        The scenario with all defaults and overrides in place.
    seed
        The scenario's seed, from which all random streams derive.
    sha256
        Digests of inputs and outputs (net, futures, plan), by name.
    started
        When the run began, with its time zone; now if not given.
    took_s
        Wall-clock seconds of the parts of the run, by name.
    """
    return {
        "schema": SCHEMA,
        "arguments": list(arguments),
        "seed": seed,
        "scenario": dict(scenario),
        "sha256": {"scenario": sha256_of_json(scenario), **(sha256 or {})},
        "versions": versions(),
        "platform": {
            "python": platform.python_version(),
            "implementation": platform.python_implementation(),
            "system": platform.platform(),
            "machine": platform.machine(),
            "cores": os.cpu_count(),
        },
        "started": (started or datetime.now(UTC)).isoformat(timespec="seconds"),
        "took_s": dict(took_s or {}),
    }


def versions() -> dict[str, str | None]:
    """Return the version of each package that can change a result; None where it is missing."""
    return {name: version_of(package) for name, package in PACKAGES.items()}


def sha256_of_json(data: Mapping[str, Any]) -> str:
    """Return the SHA-256 of plain data, whatever the order of its keys, in hexadecimal."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


def sha256_of_file(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@cache  # a batch asks for each condition, and an answer costs milliseconds
def version_of(package: str) -> str | None:
    """Return the version of an installed package, None where it is missing."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None
