"""The schema of plan.json as it is published, held against plans."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema

PATH = Path(__file__).parents[2] / "docs" / "plan.schema.json"


@cache
def _validator() -> Any:
    schema = json.loads(PATH.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def refuse(content: Any) -> None:
    """Raise jsonschema.ValidationError unless it is a plan, and JSON as it stands in a file."""
    _validator().validate(json.loads(json.dumps(content)))
