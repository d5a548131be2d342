"""The installation of the two shell commands, with programs that only pretend."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[1] / "tools"

# Notes how it is called; answers like a Python of the version in $AGE, with pip and venv.
PYTHON = """#!/bin/sh
case "$*" in
    --version) echo "Python 3.$AGE" ;;
    *version_info*exit*|*exit*version_info*) [ "$AGE" -ge 11 ] ;;
    *ensurepip*venv*) true ;;
    "-m venv "*)
        mkdir -p .venv/bin && cp "$0" .venv/bin/python
        echo "VIRTUAL_ENV=$(pwd -P)/.venv" >.venv/bin/activate
        echo venv >>"$LOG" ;;
    "-m pip --version") true ;;
    "-m pip install"*)
        for last; do :; done
        echo "pip $last" >>"$LOG"
        [ -z "${PIP_FAILS:-}" ] || exit 1
        touch .venv/bin/planner && chmod +x .venv/bin/planner ;;
    *libsumo*) [ -e "$LIBRARIES" ] || { echo "libGL.so.1: cannot open" >&2; exit 1; } ;;
    *) echo "unexpected: $*" >&2; exit 9 ;;
esac
"""
APT = """#!/bin/sh
echo "apt-get $*" >>"$LOG"
case "$*" in *install*) touch "$LIBRARIES" ;; esac
"""


@dataclass
class Place:
    """A folder with the project, and a computer around it that only pretends."""

    folder: Path
    programs: Path
    environment: dict[str, str]

    def program(self, name: str, text: str) -> None:
        (self.programs / name).write_text(text)
        (self.programs / name).chmod(0o755)

    def install(self, extras: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["sh", "-c", f"set -eu; . tools/install.sh; install {extras}"],
            cwd=self.folder,
            env={**self.environment, **environment},
            capture_output=True,
            text=True,
            check=False,
        )

    def log(self) -> list[str]:
        log = Path(self.environment["LOG"])
        lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
        log.unlink(missing_ok=True)
        return lines


@pytest.fixture
def place(tmp_path: Path) -> Place:
    folder, programs = tmp_path / "a clone", tmp_path / "programs"
    (folder / "tools").mkdir(parents=True)
    programs.mkdir()
    shutil.copy(TOOLS / "install.sh", folder / "tools")
    (folder / "pyproject.toml").write_text("[project]\n")
    for name in ("sh", "cksum", "grep", "mkdir", "cp", "rm", "touch", "chmod", "env", "cat"):
        (programs / name).symlink_to(shutil.which(name) or "")
    environment = {
        "PATH": str(programs),
        "LOG": str(tmp_path / "log"),
        "LIBRARIES": str(tmp_path / "libraries"),
        "AGE": "12",
    }
    place = Place(folder, programs, environment)
    place.program("python3", PYTHON)
    place.program("id", "#!/bin/sh\necho 0\n")
    (tmp_path / "libraries").touch()
    return place


def test_sumo_comes_without_bytecode(place: Place) -> None:
    wheels = '"eclipse-sumo==1.28.*", "libsumo==1.28.*"'
    (place.folder / "pyproject.toml").write_text(f"[project]\ndependencies = [{wheels}]\n")
    done = place.install()
    assert done.returncode == 0, done.stderr
    assert place.log() == ["venv", "pip libsumo==1.28.*", "pip ."]
    assert "compiling the searches" in done.stderr


def test_the_second_call_does_nothing(place: Place) -> None:
    first = place.install("dev")
    assert first.returncode == 0, first.stderr
    assert place.log() == ["venv", "pip .[dev]"]
    assert "about a minute and 1.7 GB" in first.stderr
    second = place.install("dev")
    assert (second.returncode, second.stderr, place.log()) == (0, "", [])


def test_dev_contains_the_plain_installation_and_not_the_reverse(place: Place) -> None:
    place.install("dev")
    place.log()
    place.install()
    assert place.log() == []
    shutil.rmtree(place.folder / ".venv")
    place.install()
    assert place.log() == ["venv", "pip ."]
    place.install("dev")
    assert place.log() == ["pip .[dev]"]


def test_changed_requirements_are_installed(place: Place) -> None:
    place.install()
    place.log()
    (place.folder / "pyproject.toml").write_text("[project]\nname = 'other'\n")
    place.install()
    assert place.log() == ["pip ."]


def test_a_venv_made_by_others_is_used(place: Place) -> None:
    bin_folder = place.folder / ".venv" / "bin"
    bin_folder.mkdir(parents=True)
    place.program("python3", PYTHON)
    shutil.copy(place.programs / "python3", bin_folder / "python")
    (bin_folder / "activate").write_text(f"VIRTUAL_ENV='{place.folder.resolve()}/.venv'\n")
    assert place.install().returncode == 0
    assert place.log() == ["pip ."]


def test_a_moved_folder_gets_a_new_venv(place: Place) -> None:
    place.install()
    place.log()
    place.folder = place.folder.rename(place.folder.with_name("moved"))
    done = place.install()
    assert done.returncode == 0
    assert "anew" in done.stderr
    assert place.log() == ["venv", "pip ."]


def test_an_old_python_is_named(place: Place) -> None:
    done = place.install(AGE="9")
    assert done.returncode == 1
    assert "Python 3.11 or later is needed" in done.stderr
    assert "Python 3.9" in done.stderr
    assert not (place.folder / ".venv").exists()


def test_a_failed_installation_is_tried_again(place: Place) -> None:
    done = place.install(PIP_FAILS="1")
    assert done.returncode == 1
    assert "pip failed" in done.stderr
    place.log()
    assert place.install().returncode == 0
    assert place.log() == ["pip ."]


def test_root_gets_missing_libraries(place: Place) -> None:
    Path(place.environment["LIBRARIES"]).unlink()
    place.program("apt-get", APT)
    assert place.install().returncode == 0
    *_, update, install = place.log()
    assert update.startswith("apt-get update")
    assert {"libgl1", "libx11-6", "libxext6", "libxrender1", "libatomic1"} <= set(install.split())


def test_passwordless_sudo_gets_missing_libraries(place: Place) -> None:
    Path(place.environment["LIBRARIES"]).unlink()
    place.program("apt-get", APT)
    place.program("id", "#!/bin/sh\necho 1000\n")
    place.program("sudo", '#!/bin/sh\n[ "$1" != -n ] || shift\n[ "$1" = true ] || exec "$@"\n')
    assert place.install().returncode == 0
    assert "libatomic1" in place.log()[-1]


@pytest.mark.parametrize("sudo", [None, "#!/bin/sh\nexit 1\n"], ids=["none", "asks a password"])
def test_others_are_told_the_command(place: Place, sudo: str | None) -> None:
    Path(place.environment["LIBRARIES"]).unlink()
    place.program("apt-get", APT)
    place.program("id", "#!/bin/sh\necho 1000\n")
    if sudo:
        place.program("sudo", sudo)
    done = place.install()
    assert done.returncode == 1
    line = "sudo apt-get install libgl1 libx11-6 libxext6 libxrender1 libatomic1"
    assert f"install: {line}" in done.stderr.splitlines()
    assert [entry for entry in place.log() if entry.startswith("apt")] == []
    Path(place.environment["LIBRARIES"]).touch()
    assert place.install().returncode == 0


def test_checks_get_a_browser_where_no_password_is_needed(place: Place) -> None:
    place.program("apt-get", APT)
    assert place.install().returncode == 0
    assert [entry for entry in place.log() if entry.startswith("apt")] == []
    assert place.install("dev").returncode == 0
    *_, install = place.log()
    assert {"chromium", "chromium-driver", "xvfb"} <= set(install.split())


def test_a_browser_that_is_there_is_left_alone(place: Place) -> None:
    place.program("apt-get", APT)
    for name in ("chromium", "chromedriver", "Xvfb"):
        place.program(name, "#!/bin/sh\n")
    assert place.install("dev").returncode == 0
    assert place.log() == ["venv", "pip .[dev]"]


def test_checks_do_without_a_browser_where_it_needs_a_password(place: Place) -> None:
    place.program("apt-get", APT)
    place.program("id", "#!/bin/sh\necho 1000\n")
    place.program("sudo", "#!/bin/sh\nexit 1\n")
    done = place.install("dev")
    assert done.returncode == 0
    assert "install: sudo apt-get install chromium chromium-driver xvfb" in done.stderr
    assert place.log() == ["venv", "pip .[dev]"]


def test_the_scripts_are_sound_posix_shell() -> None:
    for script in (*TOOLS.glob("*.sh"), TOOLS.parent / ".ci" / "run"):
        done = subprocess.run(["sh", "-n", str(script)], capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
    assert os.access(TOOLS.parent / ".ci" / "run", os.X_OK)
