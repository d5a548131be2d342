"""Where the target may be at a time: as a table, and as files."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.clock import clock
from planner.futures.state_at import QUANTILES, RoadState, State
from planner.mission.opening import OpenScenario
from planner.report.csv_file import write_csv
from planner.report.formats import percent, titled_table
from planner.report.picture import where_picture

if TYPE_CHECKING:
    from rich.table import Table

TABLE, PICTURE = "where.csv", "where.png"
FILES = (TABLE, PICTURE)


def where_table(
    rows: Sequence[RoadState], *, time_s: float, elsewhere_probability: float, most: int = 20
) -> "Table":
    """Return where the target is believed to be, road by road, the likeliest first.

    Parameters
    ----------
    elsewhere_probability
        Probability that it is gone, never was there, or has not set out yet.
    most
        How many roads are named; the others stand in one row.
    """
    table = titled_table(f"where the target may be at {clock(time_s)}")
    table.add_column("road")
    table.add_column("probability", justify="right")
    quantiles = ", ".join(f"{share:.0%}" for share in QUANTILES)
    table.add_column(f"distance, m ({quantiles})", justify="right")
    table.add_column("speed, m/s", justify="right")
    for row in rows[:most]:
        distance = " ".join(f"{metres:>7,.0f}" for metres in row.distance_m)
        speed = " ".join(f"{mps:5.1f}" for mps in row.speed_mps)
        table.add_row(row.edge, percent(row.probability), distance, speed)
    if len(rows) > most:
        rest = sum(row.probability for row in rows[most:])
        table.add_row(f"{len(rows) - most} other roads", percent(rest), "", "")
    if elsewhere_probability > 1e-9:
        table.add_row("not on the roads", percent(elsewhere_probability), "", "")
    return table


def write_where(
    folder: Path, opened: OpenScenario, state: State, roads: Sequence[RoadState]
) -> None:
    """Write ``where.csv`` and ``where.png``."""
    rows = []
    for road in roads:
        row: dict[str, Any] = {"road": road.edge, "probability": road.probability}
        for name in ("distance_m", "speed_mps"):
            quantiles = zip(QUANTILES, getattr(road, name), strict=True)
            row |= {f"{name}_q{share * 100:02.0f}": value for share, value in quantiles}
        rows.append(row)
    write_csv(folder / TABLE, rows)
    where_picture(folder / PICTURE, opened.network, state, title=opened.scenario.title)
