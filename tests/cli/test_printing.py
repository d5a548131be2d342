"""Summaries: numbers as a reader wants them."""

import argparse
import json

import pytest

from planner.cli.printing import print_result, summary_lines


def test_inexact_sums_lose_their_last_digits(capsys: pytest.CaptureFixture[str]) -> None:
    summary = {
        "sum": sum([0.1] * 10),
        "elsewhere": 1.0 - sum([0.1] * 10),
        "deep": [{"d": (419.9999999999999, 1019.9999999999998)}],
        "small": 1.25e-7,
        "measured": 1066.4109846577087,
        "count": 3,
        "sure": True,
        "none": None,
    }
    print_result(argparse.Namespace(json=True), summary, [])
    assert json.loads(capsys.readouterr().out) == {
        "sum": 1.0,
        "elsewhere": 0.0,
        "deep": [{"d": [420.0, 1020.0]}],
        "small": 1.25e-7,
        "measured": 1066.4109846577087,
        "count": 3,
        "sure": True,
        "none": None,
    }


@pytest.mark.parametrize("width", range(24, 60))
def test_a_number_stands_with_its_unit(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    text = "15 m/s, 1.4 m/s2, corners within 2 m, up to 100 m at 2.5 m/s, 95 % by 7 men"
    print_result(argparse.Namespace(json=False), {}, [text])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    assert " ".join(map(str.rstrip, lines)) == text
    assert not [one for one in lines if one.startswith(("m/s", "m ", "m,", "%"))]


def test_lines_of_a_summary_hold_six_digits() -> None:
    summary = {"net": "a.net.xml", "length_km": 123.45678901234, "roads": 1234567}
    assert summary_lines(summary) == [
        "net        a.net.xml",
        "length_km  123.457",
        "roads      1234567",
    ]


def test_a_path_is_told_in_one_piece(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    path = "/" + "a-long-folder/" * 5 + "call.toml"
    print_result(argparse.Namespace(json=False), {}, [f"to plan it: planner plan {path}"])
    assert path in capsys.readouterr().out
