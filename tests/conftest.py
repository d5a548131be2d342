"""One cache for all test runs, apart from the user's own: what is in it is keyed by content."""

import logging
import os
from pathlib import Path

import pytest
from hypothesis import settings

from planner.mission.opening import OpenScenario
from support import towns

CACHE = Path(__file__).parent.parent / ".pytest_cache" / "planner"
os.environ["PLANNER_CACHE"] = str(CACHE)
# That the first run compiles is said in whatever test comes first.
logging.getLogger("planner.jit").setLevel(logging.ERROR)

# The same examples in every run: a check that fails tells of the change under test.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


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
