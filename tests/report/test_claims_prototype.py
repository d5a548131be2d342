"""An earlier program's figures beside ours: what is apart, and what chance explains."""

import re

import pytest

from experiment_results import exhaustive_until, figure8
from planner.experiments.run import Results
from planner.report import claims_prototype
from planner.report.claims import Claim
from planner.report.estimates import BEFORE_GOAL, EXPECTED, U0

OWN = {"block": "greedy", "method": "greedy", "greedy.direction": "own"}
LATE = {"block": "300 s", "method": "greedy", "greedy.direction": "both"}


def seeds(who: dict[str, str], *values: float, before: float = 0.72) -> list[dict[str, object]]:
    u0 = 60e3 if who is LATE else 500e3
    return [
        {**who, "id": f"{seed}", "seed": seed, U0: u0, EXPECTED: value, BEFORE_GOAL: before}
        for seed, value in enumerate(values, 1)
    ]


def claim_of(*rows: dict[str, object], **more: Results) -> Claim:
    (claim,) = claims_prototype.claims({"prototype": Results(tuple(rows), 0, {}), **more})
    return claim


def test_nothing_to_compare() -> None:
    assert not list(claims_prototype.claims({"figure8": figure8(exhaustive_until(120))}))


@pytest.mark.parametrize(
    ("values", "apart"),
    [
        ((6950.0, 6960.0), False),
        ((7050.0, 7060.0), True),
        ((6800.0, 7300.0), False),  # 94 s more, but by chance
        ((6970.0,), False),  # no chance in it: the prototype's targets alone are drawn
        ((7000.0,), True),
    ],
)
def test_what_is_apart(values: tuple[float, ...], apart: bool) -> None:
    claim = claim_of(*seeds(OWN, *values))
    assert f"{2 - apart} of 2 figures do" in claim.finding
    assert ("greedy, own direction, at 500 km" in claim.finding) == apart
    (cell,) = re.findall(r"(\S+ s[^|]*) / 6,956 s", claim.table)
    assert cell.startswith("**") == cell.endswith("**") == apart


def test_shares_are_compared_as_such() -> None:
    assert "| 72.0 % / 72 % |" in claim_of(*seeds(OWN, 6956.0)).table
    assert "| **60.0 %** / 72 % |" in claim_of(*seeds(OWN, 6956.0, before=0.6)).table


def test_groups_of_ten_seeds() -> None:
    claim = claim_of(*seeds(LATE, *[2400.0, 2800.0] * 5, *[2500.0, 2900.0] * 5))
    assert "groups of ten have means of 2,600, 2,700 s" in claim.table
    assert "prototype's ten one of 2,583 s" in claim.table
    assert "All 20 together: 2,650 s (" in claim.table
    assert "groups of ten" not in claim_of(*seeds(LATE, *[2400.0] * 19)).table


def test_targets_from_the_origin_are_those_of_figure_8() -> None:
    claim = claim_of(*seeds(OWN, 6956.0), figure8=figure8(exhaustive_until(120)))
    assert "| exhaustive, 20 m/s, 60 km | **500 s** / 1,023 s | not traced" in claim.table
    assert "| paths on which exhaustive is better, 60 km | 1 / 71 of 1 |" in claim.table
