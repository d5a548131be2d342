"""One cache for all test runs, apart from the user's own: what is in it is keyed by content.

Only compiled code is the user's own: what `planner doctor --compile` has made is not made again.
"""

import importlib
import logging
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from planner.files import write_json
from planner.mission import certificate_file, plan_file
from planner.mission.opening import OpenScenario
from support import plan_schema, towns

CACHE = Path(__file__).parent.parent / ".pytest_cache" / "planner"
importlib.import_module("planner.jit")  # finds the compiled code in the user's cache
os.environ["PLANNER_CACHE"] = str(CACHE)
# That the first run compiles is said in whatever test comes first.
logging.getLogger("planner.jit").setLevel(logging.ERROR)

# The same examples in every run: a check that fails tells of the change under test.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what is slow, or one process ends long after the others."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.fixture(scope="session", autouse=True)
def plans_keep_to_their_schema() -> Iterator[None]:
    """Every plan that a test writes is as docs/plan.schema.json says."""

    def write(path: Path, content: Mapping[str, Any]) -> None:
        if path.name == "plan.json" and content.get("schema") != "planner.plan/1":
            plan_schema.refuse(content)
        write_json(path, content)

    with pytest.MonkeyPatch.context() as patch:
        for module in (plan_file, certificate_file):
            patch.setattr(module, "write_json", write)
        yield


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own, with nothing in it."""
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture(scope="session")
def berlin() -> OpenScenario:
    """A town on a net that comes with SUMO."""
    return towns.berlin()


@pytest.fixture(scope="session")
def luxembourg(tmp_path_factory: pytest.TempPathFactory) -> OpenScenario:
    """A town of 5,700 edges; the test is skipped where its data are not."""
    return towns.luxembourg(tmp_path_factory.mktemp("luxembourg"))
