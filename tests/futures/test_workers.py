"""Processes that work for this one."""

import math
import operator
import os
import time
from collections.abc import Iterator

import pytest

from planner.errors import SumoError
from planner.futures import workers
from planner.futures.worker import running


@pytest.fixture(autouse=True)
def _none_left() -> None:
    workers.dismiss()


def test_answers_come_in_the_order_of_the_tasks() -> None:
    numbers = [float(n) for n in range(40)]
    answers = workers.in_processes(math.sqrt, numbers, workers=3)
    assert list(answers) == [math.sqrt(n) for n in numbers]


def test_processes_are_used_again() -> None:
    first, second = (
        set(workers.in_processes(operator.methodcaller("__call__"), [os.getpid] * 8, workers=2))
        for _ in range(2)
    )
    assert first | second == first
    assert os.getpid() not in first


def test_no_more_processes_than_tasks() -> None:
    assert list(workers.in_processes(abs, [-1], workers=50)) == [1]
    assert len(running) == 1


def test_an_error_is_raised_here_and_ends_the_others() -> None:
    begun = time.monotonic()
    with pytest.raises(ValueError, match="math domain") as raised:
        list(workers.in_processes(math.sqrt, [4.0, -1.0, 9.0], workers=1))
    assert "Traceback" in raised.value.__notes__[0]
    assert not running
    assert time.monotonic() - begun < 20


def test_a_process_that_dies_is_told_of() -> None:
    with pytest.raises(SumoError, match="ended with code 3"):
        list(workers.in_processes(os._exit, [3], workers=1))
    assert list(workers.in_processes(abs, [-2], workers=1)) == [2]


def test_what_a_task_prints_does_not_get_in_between() -> None:
    assert list(workers.in_processes(print, ["hello", "there"], workers=1)) == [None, None]


def test_stopping_early_ends_the_processes() -> None:
    answers = workers.in_processes(abs, [-1, -2, -3], workers=1)
    assert next(answers) == 1
    answers.close()  # type: ignore[attr-defined]
    assert not running


def counted(upto: int) -> Iterator[int]:
    yield from range(upto)


def counted_and_failed(upto: int) -> Iterator[int]:
    yield from range(upto)
    raise ValueError("no further")


def test_answers_may_come_in_parts() -> None:
    parts = list(workers.in_parts(counted, [3, 0, 2], workers=2))
    assert [part for task, part in parts if task == 0] == [0, 1, 2]
    assert sorted(task for task, _ in parts) == [0, 0, 0, 2, 2]


def test_parts_come_before_the_error_that_ends_them() -> None:
    parts = workers.in_parts(counted_and_failed, [2], workers=1)
    assert [next(parts), next(parts)] == [(0, 0), (0, 1)]
    with pytest.raises(ValueError, match="no further"):
        next(parts)
