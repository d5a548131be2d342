"""What --help shows: the same summaries everywhere, and examples that can be typed."""

import shlex
import subprocess
import sys

import pytest

from planner.cli import COMMANDS, EXAMPLES, _examples_text, command_named, parser_for


@pytest.mark.parametrize("command", ["", *(name for name, _ in COMMANDS)])
def test_examples_are_understood(command: str) -> None:
    examples = command_named(command).EXAMPLES if command else EXAMPLES
    assert examples
    for typed, _ in examples:
        words = shlex.split(typed)
        assert words[0] == (command or words[0])
        assert callable(parser_for(words).parse_args(words).run)
    assert max(map(len, _examples_text(examples).splitlines())) <= 80


@pytest.mark.parametrize("command", ["", *(name for name, _ in COMMANDS)])
def test_help_fits_a_window_of_80_columns(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    words = [*filter(None, [command]), "--help"]
    with pytest.raises(SystemExit):
        parser_for(words).parse_args(words)
    text = capsys.readouterr().out
    assert f"usage: planner {command}".strip() in text
    assert [line for line in text.splitlines() if len(line) > 80] == []


@pytest.mark.parametrize(("name", "summary"), COMMANDS)
def test_the_list_of_commands_has_their_summaries(name: str, summary: str) -> None:
    assert summary == command_named(name).SUMMARY
    assert f" {name} {summary}" in " ".join(parser_for([]).format_help().split())


def test_only_the_file_of_the_typed_command_is_loaded() -> None:
    code = """import sys
from planner.cli import COMMANDS, parser_for
parser_for([])
names = {f"planner.cli.{name}" for name, _ in COMMANDS}
assert not names & set(sys.modules)
parser_for(["fly", "DIR"])
assert names & set(sys.modules) == {"planner.cli.fly"}"""
    subprocess.run([sys.executable, "-c", code], check=True)
