"""Times as people write them."""

import datetime
import re

from planner.errors import InputError
from planner.messages import shown


def seconds(value: object) -> float:
    """Return the seconds of a number, or of a text "H:M:S".

    Raises
    ------
    InputError
        If it is neither.
    """
    if isinstance(value, datetime.time):  # TOML reads 01:30:00 without quotes as a time of day
        value = value.isoformat()
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if isinstance(value, str):
        parts = re.fullmatch(r"(\d+):([0-5]?\d):([0-5]?\d(?:\.\d*)?)", value.strip())
        if parts is not None:
            return int(parts[1]) * 3600.0 + int(parts[2]) * 60.0 + float(parts[3])
        if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", value.strip()):
            return float(value)
    raise InputError(f'should be seconds or "H:M:S", not {shown(value)}; write 5400 or "1:30:00"')
