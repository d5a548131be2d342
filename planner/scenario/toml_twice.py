"""What stands twice in a TOML text, by its name: Python's parser says only where it stopped."""

import re

from planner.messages import as_written

KEY = re.compile(r"""[ \t]*((?:[\w-]+|"[^"\n]*"|'[^'\n]*')(?:[ \t]*\.[^=\n]*)?)[ \t]*=""")
TABLE = re.compile(r"""[ \t]*(\[\[?[^\]\n]*\]\]?)""")


def twice(text: str, what: str, where: str) -> str | None:
    """Return the fault of a key or a table that stands a second time, None if it is another one.

    Parameters
    ----------
    what, where
        What the parser says of the text, and the place, such as ``line 3, column 7``.
    """
    inline = re.fullmatch(r"Duplicate inline table key ('.*'|\".*\")", what)
    if inline:
        return _said(as_written(inline[1][1:-1]), "leave one of them out")
    line = re.match(r"line (\d+)|end of document", where)
    if line is None or not what.startswith(("Cannot overwrite", "Cannot declare")):
        return None
    # A value may go over several lines; its key stands on the first.
    for written in reversed(text.split("\n")[: int(line[1]) if line[1] else None]):
        key, table = KEY.match(written), TABLE.match(written)
        if key:
            return _said(key[1].strip(), "leave one of them out")
        if table:
            return _said(table[1], "put all of its keys into one of them")
    return None


def _said(name: str, remedy: str) -> str:
    return f"{name} stands there a second time; {remedy}"
