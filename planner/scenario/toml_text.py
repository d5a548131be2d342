"""Scenarios and values as TOML text."""

import datetime
import json
import math
import typing
from typing import Any

from pydantic.fields import FieldInfo

from planner.scenario.sections import SECTIONS, Scenario


def scenario_text(scenario: Scenario) -> str:
    """Return a whole scenario with its defaults, as a file that gives the same scenario again.

    Beside each key stands what is known of it. Keys that have no value are left out.
    """
    content = scenario.as_dict()
    if content["truth"] == content["target"]:
        del content["truth"]  # what it is where nothing is said
    lines = [f"title = {toml_text(content.pop('title'))}"]
    for name, values in content.items():
        several = isinstance(values, list)
        for table in values if several else [values]:
            lines += ["", f"[[{name}]]" if several else f"[{name}]"]
            fields = SECTIONS[name].model_fields
            for key, value in table.items():
                told = _meaning(fields[key]) if key in fields else None
                lines.append(f"{key} = {toml_text(value)}" + (f"  # {told}" if told else ""))
    return "\n".join(lines)


def _meaning(field: FieldInfo) -> str | None:
    """Return what is known of a key: its description, or the words that it may hold."""
    if field.description is None and typing.get_origin(field.annotation) is typing.Literal:
        *words, last = map(toml_text, typing.get_args(field.annotation))
        return f"{', '.join(words)} or {last}"
    return field.description


def toml_text(value: Any) -> str:
    """Return a value as TOML writes it on one line.

    Raises
    ------
    ValueError
        If it is a date or a time, which scenarios write in quotes, or no finite number.
    """
    if isinstance(value, dict):
        inner = (f"{json.dumps(key)} = {toml_text(item)}" for key, item in value.items())
        return "{ " + ", ".join(inner) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_text, value)) + "]"
    if isinstance(value, datetime.date | datetime.time):
        raise ValueError(f'is a date or a time; write it in quotes, as "{value}"')
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError("is no finite number; give one")
    # TOML knows no escaped surrogates, as JSON has for what is beyond ASCII.
    return json.dumps(value, ensure_ascii=False)
