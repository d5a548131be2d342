"""Times, lengths and shares as people read them, and the look of tables."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
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


def percent(share: float) -> str:
    """Return a share in per cent, to one decimal."""
    return f"{share * 100:.1f} %"


def titled_table(title: str) -> "Table":
    """Return a table without rows, its title, if any, above it on the left."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    return Table(title=Text(title) if title else None, box=box.SIMPLE_HEAD, title_justify="left")
