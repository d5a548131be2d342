"""The wheel: built without a network, installed into a folder, and used from another one."""

import os
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[1]

pytestmark = pytest.mark.slow


def run(*command: object, folder: Path, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, *map(str, command)],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    offline = ("--no-deps", "--no-build-isolation", "--no-index")
    run("-m", "pip", "wheel", "--quiet", *offline, "--wheel-dir", folder, ROOT, folder=folder)
    (made,) = folder.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("installed")
    target = ("--no-deps", "--no-index", "--target", folder)
    run("-m", "pip", "install", "--quiet", *target, wheel, folder=folder)
    return folder


def test_the_wheel_holds_the_package_and_its_scenarios(wheel: Path) -> None:
    held = {name for name in ZipFile(wheel).namelist() if ".dist-info/" not in name}
    # Target profiles and aircraft, and what a page is made of, are read beside the code.
    kinds = (".py", ".pyi", ".toml", ".html", ".css", ".js")
    code = [path for path in (ROOT / "planner").rglob("*") if path.suffix in kinds]
    sources = {path.relative_to(ROOT).as_posix() for path in code}
    nets = {path for path in (ROOT / "sumo_nets").rglob("*.*") if path.parent.name != "claims"}
    scenarios = {f"planner/{path.relative_to(ROOT).as_posix()}" for path in nets if path.is_file()}
    parts = {path.name for path in (ROOT / "docs" / "instances" / "test").iterdir()}
    kit = {"score.py", "instance.schema.json", "instances/about.md"}
    kit |= {f"instances/test/{name}" for name in parts}
    assert held == sources | scenarios | {"planner/py.typed", *(f"planner/kit/{n}" for n in kit)}
    assert "planner/sumo_nets/grid5x5/scenario.toml" in scenarios


def test_it_plans_where_there_is_no_checkout(installed: Path, tmp_path: Path) -> None:
    path = os.pathsep.join([str(installed), os.environ.get("PYTHONPATH", "")])
    found = run("-c", "import planner; print(planner.__file__)", folder=tmp_path, PYTHONPATH=path)
    assert Path(found.strip()).is_relative_to(installed)
    planner = installed / "bin" / "planner"
    planned = run(
        planner, "plan", "figure1", "--method", "exhaustive", folder=tmp_path, PYTHONPATH=path
    )
    assert "\nexhaustive: " in planned
    assert list(tmp_path.iterdir()) == []
