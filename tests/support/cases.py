"""Of many cases alike the gate tries some, and `pytest -m long` the others."""

from typing import Any

import pytest


def some_in_the_gate(many: int, in_gate: int) -> list[Any]:
    """Numbers from 0, as values for a parameter: those that the gate leaves out are marked."""
    rest = [pytest.param(number, marks=pytest.mark.long) for number in range(in_gate, many)]
    return [*range(in_gate), *rest]
