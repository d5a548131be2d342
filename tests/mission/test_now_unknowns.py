"""What a plan's odds hang on, told apart among the targets that it was evaluated on."""

from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.futures.futures import Futures
from planner.mission.now_events import Condition, Outlook, Unknown
from planner.mission.now_unknowns import every_unknown, unknowns
from planner.report import call_screen

MANY, HORIZON_S, TAKE_OFF_S = 120, 600.0, 200.0


def made(*, heading: bool = False) -> Any:
    """Half of the cars go north at 10 m/s and are found, half south at 5 m/s; a tenth parks."""
    north = np.arange(MANY) % 2 == 0
    parks = np.arange(MANY) % 10 < 2
    ends_s = np.where(parks, 100.0, HORIZON_S)
    far_m = np.where(north, 10.0, -5.0) * ends_s
    side_m = np.where(np.arange(MANY) < MANY // 2, -50.0, 50.0)
    futures = Futures(
        np.column_stack([np.zeros(MANY), ends_s]).ravel(),
        np.repeat(side_m, 2),
        np.column_stack([np.zeros(MANY), far_m]).ravel(),
        np.arange(MANY + 1) * 2,
        np.full(MANY, 1.0 / MANY),
        np.zeros(MANY, bool),
    )
    seen_at = np.where(north & (np.arange(MANY) % 6 != 0), 300.0, np.inf)
    evaluated = Evaluation(seen_at, futures.weight, futures.end_s, Objective(HORIZON_S))
    return SimpleNamespace(
        fresh=SimpleNamespace(futures=futures),
        call=SimpleNamespace(
            tables={"target": {"last_seen_ago_s": 0.0}},
            words=SimpleNamespace(heading="N" if heading else None),
            called_at=datetime(2026, 5, 1, 14, 7, tzinfo=UTC),
        ),
        opened=SimpleNamespace(network=None, scenario=SimpleNamespace(take_off_s=TAKE_OFF_S)),
        trial=SimpleNamespace(evaluated=evaluated),
    )


def by_name(found: tuple[Condition, ...]) -> dict[str, tuple[float, float]]:
    return {one.name: (one.share or 0.0, one.evaluated.detection_probability) for one in found}


def test_targets_are_told_apart_by_what_they_did() -> None:
    found = {one.name: by_name(one.answers) for one in every_unknown(made())}
    assert found["which way it went"] == {
        "north": pytest.approx((0.5, 2 / 3)),
        "south": pytest.approx((0.5, 0.0)),
    }
    speeds = found["how fast it drove"]
    assert set(speeds) == {"under 20 km/h", "over 35 km/h"}  # 18 and 36 km/h
    assert found["whether it stands by take-off"].keys() == {"drives", "stands"}
    assert found["whether it stands by take-off"]["stands"][0] == pytest.approx(0.2)
    assert found["on which side of the place it was"].keys() == {"east", "west"}


def test_what_matters_beyond_chance_comes_first_and_alone() -> None:
    names = [one.name for one in unknowns(made())]
    assert set(names) == {"which way it went", "how fast it drove"}
    assert [one.name for one in unknowns(made(heading=True))] == ["how fast it drove"]


def test_it_is_told_with_options_and_intervals() -> None:
    plan = made()
    outlook = Outlook(1.0, plan, (), unknowns(plan), None, None)
    lines = [*call_screen._matters(outlook, HORIZON_S)]
    text = " ".join(line.strip() for line in lines)
    assert max(map(len, lines)) <= call_screen.WIDTH
    assert text.startswith("would change it: if you ask, and say it; found by 14:17 (95 %), if so:")
    assert "- which way it went (--heading): north 67 (54 .. 77; 50 % are so), south 0 (" in text
    assert not [*call_screen._matters(Outlook(1.0, plan, (), (), None, None), HORIZON_S)]
    assert isinstance(outlook.unknowns[0], Unknown)
