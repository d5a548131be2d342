"""What --help shows can be typed."""

import shlex

import pytest

from planner.cli import _parser
from planner.cli.examples import OF_ALL, OF_COMMAND, told


@pytest.mark.parametrize("command", ["", *OF_COMMAND])
def test_examples_are_understood(command: str) -> None:
    examples = OF_COMMAND.get(command, OF_ALL)
    assert examples
    for typed, _ in examples:
        words = shlex.split(typed)
        assert words[0] == (command or words[0])
        assert callable(_parser().parse_args(words).run)
    assert max(map(len, told(examples).splitlines())) <= 80
