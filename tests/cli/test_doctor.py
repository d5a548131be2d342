"""The doctor finds what is broken and names the remedy."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from planner.cli import doctor
from planner.cli.doctor import Finding, examine


def fault(findings: list[Finding], what: str) -> Finding:
    found = [finding for finding in findings if finding.what == what]
    assert len(found) == 1
    assert not found[0].fine
    assert found[0].remedy
    return found[0]


def test_nothing_is_wrong_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / "cache"))
    findings = examine()
    assert [finding for finding in findings if not finding.fine or finding.remedy] == []
    told = {finding.what: finding.found for finding in findings}
    assert told["SUMO's library loads"].startswith("SUMO 1.28")
    assert "1.28" in told["netconvert runs"]
    assert told["cache can be written"] == str(tmp_path / "cache")


def test_a_missing_system_library_gets_the_apt_line(monkeypatch: pytest.MonkeyPatch) -> None:
    message = "ImportError: libGL.so.1: cannot open shared object file: No such file or directory"

    def broken(*args: object, **kwargs: object) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess([], 1, "", f"Traceback\n{message}\n")

    monkeypatch.setattr(doctor.subprocess, "run", broken)
    finding = fault(list(doctor._library()), "SUMO's library loads")
    assert finding.found == message
    assert "apt-get install" in finding.remedy
    assert {"libgl1", "libx11-6", "libxext6", "libxrender1", "libatomic1"} <= set(
        finding.remedy.split()
    )


def test_a_sumo_without_its_towns_is_a_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (finding,) = doctor._town()
    assert finding.fine
    assert finding.found.endswith("osm.net.xml")
    monkeypatch.setattr("planner.network.sumo.sumo_home", lambda: tmp_path)
    finding = fault(list(doctor._town()), finding.what)
    assert "holds no file tools/game/DRT/osm.net.xml" in finding.found
    assert "eclipse-sumo" in finding.remedy


def test_a_program_that_dies_or_hangs_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    def hangs(*args: object, **kwargs: object) -> None:
        raise subprocess.TimeoutExpired("sumo", 60)

    monkeypatch.setattr(doctor.subprocess, "run", hangs)
    assert "no answer" in fault(list(doctor._programs()), "sumo runs").found


@pytest.mark.parametrize(
    ("package", "found", "remedy"),
    [
        ("pyarrow", "24.0.0", "'pyarrow==23.*'"),
        ("pyarrow", "230.0", "'pyarrow==23.*'"),
        ("sumo", "1.27.0", "'eclipse-sumo==1.28.*'"),
        ("libsumo", None, "'libsumo==1.28.*'"),
        ("numba", None, "'numba'"),
        ("planner", None, "pip install ."),
    ],
)
def test_a_wrong_version_is_told(
    monkeypatch: pytest.MonkeyPatch, package: str, found: str | None, remedy: str
) -> None:
    right = doctor.versions()
    monkeypatch.setattr(doctor, "versions", lambda: {**right, package: found})
    finding = fault(list(doctor._packages()), package)
    assert remedy in finding.remedy
    assert finding.found == (found or "not installed")
    assert sum(not other.fine for other in doctor._packages()) == 1


def test_a_cache_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / "file" / "cache"))
    finding = fault(list(doctor._cache()), "cache can be written")
    assert "PLANNER_CACHE" in finding.remedy


def test_compiled_code_that_answers_wrongly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_see_a_target_at_rest", lambda: 10.0)
    assert "10.0" in fault(list(doctor._compiler())[:1], "compiled code runs").found


def test_a_compiler_that_fails_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails() -> float:
        raise ImportError("llvmlite has no such thing")

    monkeypatch.setattr(doctor, "_see_a_target_at_rest", fails)
    assert "llvmlite" in fault(list(doctor._compiler()), "compiled code runs").found


def test_it_answers_where_libraries_are_broken() -> None:
    code = """import sys
sys.modules |= dict.fromkeys(["numba", "numpy", "pyarrow", "pydantic", "scipy"])
from planner.cli import main
sys.exit(main(["doctor", "--json"]))"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "")
    findings = {one["what"]: one for one in json.loads(done.stdout)["findings"]}
    assert findings["netconvert runs"]["fine"]
    assert not findings["compiled code runs"]["fine"]
