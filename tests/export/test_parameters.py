"""The parameters that a flight's times rest on, and files of those that a vehicle has."""

import math
import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.export.parameters import differences, lean_note, parameters, read_parameters
from planner.flight.law import FlightLaw

LAW = FlightLaw(
    15.0,
    acceleration_mps2=1.4,
    corner_m=2.0,
    climb_mps=2.5,
    descend_mps=1.5,
    altitude_m=100.0,
)
OLD = "WPNAV_SPEED,1500\nWPNAV_ACCEL,250\nWPNAV_SPEED_UP,250\nWPNAV_SPEED_DN,150\nRTL_ALT,10000\n"
NEW = "WP_SPD 15\nWP_ACC 1.4\nWP_SPD_UP 2.5\nWP_SPD_DN 1.5\nRTL_ALT_M 100\nATC_ANGLE_MAX 45"
PX4 = """# Onboard parameters
1\t1\tMPC_XY_CRUISE\t15.000000000000000000\t9
1\t1\tMPC_ACC_HOR\t3.0\t9
1\t1\tMPC_Z_V_AUTO_UP\t2.5\t9
1\t1\tMPC_Z_V_AUTO_DN\t1.5\t9
1\t1\tMPC_TILTMAX_AIR\t45\t9
1\t1\tRTL_RETURN_ALT\t60\t9
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "vehicle.param"


@pytest.mark.parametrize("text", [OLD + "ANGLE_MAX,4500", NEW, NEW.lower() + "  # all of it"])
def test_a_vehicle_that_is_set_so_differs_in_nothing(file: Path, text: str) -> None:
    file.write_text(text, encoding="utf-8")
    assert differences(file, parameters(LAW, "ardupilot")) == []


def test_what_differs_is_told_in_the_vehicle_s_own_units(file: Path) -> None:
    file.write_text(OLD.replace("1500", "1000") + "ANGLE_MAX\t3000", encoding="utf-8")
    assert differences(file, parameters(LAW, "ardupilot")) == [
        "WPNAV_SPEED: is 1000, not 1500 cm/s; set it: speed between waypoints",
        "ANGLE_MAX: is 3000, not 4500 cdeg or more; set it: lean limit",
    ]
    file.write_text(NEW.replace("SPD 15", "SPD 12").replace("RTL_ALT_M 100", ""), encoding="utf-8")
    assert differences(file, parameters(LAW, "ardupilot")) == [
        "WP_SPD: is 12, not 15; set it: speed between waypoints",
        "RTL_ALT and RTL_ALT_M: not in it; height of the way home: set 10000 cm",
    ]


def test_px4_s_as_its_ground_station_writes_them(file: Path) -> None:
    file.write_text(PX4, encoding="utf-8")
    assert differences(file, parameters(LAW, "px4")) == [
        "RTL_RETURN_ALT: is 60, not 100 m; set it: height of the way home"
    ]
    with pytest.raises(InputError, match=r"has none of WPNAV_SPEED, .*--autopilot"):
        differences(file, parameters(LAW, "ardupilot"))


def test_wings_have_other_parameters(file: Path) -> None:
    wings = replace(LAW, min_speed_mps=10.0)
    assert parameters(wings, "ardupilot") == []
    file.write_text(OLD, encoding="utf-8")
    with pytest.raises(InputError, match="--params: only parameters of multicopters"):
        differences(file, [])


def test_single_precision_is_no_difference(file: Path) -> None:
    file.write_text(NEW.replace("1.4", "1.39999998").replace("2.5", "2.50000001"), encoding="utf-8")
    assert differences(file, parameters(LAW, "ardupilot")) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"WP_SPD 15 16", "line 1: is no parameter"),
        (b"\nWP_SPD", "line 2: is no parameter"),
        (b"WP_SPD fast", "line 1: is no parameter"),
        (b"WP_SPD nan", "line 1: is no parameter"),
        (b"WP_SPD inf", "line 1: is no parameter"),
        (b"WP_SPD 15\nWP_SPD 16", "line 2: WP_SPD stands twice"),
        (b"\x1b[31m 15", "line 1: is no parameter"),
        (b"\xff\xfe", "is not UTF-8"),
        (b"A 1\n" * 300_000, "holds more than 1 MB"),
    ],
)
def test_files_from_strangers(file: Path, text: bytes, said: str) -> None:
    file.write_bytes(text)
    with pytest.raises(InputError) as caught:
        read_parameters(file)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_pipe_is_no_file_of_parameters(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="no plain file"):
        read_parameters(tmp_path / "pipe")


@settings(max_examples=60)
@given(st.text("A_1.e+-,# \t\n\x1b\u2028é", max_size=30))
def test_any_text_is_read_or_refused(text: str) -> None:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "a.param"
        file.write_text(text, encoding="utf-8")
        with suppress(InputError):
            assert all(map(math.isfinite, read_parameters(file).values()))


def test_what_is_done_at_once_and_what_is_not_known_has_no_parameter() -> None:
    ideal = FlightLaw(25.0, altitude_m=50.0)
    names = {one.names[0][0] for one in parameters(ideal, "ardupilot")}
    assert names == {"WPNAV_SPEED", "RTL_ALT"}
    assert "no recorded flight was so fast" in lean_note(ideal)
    assert lean_note(LAW) == ""
    lines = [one.line for one in parameters(LAW, "ardupilot")]
    assert lines[0] == "WPNAV_SPEED       1500 cm/s (or WP_SPD 15): speed between waypoints"
    assert max(map(len, lines)) <= 80
