"""Times and lengths as people read them, and the look of tables."""

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from planner.messages import unparted

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.table import Table


def time_unit(longest_s: float) -> tuple[str, float]:
    """Return the unit in which times up to the given one are shown, and its seconds."""
    return ("min", 60.0) if longest_s >= 1200 else ("s", 1.0)


def length(metres: float) -> str:
    """Return a length in metres below a kilometre, else in kilometres to three digits."""
    if metres < 999.5:
        return f"{metres:.0f} m"
    return f"{metres / 1000:,.0f} km" if metres >= 1e6 else f"{metres / 1000:.3g} km"


def km(metres: float) -> str:
    """Return a length in whole kilometres."""
    return f"{metres / 1000:.0f} km"


def titled_table(title: str) -> "Table":
    """Return a table without rows, its title, if any, above it on the left."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    return Table(title=Text(title) if title else None, box=box.SIMPLE_HEAD, title_justify="left")


def listed(lines: Iterable[str]) -> "Table":
    """Return lines as a list, each behind a dash; what goes on below stands under its beginning."""
    from rich.table import Table
    from rich.text import Text

    table = Table.grid(padding=(0, 1))
    for line in lines:
        table.add_row("-", Text(unparted(line), overflow="fold"))
    return table


EDGE, BETWEEN = 1, 3  # characters of a table beside its cells


class Column(NamedTuple):
    """A column of a table that fits its window."""

    header: str  # lines are shown one below the other
    rank: int = 0  # those with the greatest go first where there is no room; 0: it always stays
    left: bool = False  # whether its cells stand on the left
    wraps: bool = False  # whether its cells may be parted between words


class FittingTable:
    """A table whose cells stay whole: columns go where the window has no room for all of them."""

    def __init__(self, title: str, columns: Sequence[Column], *, caption: str = "") -> None:
        self.title, self.columns, self.caption = title, tuple(columns), caption
        self.rows: list[tuple[str, ...]] = []
        self._section_ends: list[int] = []

    def add_row(self, *cells: str) -> None:
        """Add a row, one cell for each column; in those that wrap a number keeps to its unit."""
        columns = zip(self.columns, cells, strict=True)
        self.rows.append(tuple(unparted(cell) if c.wraps else cell for c, cell in columns))

    def end_section(self) -> None:
        """Leave a gap below the rows so far."""
        self._section_ends.append(len(self.rows))

    def __rich_console__(
        self, _: "Console", options: "ConsoleOptions"
    ) -> "Iterator[RenderableType]":
        shown, (widths, wanted) = list(range(len(self.columns))), self._widths()
        while EDGE + sum(widths[k] + BETWEEN for k in shown) > options.max_width:
            least = max(shown, key=lambda k: self.columns[k].rank)
            if self.columns[least].rank == 0:
                break
            shown.remove(least)
        room = options.max_width - EDGE - sum(widths[k] + BETWEEN for k in shown)
        more = _shared_out(max(0, room), [wanted[k] - widths[k] for k in shown])
        yield self._table(shown, [widths[k] + extra for k, extra in zip(shown, more, strict=True)])
        gone = [c.header.replace("\n", " ") for k, c in enumerate(self.columns) if k not in shown]
        if gone:
            yield f"a wider window also shows: {', '.join(gone)}"
        if self.caption:
            yield unparted(self.caption)

    def _widths(self) -> tuple[list[int], list[int]]:
        """Return how wide each column has to be at least, and to have every cell in one line."""
        from rich.cells import cell_len

        cells = [
            (
                *column.header.split("\n"),
                *(line for row in self.rows for line in row[k].split("\n")),
            )
            for k, column in enumerate(self.columns)
        ]
        parts = [
            [word for cell in some for word in (cell.split() if column.wraps else [cell])] or [""]
            for column, some in zip(self.columns, cells, strict=True)
        ]
        least, whole = ([max(map(cell_len, some)) for some in those] for those in (parts, cells))
        return least, whole

    def _table(self, shown: Sequence[int], widths: Sequence[int]) -> "Table":
        table = titled_table(self.title)
        for k, width in zip(shown, widths, strict=True):
            header, _, left, _ = self.columns[k]
            table.add_column(header, justify="left" if left else "right", width=width)
        for number, row in enumerate(self.rows, 1):
            table.add_row(*(row[k] for k in shown), end_section=number in self._section_ends)
        return table


def _shared_out(room: int, wanted: Sequence[int]) -> list[int]:
    """Return what each gets of a room: all that it wants, or as much as all others that do not."""
    given = [0] * len(wanted)
    by_want = sorted(range(len(wanted)), key=wanted.__getitem__)
    for number, k in enumerate(by_want):
        given[k] = min(wanted[k], room // (len(wanted) - number))
        room -= given[k]
    return given
