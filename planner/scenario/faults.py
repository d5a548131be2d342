"""Faults of a scenario's tables in plain words: the key, what is wrong and the remedy."""

import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from planner.errors import Fault
from planner.messages import as_written, suggestion

# What the checks of a single value report, by the name of the check.
SHOULD = {
    "model_type": "should be a table",
    "model_attributes_type": "should be a table",
    "dict_type": "should be a table",
    "tuple_type": "should be a list",
    "list_type": "should be a list",
    "string_type": "should be text in quotes",
    "float_type": "should be a number",
    "int_type": "should be a whole number",
    "int_from_float": "should be a whole number",
    "bool_type": "should be true or false",
    "finite_number": "should be a finite number",
    "greater_than": "should be greater than {gt:g}",
    "greater_than_equal": "should be at least {ge:g}",
    "less_than_equal": "should be at most {le:g}",
    "literal_error": "should be {expected}",
    "union_tag_invalid": "should be a table of a known kind",
    "too_long": "has too many values",
}


def faults_of(key: str, model: type, errors: Iterable[Mapping[str, Any]]) -> Iterator[Fault]:
    """Yield each thing that is wrong with a section.

    Parameters
    ----------
    key
        The section's name.
    model
        Its class; the descriptions of its fields are the remedies.
    errors
        What the check of the section reports.
    """
    for error in errors:
        unknown = error["type"] == "extra_forbidden"
        yield Fault(dotted(key, error["loc"]), _what(error, model), unknown)


def dotted(key: str, place: Sequence[str | int]) -> str:
    """Return the dotted key of a place in a section.

    Names that begin with ~ mark the checker's branches; nobody writes them.
    """
    written = [part for part in place if not _is_branch(part)]
    return key + "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in written)


def _is_branch(part: str | int) -> bool:
    return isinstance(part, str) and part.startswith("~")


def _what(error: Mapping[str, Any], model: type) -> str:
    kind, context = error["type"], error.get("ctx", {})
    known, remedy = _known(model, error["loc"])
    if kind == "extra_forbidden":
        return f"is not a known key; {suggestion(str(error['loc'][-1]), known)}"
    if kind == "missing":
        return f"is missing; give {remedy}"
    if kind == "too_short":
        return f"is empty; give {remedy}"
    if kind == "value_error":
        return str(context["error"])
    otherwise = "one of these" if error["loc"] else "its keys one by one"
    what = SHOULD.get(kind, error["msg"].replace("Input ", "")).format_map(context)
    return f"{what}, not {as_written(error['input'])}; give {remedy or otherwise}"


def _known(model: type, place: Sequence[str | int]) -> tuple[list[str], str]:
    """Return the keys known beside the last part of a place, and the nearest description."""
    models: list[Any] = [model]
    known: list[str] = []
    remedy = ""
    for part in place:
        if isinstance(part, int):
            continue
        if _is_branch(part):
            models = [m for m in models if m.__name__ == str(part)[1:]]
            continue
        fields = {name: field for m in models for name, field in m.model_fields.items()}
        known = list(fields)
        field = fields.get(str(part))
        remedy = (field.description or "") if field else remedy
        models = _models(field.annotation) if field else []
    return known, remedy


def _models(annotation: Any) -> list[Any]:
    """Return the sections that a field may hold."""
    if isinstance(annotation, type) and hasattr(annotation, "model_fields"):
        return [annotation]
    return [model for inner in typing.get_args(annotation) for model in _models(inner)]
