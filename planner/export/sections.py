"""A text in sections, of several things: what is so of all of them is told once."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple


class Section(NamedTuple):
    """Lines that belong together."""

    lines: Sequence[str]
    head: str = ""  # a line above them, where there are any
    whole: bool = False  # whether they have a meaning together only, as rows of a table

    @property
    def all_lines(self) -> list[str]:
        """Its lines below its head; none if it has none."""
        return [self.head, *self.lines] if self.head and self.lines else [*self.lines]

    def named(self, name: str) -> list[str]:
        """Return its lines with a name before each, or before the first where they are a whole."""
        lines = self.all_lines
        first = next((k for k, line in enumerate(lines) if line), 0)
        return [
            f"{name}: {line}" if name and line and not (self.whole and k > first) else line
            for k, line in enumerate(lines)
        ]

    def without(self, lines: Iterable[str]) -> "Section":
        """Return it without some of its lines."""
        left_out = frozenset(lines)
        return self._replace(lines=[line for line in self.lines if line not in left_out])


def told_once(each: Sequence[Sequence[Section]]) -> tuple[list[Section], list[list[Section]]]:
    """Return the sections that all things have, and what is left of each one's own.

    Parameters
    ----------
    each
        The sections of each thing: as many of each, in the same order, empty ones too.
    """
    shared = [_shared(sections) for sections in zip(*each, strict=True)]
    own = [
        [section.without(common.lines) for section, common in zip(sections, shared, strict=True)]
        for sections in each
    ]
    return shared, own


def _shared(sections: Sequence[Section]) -> Section:
    """Return the lines that all of some sections have."""
    first, *others = sections
    if first.whole:
        return first if all(one == first for one in others) else first._replace(lines=())
    everywhere = frozenset(first.lines).intersection(*(one.lines for one in others))
    return first.without(line for line in first.lines if line not in everywhere)
